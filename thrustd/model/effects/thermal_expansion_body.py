"""Thermal expansion of a body that heat has to be conducted into: one time constant gives all that follows it.

    true deformation = reading - expansion_mm_k * (T_m - reference_degc)
    surface = lag(T, surface_s),    T_m = sum_n w_n lag(surface, lag_s / (2 n + 1)^2),    w_n = 8 / (pi (2 n + 1))^2

A variant of `thermal_expansion`: T_m is the mean temperature of a slab with faces as warm as its surface (Carslaw &
Jaeger, Conduction of Heat in Solids, 2nd ed., ch. 3), which warms after its sensor. Two numbers where the two nodes of
`thermal_expansion_late` take three: between 200 s and 600 s in series, or a single lag, and this they differ by at most
1.3 % of what comes late; where a record does not tell the two, this one is surer of what a longer one will show.
Modes from the fifth on are as fast as the surface. It begins as that one does. Left out: heating from within.
"""

import math
from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect
from thrustd.model.effects.thermal_expansion import EFFECT as AT_ONCE
from thrustd.model.effects.thermal_expansion_late import BEGIN_SHARE, LAG_S, SURFACE_S, begin_between
from thrustd.model.stage import Floats, jit

MODES = 4
ORDERS = [2 * n + 1 for n in range(MODES)]
WEIGHTS = [8.0 / (math.pi * order) ** 2 for order in ORDERS]
BODY = LAG_S, SURFACE_S, BEGIN_SHARE


@jit
def warmed(x: Floats, c: Floats, u: Floats) -> float:
    """Temperature (degC) that counts; c: share that the surface goes, then share and weight of every mode.

    x: surface, modes.
    """
    x[0] += c[0] * (u[0] - x[0])
    found = x[0]
    for n in range(1, x.size):
        x[n] += c[2 * n - 1] * (x[0] - x[n])
        found += c[2 * n] * (x[n] - x[0])
    return found


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    return v - c[0] * (warmed(x, c[2:], u) - c[1])


def conducted(p: Mapping[str, float], dt_s: float) -> list[float]:
    """What `warmed` reads, and last where it begins."""
    modes = [(-math.expm1(-dt_s * order**2 / p["lag_s"]), w) for order, w in zip(ORDERS, WEIGHTS, strict=True)]
    return [-math.expm1(-dt_s / p["surface_s"]), *(number for mode in modes for number in mode), p["begin_share"]]


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    return np.array([p["expansion_mm_k"], p["reference_degc"], *conducted(p, dt_s)])


EFFECT = Effect(
    name="thermal_expansion_body",
    title="thermal expansion of a body that warms from its surface",
    site="deformation",
    channels=AT_ONCE.channels,
    parameters=(*AT_ONCE.parameters, *BODY),
    step=step,
    prepare=prepare,
    n_state=1 + MODES,
    equation="x = x_read - a (T_m - T_ref),  T_m the mean of a slab whose faces warm after T",
    source="Carslaw & Jaeger, Conduction of Heat in Solids, 2nd ed., ch. 3",
    separating_test="a step of temperature at constant force: read how the shift comes, fast at first, then slowly",
    initial=begin_between,
    variant_of="thermal_expansion",
)
