"""Mullins softening of the spring by how much of the largest deformation it holds, and by nothing else.

    w = f(x) * (1 - softening * (1 - (x / x_max)^exponent)),    x_max = largest x so far

A variant of `mullins_softening` with no length of its own: every maximum softens by the same share, all of it at no
deformation. Behind `mullins_softening_relative` for a large beta; one shape less than any other, so where a record does
not tell them this one is surer of larger maxima. For x below nothing as at none. Left out: recovery.
"""

from dataclasses import replace

from thrustd.model.effects.mullins_softening_spring import EFFECT as SPRING
from thrustd.model.stage import Floats, jit

LEAST_MM = 1e-9  # no maximum at all


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    x[0] = max(x[0], u[0])
    share = max(u[0], 0.0) / x[0] if x[0] > LEAST_MM else 1.0
    return v * (1.0 - c[0] * (1.0 - share ** c[2]))


def initial(x: Floats, c: Floats, u: Floats, v: float) -> None:
    x[0] = max(c[1], u[0])


EFFECT = replace(
    SPRING,
    name="mullins_softening_ratio",
    title="softening of the spring by the share of the largest deformation that is held (Mullins)",
    parameters=tuple(p for p in SPRING.parameters if p.name != "m_mm"),
    step=step,
    equation="w = f(x) (1 - s (1 - (x / x_max)^n))",
    source="Diani, Fayolle, Gilormini, Eur. Polym. J. 45 (2009) 601; Mullins, Rubber Chem. Technol. 42 (1969) 339",
    initial=initial,
)
