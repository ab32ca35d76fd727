"""Stiffness that follows the temperature of a body that heat has to be conducted into.

    force = core force * (1 + y + bend y^2 / 2),    y = stiffness_1_k * (T_m - reference_degc)

A variant of `thermal_stiffness` with T_m, the mean of a slab, of `thermal_expansion_body`. It begins as that one
does. Left out: heating from within, a modulus that is not the same throughout.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect
from thrustd.model.effects.thermal_expansion_body import BODY, MODES, conducted, warmed
from thrustd.model.effects.thermal_expansion_late import begin_between
from thrustd.model.effects.thermal_stiffness import EFFECT as AT_ONCE
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    y = c[0] * (warmed(x, c[3:], u) - c[1])
    return v * (1.0 + y + 0.5 * c[2] * y * y)


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    return np.array([p["stiffness_1_k"], p["reference_degc"], p["bend"], *conducted(p, dt_s)])


EFFECT = Effect(
    name="thermal_stiffness_body",
    title="stiffness that follows the temperature of a body that warms from its surface",
    site="gain",
    channels=AT_ONCE.channels,
    parameters=(*AT_ONCE.parameters, *BODY),
    step=step,
    prepare=prepare,
    n_state=1 + MODES,
    equation="F = F_core (1 + y + b y^2 / 2),  y = k (T_m - T_ref),  T_m the mean of a slab whose faces warm after T",
    source="Carslaw & Jaeger, Conduction of Heat in Solids, 2nd ed., ch. 3",
    separating_test="a step of temperature at constant force of 5 kN: read how the force settles, fast, then slowly",
    initial=begin_between,
    variant_of="thermal_stiffness",
)
