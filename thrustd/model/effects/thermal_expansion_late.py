"""Thermal expansion that comes after its sensor: rubber and bracket warm minutes later than the air that is measured.

    true deformation = reading - expansion_mm_k * (lag(T) - reference_degc),    lag: first-order, lag_s

A variant of `thermal_expansion`. The lag is the time constant of a body in an air stream, mass times heat capacity over
surface times heat transfer: one to twenty minutes for an isolator of a kilogram (Incropera, Fundamentals of Heat and
Mass Transfer, ch. 5, lumped capacitance). Begins as warm as its sensor. Left out: gradients inside the rubber.
"""

import math
from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter, begin_at_channel
from thrustd.model.effects.thermal_expansion import EFFECT as AT_ONCE
from thrustd.model.stage import Floats, jit

LAG_S = Parameter(
    "lag_s", "s", neutral=300.0, low=1.0, high=20000.0, starts=(100.0, 600.0), amplitude=False,
    meaning="time constant by which it warms after its sensor", expected="60 to 1200 s",
)  # fmt: skip


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    x[0] += c[2] * (u[0] - x[0])
    return v - c[0] * (x[0] - c[1])


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    return np.array([p["expansion_mm_k"], p["reference_degc"], -math.expm1(-dt_s / p["lag_s"])])


EFFECT = Effect(
    name="thermal_expansion_late",
    title="thermal expansion that lags its thermometer",
    site="deformation",
    channels=AT_ONCE.channels,
    parameters=(*AT_ONCE.parameters, LAG_S),
    step=step,
    prepare=prepare,
    n_state=1,
    equation="x = x_read - a (lag(T) - T_ref)",
    source="Incropera, Fundamentals of Heat and Mass Transfer, ch. 5",
    separating_test="a step of temperature at constant force: read the time until the shift has come",
    initial=begin_at_channel,
    variant_of="thermal_expansion",
)
