"""Axial inertia along an axis that is not the accelerometer's: some of the vertical specific force is in it.

    thrust share = mount force + g0 * (mass_kg * f_x + across_kg * (f_z - 1)),    f: accel_x_g, accel_z_g, late by lag_s

A variant of `axial_inertia`. Engines are canted by a degree or two to the body axis, and an accelerometer's bracket is
no better aligned: across_kg is the mass times the sine of that angle, positive where the engine's axis points up, or
the accelerometer's down. The engine follows the airframe late, on a soft mount, or the accelerometer's filter is not
the load's. In steady flight at 1 g nothing of the vertical is left. Left out: sideways.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.model.effect import Effect, Parameter
from thrustd.model.effects.axial_inertia import EFFECT as ALIGNED
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    x[0] = u[0] + c[2] * (x[0] - u[0])
    x[1] = u[1] + c[2] * (x[1] - u[1])
    return v + c[0] * x[0] + c[1] * (x[1] - 1.0)


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    weights = p["mass_kg"] * STANDARD_GRAVITY_M_S2, p["across_kg"] * STANDARD_GRAVITY_M_S2
    return np.array([*weights, np.exp(-dt_s / p["lag_s"])])


def initial(x: Floats, c: Floats, u: Floats, v: float) -> None:
    x[0] = u[0]
    x[1] = u[1]


EFFECT = Effect(
    name="axial_inertia_canted",
    title="inertia of the engine along a canted axis",
    site="force",
    channels=("accel_x_g", "accel_z_g"),
    parameters=(
        *ALIGNED.parameters,
        Parameter("across_kg", "kg", neutral=0.0, low=-300.0, high=300.0, starts=(5.0,),
                  meaning="mass times the sine of the angle between the two axes, in the plane of symmetry",
                  expected="within 10 kg: 3 degrees", beside=True),
        Parameter("lag_s", "s", neutral=0.1, low=1e-3, high=10.0, starts=(0.1,),
                  meaning="by which the engine follows", amplitude=False),
    ),
    step=step,
    prepare=prepare,
    n_state=2,
    equation="F = F_mount + g0 (m f_x + m_z (f_z - 1)),  f late",
    source="Newton; Titterton & Weston, Strapdown Inertial Navigation Technology, 2nd ed., ch. 8 (misalignment)",
    separating_test="pull-ups at constant thrust and pitch attitude: what follows f_z and not f_x",
    initial=initial,
    variant_of="axial_inertia",
)  # fmt: skip
