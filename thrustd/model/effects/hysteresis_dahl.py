"""Dry friction that turns over with a power of what is left to slip (Dahl).

    force = core force + friction_n * z,    dz/dx = |1 - sgn(dx) z|^exponent / yield_mm

A variant of `hysteresis` for joints and fillers that yield otherwise than Bouc-Wen's exponential: exponent 1 is Dahl's
usual law, below 1 a brittle contact that lets go at once, above 1 a ductile one that keeps giving way for long. With
w = 1 - sgn(dx) z the step over dx is exact: w^(1 - exponent) falls by (1 - exponent) |dx| / yield_mm. Positive
friction_n resists motion. Starts at z = 0. Left out: many scales at once (see the other variants), creep of the
contact.
"""

import math
from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter, begin_at_channel
from thrustd.model.effects.hysteresis import DEADBAND_MM, FRICTION_N
from thrustd.model.stage import Floats, jit

USUAL = 1e-3  # so near to 1 the power law is an exponential


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    away = u[0] - x[0]
    dx = away - min(max(away, -c[3]), c[3])
    x[0] += dx
    if dx != 0.0:
        sign = 1.0 if dx > 0.0 else -1.0
        left = max(1.0 - sign * x[1], 1e-12)
        if c[2] == 0.0:
            left *= math.exp(-abs(dx) / c[1])
        else:
            power = left ** c[2] - c[2] * abs(dx) / c[1]
            left = power ** (1.0 / c[2]) if power > 0.0 else 0.0
        x[1] = sign * (1.0 - left)
    return v + c[0] * x[1]


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    power = 1.0 - p["exponent"]
    return np.array([p["friction_n"], p["yield_mm"], power if abs(power) > USUAL else 0.0, p["deadband_mm"]])


EFFECT = Effect(
    name="hysteresis_dahl",
    title="dry friction that yields by a power law (Dahl)",
    site="force",
    channels=("deformation_mm",),
    parameters=(
        FRICTION_N,
        Parameter("yield_mm", "mm", neutral=0.03, low=1e-9, high=1e9, starts=(0.01, 0.03, 0.1),
                  meaning="deformation over which it would turn over at its rate in the middle of the loop",
                  amplitude=False),
        Parameter("exponent", "-", neutral=1.0, low=0.2, high=4.0, starts=(1.2,),
                  meaning="how it lets go: below 1 at once, above 1 for long", amplitude=False),
        DEADBAND_MM,
    ),
    step=step,
    prepare=prepare,
    n_state=2,
    equation="F = F_core + F_f z,  dz/dx = |1 - sgn(dx) z|^i / x_y",
    source="Dahl, A solid friction model, Aerospace Corp. TOR-0158(3107-18)-1, 1968; AIAA J. 14 (1976) 1675",
    separating_test="slow triangles (0.001 and 0.01 Hz) of two amplitudes: a loop of the same width at both speeds",
    initial=begin_at_channel,
    variant_of="hysteresis",
)  # fmt: skip
