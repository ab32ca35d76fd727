"""Stiffness that follows the temperature late: rubber warms minutes after the air that is measured.

    force = core force * (1 + y + bend y^2 / 2),    y = stiffness_1_k * (T_m - reference_degc)

A variant of `thermal_stiffness` with T_m, the two nodes of heat, of `thermal_expansion_late`. It begins as that one
does. Left out: heating from within.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect
from thrustd.model.effects.thermal_expansion_late import NODES, begin_between, nodes, warmed
from thrustd.model.effects.thermal_stiffness import EFFECT as AT_ONCE
from thrustd.model.stage import Floats, jit


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    y = c[0] * (warmed(x, c[3:], u) - c[1])
    return v * (1.0 + y + 0.5 * c[2] * y * y)


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    return np.array([p["stiffness_1_k"], p["reference_degc"], p["bend"], *nodes(p, dt_s)])


EFFECT = Effect(
    name="thermal_stiffness_late",
    title="stiffness that follows the temperature late",
    site="gain",
    channels=AT_ONCE.channels,
    parameters=(*AT_ONCE.parameters, *NODES),
    step=step,
    prepare=prepare,
    n_state=2,
    equation="F = F_core (1 + y + b y^2 / 2),  y = k (T_m - T_ref),  T_m of two nodes that warm after T",
    source="Incropera, Fundamentals of Heat and Mass Transfer, ch. 5",
    separating_test="a step of temperature at constant force of 5 kN: read the time until the force has settled",
    initial=begin_between,
    variant_of="thermal_stiffness",
)
