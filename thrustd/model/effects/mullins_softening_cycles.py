"""Mullins softening for good that takes some cycles: the first time is the stiffest, and the next ones are softer.

    w = f(x) (1 - softening z),    dz = (d - z) |dx| / (way |x|_max),    d = 1 - exp(-(|x|_max / m_mm)^exponent)

A variant of `mullins_softening`. d is the damage of `mullins_softening_damage`, to either side alike (a bearing in
shear); but rubber reaches it only after a few cycles of that size (Mullins; Diani, Fayolle, Gilormini), along the way
that it moves: damage by the length of the path is Miehe's, and Grant, Fenves and Whittaker's for high-damping bearings,
who call it scragging where it lasts. way counts in the largest deformation, a full cycle to both sides being four;
motion within deadband_mm, the noise of the reading, is none. Begins as if loaded from rest, broken to the full by
known_max_mm. Left out: recovery, and what of the damage is missed below the maximum only.
"""

import math
from dataclasses import replace

from thrustd.model.effect import Parameter
from thrustd.model.effects.hysteresis import DEADBAND_MM
from thrustd.model.effects.mullins_softening_damage import EFFECT as AT_ONCE
from thrustd.model.stage import Floats, jit


@jit
def broken(size: float, c: Floats) -> float:
    return 1.0 - math.exp(-((size / c[1]) ** c[3]))


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    """x: largest deformation, what it breaks in the end, what is broken, where the reading was but for its noise."""
    if abs(u[0]) > x[0]:
        x[0] = abs(u[0])
        x[1] = broken(x[0], c)
    moved = max(u[0] - c[5] - x[3], 0.0) + min(u[0] + c[5] - x[3], 0.0)
    if moved != 0.0:
        x[3] += moved
        part = abs(moved) / (c[4] * x[0])
        x[2] += part / (1.0 + part) * (x[1] - x[2])
    return v * (1.0 - c[0] * x[2])


def initial(x: Floats, c: Floats, u: Floats, v: float) -> None:
    x[0] = c[2]
    x[1] = broken(c[2], c)
    x[2] = x[1]
    x[3] = 0.0


def _card(p: Parameter) -> Parameter:
    return replace(p, low=1e-9, high=1e9) if p.name == "m_mm" else p


EFFECT = replace(
    AT_ONCE,
    name="mullins_softening_cycles",
    title="softening of the spring for good, within some cycles of the largest deformation so far (Mullins)",
    parameters=(
        *map(_card, AT_ONCE.parameters),
        Parameter("way", "-", neutral=4.0, low=0.01, high=1e3, starts=(4.0,), amplitude=False,
                  meaning="way on which it breaks, in the largest deformation so far: 4 are one cycle to both sides"),
        replace(DEADBAND_MM, estimate=False),
    ),
    step=step,
    n_state=4,
    equation="w = f(x) (1 - s z),  dz = (1 - exp(-(|x|_max / m)^n) - z) |dx| / (l |x|_max)",
    source="Grant, Fenves & Whittaker, J. Earthquake Eng. 8 (2004) 161; Miehe, Eur. J. Mech. A 14 (1995) 697",
    separating_test="five cycles of one deformation, five of twice that: each of the first is the stiffest",
    initial=initial,
)  # fmt: skip
