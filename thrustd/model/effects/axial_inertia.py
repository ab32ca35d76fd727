"""Axial inertia: the mounts carry thrust minus engine mass times longitudinal specific force.

    thrust share = mount force + mass_kg * g0 * accel_x_g

accel_x_g is the specific force along the body axis, forward positive: what an accelerometer feels, so the component
of gravity in a climb is in it. For PH-LAB an installed engine has 373 kg (thesis section 4.3.2); its two mounts move
together, so each carries as much of it as of the thrust, in the ratio of their spring rates (thesis table 4.1: 5079 and
5954 N/mm): 171.7 kg above and 201.3 kg below, 168 and 197 N at 0.1 g. Left out: what the rear mount's small axial
stiffness carries, and rotation of the engine about its mounts.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit


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
        Parameter("mass_kg", "kg", neutral=0.0, low=-1000.0, high=1000.0, starts=(186.5,),
                  meaning="engine mass carried by this mount; negative: accel_x_g turned, or the model holds too much",
                  expected="172 kg on an upper, 201 kg on a lower mount, of an engine's 373; "
                  "less where the model holds part"),
    ),
    step=step,
    prepare=prepare,
    n_state=0,
    equation="F = F_mount + m g0 f_x",
    source="Newton; mass from thesis section 4.3.2",
    separating_test="hold thrust constant and pitch up and down (+-10 deg), or a level acceleration at fixed N1",
)  # fmt: skip
