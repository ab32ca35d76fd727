"""Mullins softening for good: rubber is as soft as the largest deformation it has seen has left it, also on a new way.

    w = f(x) * (1 - softening * (1 - exp(-(x_max / m_mm)^exponent))),    x_max = largest x so far

A variant of `mullins_softening`, whose laws come back to the virgin curve at every new maximum: there what was broken
is missed below the maximum only. Here it is missed everywhere (continuum damage: Simo, Comput. Methods Appl. Mech. Eng.
60 (1987) 153), by the deformation (exponent 1) or its energy (2). A mount that has once been loaded is softer by one
share for ever after, and only how it came there tells this from another scale. Left out: recovery.
"""

import math
from dataclasses import replace

from thrustd.model.effects.mullins_softening_spring import EFFECT as SPRING
from thrustd.model.stage import Floats, jit

LATE = next(p for p in SPRING.parameters if p.name == "exponent")
BY = "1: it breaks by the largest deformation, 2: by the energy there"


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    x[0] = max(x[0], u[0])
    return v * (1.0 - c[0] * (1.0 - math.exp(-((max(x[0], 0.0) / c[1]) ** c[3]))))


EFFECT = replace(
    SPRING,
    name="mullins_softening_damage",
    title="softening of the spring for good by the largest deformation so far (Mullins)",
    parameters=(*(p for p in SPRING.parameters if p is not LATE), replace(LATE, starts=(1.5,), spread=0.5, meaning=BY)),
    step=step,
    equation="w = f(x) (1 - s (1 - exp(-(x_max / m)^n)))",
    source="Simo, Comput. Methods Appl. Mech. Eng. 60 (1987) 153",
)
