"""Stiffness that follows the temperature late: rubber warms minutes after the air that is measured.

    force = core force * (1 + stiffness_1_k * (lag(T) - reference_degc)),    lag: first-order, lag_s

A variant of `thermal_stiffness` with the lag of `thermal_expansion_late`. Begins as warm as its sensor. Left out:
heating from within, gradients inside the rubber.
"""

import math
from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, begin_at_channel
from thrustd.model.effects.thermal_expansion_late import LAG_S
from thrustd.model.effects.thermal_stiffness import EFFECT as AT_ONCE
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    x[0] += c[2] * (u[0] - x[0])
    return v * (1.0 + c[0] * (x[0] - c[1]))


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    return np.array([p["stiffness_1_k"], p["reference_degc"], -math.expm1(-dt_s / p["lag_s"])])


EFFECT = Effect(
    name="thermal_stiffness_late",
    title="stiffness that follows the temperature late",
    site="gain",
    channels=AT_ONCE.channels,
    parameters=(*AT_ONCE.parameters, LAG_S),
    step=step,
    prepare=prepare,
    n_state=1,
    equation="F = F_core (1 + k (lag(T) - T_ref))",
    source="Incropera, Fundamentals of Heat and Mass Transfer, ch. 5",
    separating_test="a step of temperature at constant force of 5 kN: read the time until the force has settled",
    initial=begin_at_channel,
    variant_of="thermal_stiffness",
)
