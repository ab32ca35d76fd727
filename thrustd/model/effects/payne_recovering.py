"""Payne's softening that takes time: the network breaks within seconds, and heals within minutes.

    force = core force * (1 - softening * p),    dp/dt = (p_V - p) / (breakdown_s where p_V > p, else recovery_s)

p_V: what `payne` has at once, of which this is a variant. Thixotropy: after the shaking stops, stiffness comes back in
its own time. Begins as broken as its vibration at rest would leave it. Left out: a spectrum of recovery times, the
frequency of the vibration.
"""

import math
from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter
from thrustd.model.effects.payne import EFFECT as AT_ONCE
from thrustd.model.stage import Floats, jit


@jit
def broken(x: Floats, c: Floats, u: Floats) -> float:
    ratio = (abs(u[0]) / c[1]) ** c[2]
    return ratio / (1.0 + ratio)


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    settled = broken(x, c, u)
    x[0] += (c[3] if settled > x[0] else c[4]) * (settled - x[0])
    return v * (1.0 - c[0] * x[0])


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    shares = [-math.expm1(-dt_s / p[name]) for name in ("breakdown_s", "recovery_s")]
    return np.array([p["softening"], p["vibration_c_mm_s"], 2.0 * p["exponent_m"], *shares])


def begin_settled(x: Floats, c: Floats, u: Floats, v: float) -> None:
    """As broken as this vibration leaves it."""
    x[0] = broken(x, c, u)


EFFECT = Effect(
    name="payne_recovering",
    title="softening by vibration that heals in its own time (Payne)",
    site="gain",
    channels=AT_ONCE.channels,
    parameters=(
        *AT_ONCE.parameters,
        Parameter("breakdown_s", "s", neutral=3.0, low=1e-3, high=1e4, starts=(3.0,),
                  meaning="time in which shaking breaks the network", amplitude=False),
        Parameter("recovery_s", "s", neutral=100.0, low=1e-3, high=1e5, starts=(30.0, 300.0),
                  meaning="time in which it heals", amplitude=False),
    ),
    step=step,
    prepare=prepare,
    n_state=1,
    equation="F = F_core (1 - s p),  dp/dt = (p_V - p) / T,  T: T_b where p rises, T_r where it falls",
    source=AT_ONCE.source,
    separating_test="vibrate at 50 mm/s for a minute at a constant 5 kN, stop, and read the force for ten minutes",
    initial=begin_settled,
    variant_of="payne",
)  # fmt: skip
