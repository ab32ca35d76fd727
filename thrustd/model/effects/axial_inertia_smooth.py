"""Inertia of the engine by an accelerometer that is noisier than the load cell: behind a low-pass.

    thrust share = mount force + mass_kg * g0 * smooth(accel_x_g),    smooth: first-order low-pass, smooth_s

A variant of `axial_inertia`. 3 mg of noise on 200 kg are 6 N. The engine's own acceleration is slow beside it, so a
low-pass takes away more noise than signal; the best time constant is in the data and is estimated (Wiener's filter in
its simplest form). Left out: what it delays.
"""

import math
from collections.abc import Mapping

import numpy as np

from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.model.effect import Effect, Parameter, begin_at_channel
from thrustd.model.effects.axial_inertia import EFFECT as AT_ONCE
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    x[0] += c[1] * (u[0] - x[0])
    return v + c[0] * x[0]


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    return np.array([p["mass_kg"] * STANDARD_GRAVITY_M_S2, -math.expm1(-dt_s / p["smooth_s"])])


EFFECT = Effect(
    name="axial_inertia_smooth",
    title="inertia of the engine along its axis, the accelerometer smoothed",
    site="force",
    channels=AT_ONCE.channels,
    parameters=(
        *AT_ONCE.parameters,
        Parameter("smooth_s", "s", neutral=0.1, low=0.001, high=100.0, starts=(0.1,),
                  meaning="time constant of the low-pass", amplitude=False),
    ),
    step=step,
    prepare=prepare,
    n_state=1,
    equation="F = F_mount + m g0 smooth(f_x)",
    source="Newton; Wiener, Extrapolation, Interpolation and Smoothing of Stationary Time Series, 1949",
    separating_test=AT_ONCE.separating_test,
    initial=begin_at_channel,
    variant_of="axial_inertia",
)  # fmt: skip
