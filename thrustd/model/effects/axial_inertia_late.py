"""Axial inertia of an engine that follows the airframe late: its pylon gives way.

    thrust share = mount force + mass_kg * g0 * lag(accel_x_g),    lag: first-order, late_s

The accelerometer rides in the fuselage, the engine on a pylon that bends; what damps the pylon makes the engine follow
a change by and by. A variant of `axial_inertia`, which it is for a stiff pylon. Begins with both at one acceleration.
Left out: ringing of the pylon, faster than the samples of a flight recorder.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter
from thrustd.model.effects.axial_inertia import EFFECT as AT_ONCE
from thrustd.model.effects.axial_inertia import prepare as prepare_at_once
from thrustd.model.modulated import late_decay
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    x[0] = u[0] + c[1] * (x[0] - u[0])
    return v + c[0] * x[0]


def begin(x: Floats, c: Floats, u: Floats, v: float) -> None:
    x[0] = u[0]


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    return np.array([*prepare_at_once(p, dt_s), late_decay(p["late_s"], dt_s)])


EFFECT = Effect(
    name="axial_inertia_late",
    title="inertia of an engine that follows the airframe late",
    site="force",
    channels=AT_ONCE.channels,
    parameters=(
        *AT_ONCE.parameters,
        Parameter("late_s", "s", neutral=0.1, low=0.0, high=10.0, starts=(0.2,), amplitude=False,
                  meaning="time constant by which the engine follows the airframe", expected="below 0.5 s"),
    ),
    step=step,
    prepare=prepare,
    n_state=1,
    equation="F = F_mount + m g0 lag(f_x)",
    source="Newton; a damped spring between airframe and engine",
    separating_test="brake hard at idle: the force follows the deceleration, later by this time",
    initial=begin,
    variant_of="axial_inertia",
)  # fmt: skip
