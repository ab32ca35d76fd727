"""Hysteresis by Preisach's model: a field of relays, here summed along their thresholds into play operators.

    force = core force + friction_n * mean_i [S(x) - S(p_i)] / height
    p_i <- clip(p_i, x - r_i, x + r_i),    r_i = spread_mm * i / 8
    S(x) = centre + half_range * tanh((x - centre) / half_range)

A Preisach operator is an integral of functions of play operators p_r (Brokate & Sprekels, theorem 2.4.6); the curve S
gives the relays a density that fades away from the centre, so loops are widest at medium deformation and pinch
towards both ends: what Prandtl-Ishlinskii cannot do. height = mean r_i makes friction_n the half width at the centre.
Rate-independent, wiping-out property holds. A variant of `hysteresis`. Left out: any other density of the relays.
"""

import math
from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit

N_PLAYS = 8


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    here = c[2] * math.tanh((u[0] - c[3]) / c[2])
    total = 0.0
    for i in range(N_PLAYS):
        half_width = c[1] * (i + 1)
        at = min(max(x[i], u[0] - half_width), u[0] + half_width)
        if at != x[i]:  # most stand still
            x[i] = at
            x[N_PLAYS + i] = c[2] * math.tanh((at - c[3]) / c[2])
        total += here - x[N_PLAYS + i]
    return v + c[0] * total


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    smallest_mm = p["spread_mm"] / N_PLAYS
    height_mm = smallest_mm * N_PLAYS * (N_PLAYS + 1) / 2
    return np.array([p["friction_n"] / height_mm, smallest_mm, p["half_range_mm"], p["centre_mm"]])


def initial(x: Floats, c: Floats, u: Floats, v: float) -> None:
    x[:N_PLAYS] = u[0]
    x[N_PLAYS:] = c[2] * math.tanh((u[0] - c[3]) / c[2])


EFFECT = Effect(
    name="hysteresis_preisach",
    title="hysteresis by internal friction (Preisach)",
    site="force",
    channels=("deformation_mm",),
    parameters=(
        Parameter("friction_n", "N", neutral=0.0, low=0.0, high=1e6, starts=(50.0,),
                  meaning="friction force, half the width of the loop at its centre",
                  expected="positive; 30 to 150 N: 1 to 2 % of full load"),
        Parameter("spread_mm", "mm", neutral=0.1, low=0.001, high=50.0, starts=(0.03, 0.1, 0.3, 0.8),
                  meaning="half width of the widest relay", amplitude=False),
        Parameter("centre_mm", "mm", neutral=0.5, low=-100.0, high=100.0, starts=(0.5,),
                  meaning="deformation where the loops are widest", amplitude=False, estimate=False),
        Parameter("half_range_mm", "mm", neutral=0.5, low=0.05, high=100.0, starts=(0.5,),
                  meaning="distance over which they fade", amplitude=False, estimate=False),
    ),
    step=step,
    prepare=prepare,
    n_state=2 * N_PLAYS,
    equation="F = F_core + F_f mean [S(x) - S(p_i)] / h",
    source=(
        "Brokate & Sprekels, Hysteresis and Phase Transitions, 1996, ch. 2.4; Mayergoyz, "
        "Mathematical Models of Hysteresis, 1991"
    ),
    separating_test="slow triangles around several mean loads: the loop pinches towards the ends of the range",
    initial=initial,
    variant_of="hysteresis",
)  # fmt: skip
