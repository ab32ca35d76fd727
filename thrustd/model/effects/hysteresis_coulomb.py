"""Dry friction that follows the direction of motion (Coulomb, regularised): none at rest, full when it slides.

    force = core force + friction_n * low-passed tanh(rate / slip_mm_s) + damping_n_s_mm * rate,
    rate = dx/dt low-passed, both with filter_s

A variant of `hysteresis` for joints and seals that let go when the motion stops, where the laws with a memory of
deformation hold their force through a standstill. Positive friction_n resists motion. slip_mm_s is the rate at which
three quarters of the friction is there; far above all rates of the data this would be viscous damping, so it is
bounded. The first filter keeps the steps of the LVDT out, the second lets friction go as gradually. Left out: stick (no
rate, no force), Stribeck's fall with rate.
"""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from thrustd.model.effect import Effect, Parameter, begin_at_channel
from thrustd.model.effects.hysteresis import FRICTION_N
from thrustd.model.effects.viscous_damping import DAMPING
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    x[1] = c[2] * x[1] + c[3] * (u[0] - x[0])
    x[0] = u[0]
    x[2] = c[2] * x[2] + (1.0 - c[2]) * math.tanh(x[1] / c[1])
    return v + c[0] * x[2] + c[4] * x[1]


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    decay = np.exp(-dt_s / p["filter_s"])
    return np.array([p["friction_n"], p["slip_mm_s"], decay, (1.0 - decay) / dt_s, p["damping_n_s_mm"]])


EFFECT = Effect(
    name="hysteresis_coulomb",
    title="dry friction in the direction of motion (Coulomb)",
    site="force",
    channels=("deformation_mm",),
    parameters=(
        FRICTION_N,
        replace(DAMPING, beside=True),
        Parameter("slip_mm_s", "mm/s", neutral=0.002, low=1e-9, high=1e9, starts=(0.0006, 0.004),
                  meaning="rate of deformation at which it slides", amplitude=False, e_folds=1.5),
        Parameter("filter_s", "s", neutral=0.3, low=1e-4, high=10.0, starts=(0.3, 0.02),
                  meaning="low-pass of the rate, and again of the friction", amplitude=False),
    ),
    step=step,
    prepare=prepare,
    n_state=3,
    equation="F = F_core + F_f tanh(dx/dt / v_s) + c dx/dt, low-passed",
    source="Threlfall, Mechanism and Machine Theory 13 (1978) 475; Andersson et al., Tribology Int. 40 (2007) 580",
    separating_test="triangles with a hold of a minute at each end: this friction goes in the hold, the others stay",
    initial=begin_at_channel,
    variant_of="hysteresis",
)  # fmt: skip
