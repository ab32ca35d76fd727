"""Axial inertia: the mounts carry thrust minus engine mass times longitudinal specific force.

    thrust share = mount force + mass_kg * g0 * accel_x_g

accel_x_g is the specific force along the body axis, forward positive: what an accelerometer feels, so the component
of gravity in a climb is in it. For PH-LAB an installed engine has 373 kg (thesis section 4.3.2), two mounts share it:
186.5 kg each, 183 N at 0.1 g. Left out: the part of the mass carried by the rear mount's small axial stiffness, and
rotation of the engine about its mounts.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit
from thrustd.signals import STANDARD_GRAVITY_M_S2


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    return v + c[0] * u[0]


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    return np.array([p["mass_kg"] * STANDARD_GRAVITY_M_S2])


EFFECT = Effect(
    name="axial_inertia",
    title="inertia of the engine along its axis",
    site="force",
    channels=("accel_x_g",),
    parameters=(
        Parameter(
            "mass_kg",
            "kg",
            0.0,
            -1000.0,
            1000.0,
            (186.5,),
            "engine mass carried by this mount",
            expected="186.5 kg, half of an engine of 373 kg; less where the model holds part of it",
        ),
    ),
    step=step,
    prepare=prepare,
    n_state=0,
    equation="F = F_mount + m g0 f_x",
    source="Newton; mass from thesis section 4.3.2",
    separating_test="hold thrust constant and pitch up and down (+-10 deg), or a level acceleration at fixed N1",
)
