"""Mullins softening: rubber is softer below the largest deformation it has seen than on its first way there.

    force = core force * eta,    eta = 1 - softening * erf((W_max - W) / (m^2 + beta W_max))
    W = x^2, W_max = max of W so far

Ogden and Roxburgh's damage, with the strain energy written as the square of the deformation; softening = 1 / r, m_mm
sets how far below the largest deformation it takes full effect, and beta by how much further at large ones. On the
virgin path eta = 1. Memory is the largest deformation since the start; known_max_mm tells what the mount had seen
before. Does not recover within hours, which tells it from the Payne effect. Left out: permanent set, recovery over
days.
"""

import math
from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    energy = u[0] * u[0]
    x[0] = max(x[0], energy)
    return v * (1.0 - c[0] * math.erf((x[0] - energy) / (c[1] + c[3] * x[0])))


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    return np.array([p["softening"], p["m_mm"] ** 2, p["known_max_mm"] ** 2, p["beta"]])


def initial(x: Floats, c: Floats, u: Floats, v: float) -> None:
    x[0] = max(c[2], u[0] * u[0])


EFFECT = Effect(
    name="mullins_softening",
    title="softening below the largest deformation so far (Mullins)",
    site="gain",
    channels=("deformation_mm",),
    parameters=(
        Parameter("softening", "-", neutral=0.0, low=0.0, high=0.9, starts=(0.05,),
                  meaning="relative loss of stiffness far below the largest deformation (1/r)",
                  expected="0.02 to 0.2 for filled rubber, 0 when preconditioned"),
        Parameter("m_mm", "mm", neutral=0.3, low=0.02, high=5.0, starts=(0.3, 0.1, 1.0),
                  meaning="how far below the maximum it takes full effect", amplitude=False),
        Parameter("beta", "-", neutral=0.1, low=0.001, high=10.0, starts=(0.1,),
                  meaning="by how much slower far up, as a share of the largest energy", amplitude=False),
        Parameter("known_max_mm", "mm", neutral=0.0, low=0.0, high=10.0, starts=(0.0,),
                  meaning="largest deformation before the recording", amplitude=False, estimate=False),
    ),
    step=step,
    prepare=prepare,
    n_state=1,
    equation="F = F_core (1 - s erf((W_m - W) / (m^2 + b W_m))),  W = x^2",
    source="Ogden & Roxburgh, Proc. R. Soc. A 455 (1999) 2861; Mullins, Rubber Chem. Technol. 42 (1969) 339",
    separating_test=(
        "load a rested mount in rising steps, going back to zero after each: every step beyond the "
        "last follows the virgin curve"
    ),
    initial=initial,
)  # fmt: skip
