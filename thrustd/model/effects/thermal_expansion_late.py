"""Thermal expansion that comes after its sensor: surface and core warm one after the other, minutes after the air.

    true deformation = reading - expansion_mm_k * (T_m - reference_degc),   T_m = core + surface_share (surface - core)
    surface = lag(T, surface_s),    core = lag(surface, lag_s),    first-order

A variant of `thermal_expansion`: two nodes of heat, the least that has a skin and an inside. A time constant is mass
times heat capacity over what conducts: one to twenty minutes for an isolator of a kilogram (Incropera, Fundamentals of
Heat and Mass Transfer, ch. 5). With no share and a fast surface it is a single lag; a share below nothing is later than
both nodes. A record need not begin when its sensor does: begin_share says where between the sensor (0) and the
reference (1) surface and core begin, wherever a log begins. Left out: heating from within.
"""

import math
from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter
from thrustd.model.effects.thermal_expansion import EFFECT as AT_ONCE
from thrustd.model.stage import Floats, jit

LAG_S = Parameter(
    "lag_s", "s", neutral=300.0, low=1.0, high=20000.0, starts=(100.0, 600.0), amplitude=False,
    meaning="time constant by which its core warms after its surface", expected="60 to 1200 s",
)  # fmt: skip
SURFACE_S = Parameter(
    "surface_s", "s", neutral=1.0, low=0.01, high=20000.0, starts=(1.0, 100.0), amplitude=False,
    meaning="time constant by which its surface warms after its sensor", expected="1 to 300 s",
)  # fmt: skip
SHARE = Parameter(
    "surface_share", "-", neutral=0.0, low=-1.0, high=1.0, starts=(0.0,), amplitude=False, spread=0.3,
    meaning="share of it that follows the surface; below zero: later than both",
)  # fmt: skip
BEGIN_SHARE = Parameter(
    "begin_share", "-", neutral=0.0, low=0.0, high=2.0, starts=(0.0, 0.5), amplitude=False,
    meaning="where it begins: 0 as warm as its sensor, 1 at the reference",
)  # fmt: skip
NODES = LAG_S, SURFACE_S, SHARE, BEGIN_SHARE


@jit
def warmed(x: Floats, c: Floats, u: Floats) -> float:
    """Temperature (degC) that counts; c: shares that core and surface go towards what warms them, share of the surface.

    x: core, surface.
    """
    x[1] += c[1] * (u[0] - x[1])
    x[0] += c[0] * (x[1] - x[0])
    return x[0] + c[2] * (x[1] - x[0])


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    return v - c[0] * (warmed(x, c[2:], u) - c[1])


def nodes(p: Mapping[str, float], dt_s: float) -> list[float]:
    """What `warmed` reads, and last where it begins."""
    shares = [-math.expm1(-dt_s / p[name]) for name in ("lag_s", "surface_s")]
    return [*shares, p["surface_share"], p["begin_share"]]


def begin_between(x: Floats, c: Floats, u: Floats, v: float) -> None:
    """All of it between its sensor and the reference; c[1]: reference, c[-1]: share of the way."""
    for n in range(x.size):
        x[n] = u[0] + c[c.size - 1] * (c[1] - u[0])


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    return np.array([p["expansion_mm_k"], p["reference_degc"], *nodes(p, dt_s)])


EFFECT = Effect(
    name="thermal_expansion_late",
    title="thermal expansion that lags its thermometer",
    site="deformation",
    channels=AT_ONCE.channels,
    parameters=(*AT_ONCE.parameters, *NODES),
    step=step,
    prepare=prepare,
    n_state=2,
    equation="x = x_read - a (T_m - T_ref),  T_m of two nodes that warm after T",
    source="Incropera, Fundamentals of Heat and Mass Transfer, ch. 5",
    separating_test="a step of temperature at constant force: read the time until the shift has come",
    initial=begin_between,
    variant_of="thermal_expansion",
)
