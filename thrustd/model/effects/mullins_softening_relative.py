"""Mullins softening of the spring that reaches as far as the rubber has been: by the share of the largest deformation.

    w = f(x) * (1 - softening * (1 - exp(-((x_max - x) / (m_mm + beta x_max))^exponent))),    x_max = largest x so far

A variant of `mullins_softening`. `mullins_softening_spring` comes back over the same way, m_mm, below every maximum;
here the way grows with the maximum, as Ogden and Roxburgh's does in later use (beta; Diani, Fayolle, Gilormini, Eur.
Polym. J. 45 (2009) 601), and small maxima soften less than large ones. For beta alone it is a law of x / x_max.
Left out: recovery.
"""

import math
from dataclasses import replace

from thrustd.model.effects.mullins_softening import EFFECT as WHOLE
from thrustd.model.effects.mullins_softening_spring import EFFECT as SPRING
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    x[0] = max(x[0], u[0])
    return v * (1.0 - c[0] * (1.0 - math.exp(-(((x[0] - u[0]) / (c[1] + c[4] * max(x[0], 0.0))) ** c[3]))))


EFFECT = replace(
    SPRING,
    name="mullins_softening_relative",
    title="softening of the spring by the share of the largest deformation so far (Mullins)",
    parameters=(*SPRING.parameters, next(p for p in WHOLE.parameters if p.name == "beta")),
    step=step,
    equation="w = f(x) (1 - s (1 - exp(-((x_max - x) / (m + b x_max))^n)))",
    source="Diani, Fayolle, Gilormini, Eur. Polym. J. 45 (2009) 601; Mullins, Rubber Chem. Technol. 42 (1969) 339",
)
