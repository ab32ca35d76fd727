"""Hysteresis as a sum of stop operators (Prandtl-Ishlinskii): friction elements which slip one after the other.

    force = core force + friction_n * sum_i s_i / sum_i r_i
    s_i <- clip(s_i + dx, -r_i, r_i),    r_i = spread_mm * i / 8

Eight springs, each in series with a dry slider (Iwan's and Jenkins' elements): after a reversal the small ones slip
first, so the loop turns over gradually and small cycles make small loops (Masing's rule). A variant of `hysteresis`;
positive friction_n resists motion. Rate-independent. Starts as if it had been loaded from no deformation, where every
spring is relaxed: a log may begin under thrust. Left out: friction growing with load, unsymmetric loops.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.model.effect import Effect, Parameter
from thrustd.model.effects.hysteresis import FRICTION_N
from thrustd.model.stage import Floats, jit

N_STOPS = 8


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    dx = u[0] - x[0]
    x[0] = u[0]
    total = 0.0
    for i in range(1, x.shape[0]):
        limit = c[1] * i
        x[i] = min(max(x[i] + dx, -limit), limit)
        total += x[i]
    return v + c[0] * total


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    smallest_mm = p["spread_mm"] / N_STOPS
    return np.array([p["friction_n"] / (smallest_mm * N_STOPS * (N_STOPS + 1) / 2), smallest_mm])


def initial(x: Floats, c: Floats, u: Floats, v: float) -> None:
    x[0] = u[0]
    for i in range(1, x.shape[0]):
        x[i] = min(max(u[0], -c[1] * i), c[1] * i)


EFFECT = Effect(
    name="hysteresis_prandtl_ishlinskii",
    title="hysteresis by internal friction (Prandtl-Ishlinskii)",
    site="force",
    channels=("deformation_mm",),
    parameters=(
        FRICTION_N,
        Parameter("spread_mm", "mm", neutral=0.1, low=0.001, high=50.0, starts=(0.03, 0.1, 0.3, 0.8),
                  meaning="deformation at which the last element slips", amplitude=False),
    ),
    step=step,
    prepare=prepare,
    n_state=9,
    equation="F = F_core + F_f sum s_i / sum r_i,  s_i = clip(s_i + dx, -r_i, r_i)",
    source="Brokate & Sprekels, Hysteresis and Phase Transitions, 1996, ch. 2; Iwan, J. Appl. Mech. 33 (1966) 893",
    separating_test="slow triangles of several amplitudes: small cycles make small loops",
    initial=initial,
    variant_of="hysteresis",
)  # fmt: skip
