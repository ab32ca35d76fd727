"""Mullins softening of the spring alone: what relaxes follows the softened rubber, not the force.

    w = f(x) * (1 - softening * (1 - exp(-((x_max - x) / m_mm)^exponent))),    x_max = largest x so far

A variant of `mullins_softening`, which softens the whole force: here the branches of the linear block see the
softened spring, as in quasi-linear viscoelasticity with a damaged elastic response (Fung, Biomechanics, 1993, 7.6;
Simo, Comput. Methods Appl. Mech. Eng. 60 (1987) 153). On the way to a new maximum the spring is virgin; m_mm below it
two thirds of the softening are there: at once for an exponent of one half (Zuniga & Beatty), late for two. known_max_mm
tells what the mount had seen before. Left out: recovery.
"""

import math

from thrustd.model.effect import Effect, Parameter
from thrustd.model.effects.mullins_softening import EFFECT as WHOLE
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    x[0] = max(x[0], u[0])
    return v * (1.0 - c[0] * (1.0 - math.exp(-(((x[0] - u[0]) / c[1]) ** c[3]))))


def initial(x: Floats, c: Floats, u: Floats, v: float) -> None:
    x[0] = max(c[2], u[0])


EFFECT = Effect(
    name="mullins_softening_spring",
    title="softening of the spring below the largest deformation so far (Mullins)",
    site="spring",
    channels=WHOLE.channels,
    parameters=(
        *(p for p in WHOLE.parameters if p.name != "beta"),
        Parameter(
            "exponent",
            "-",
            neutral=1.0,
            low=0.3,
            high=3.0,
            starts=(1.0,),
            spread=0.3,
            amplitude=False,
            meaning="how the damage comes back below the maximum: below 1 at once, above 1 late",
        ),
    ),
    step=step,
    prepare=None,
    n_state=1,
    equation="w = f(x) (1 - s (1 - exp(-((x_max - x) / m)^n)))",
    source="Simo, Comput. Methods Appl. Mech. Eng. 60 (1987) 153; Mullins, Rubber Chem. Technol. 42 (1969) 339",
    separating_test=WHOLE.separating_test,
    initial=initial,
    variant_of="mullins_softening",
)
