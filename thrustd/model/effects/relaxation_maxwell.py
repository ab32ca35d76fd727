"""Relaxation beside the spring: Maxwell branches that are stretched by the deformation itself, whatever the curve does.

    force of the rubber = core force + sum_i k_i (x - lag_i(x))

lag_i: first-order, of a deformation that is a ramp between samples; tau_i from fastest_s to slowest_s by equal ratios.

The generalised Maxwell body with a nonlinear spring, where that spring does not relax: a rubber whose hardening is its
network's and settled, and whose fillers or uncured chains flow. In `relaxation` the whole force of the spring relaxes,
hardening and all; real rubbers lie between the two. A variant of `relaxation`, and what `identify` finds by itself
beside it. Positive k_i: rubber dissipates. Starts relaxed.
What multiplies the force of the rubber (temperature, ageing, Mullins) multiplies these, too. Left out: branches that
stiffen themselves.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.core.columns import Flags
from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit

N_BRANCHES = 10
STIFFNESSES = tuple(f"stiffness_{i:02d}_n_mm" for i in range(1, N_BRANCHES + 1))


@jit
def advance(x: Floats, c: Floats, d: float) -> None:
    """x (1 + n,): last deformation, lags; c: decay (n,) and share of a step (n,), in rows of n."""
    n = c.size // 3
    last, x[0] = x[0], d
    for i in range(n):
        x[1 + i] = c[i] * x[1 + i] + (1.0 - c[i]) * last + c[n + i] * (d - last)


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    n = c.size // 3
    advance(x, c, u[0])
    total = 0.0
    for i in range(n):
        total += c[2 * n + i] * (u[0] - x[1 + i])
    return v + total


@jit
def elements(x: Floats, c: Floats, u: Floats, wanted: Flags, out: Floats) -> None:
    """What each branch would add with a stiffness of 1, at the samples that are wanted."""
    n, at = c.size // 3, 0
    for k in range(u.shape[0]):
        advance(x, c, u[k, 0])
        if wanted[k]:
            for i in range(n):
                out[at, i] = u[k, 0] - x[1 + i]
            at += 1


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    """Decay, share of a step, stiffness; branches without any are left out."""
    stiffness = np.array([p[name] for name in STIFFNESSES])
    there = stiffness != 0.0
    tau = ladder(p)[there]
    decay = np.exp(-dt_s / tau)
    return np.concatenate((decay, 1.0 - (1.0 - decay) * tau / dt_s, stiffness[there]))


def ladder(p: Mapping[str, float]) -> Floats:
    """Time constants (n,), s."""
    return np.geomspace(p["fastest_s"], p["slowest_s"], N_BRANCHES)


def initial(x: Floats, c: Floats, u: Floats, v: float) -> None:
    for i in range(1 + c.size // 3):
        x[i] = u[0]


PARAMETERS = (
    Parameter("fastest_s", "s", neutral=0.1, low=1e-6, high=1e9, starts=(0.1,),
              meaning="first time constant of the ladder", amplitude=False, estimate=False),
    Parameter("slowest_s", "s", neutral=10_000.0, low=1e-6, high=1e9, starts=(10_000.0,),
              meaning="last time constant of the ladder", amplitude=False, estimate=False),
    *(
        Parameter(name, "N/mm", neutral=0.0, low=0.0, high=1e9, starts=(100.0,),
                  meaning="stiffness of the branch", expected="a hundredth of the mount's, each")
        for name in STIFFNESSES
    ),
)  # fmt: skip

EFFECT = Effect(
    name="relaxation_maxwell",
    title="relaxation beside the spring (Maxwell branches)",
    site="linear",
    channels=("deformation_mm",),
    parameters=PARAMETERS,
    step=step,
    prepare=prepare,
    n_state=1 + N_BRANCHES,
    equation="F = F_core + sum k_i (x - lag_i(x))",
    source="Tschoegl, The Phenomenological Theory of Linear Viscoelastic Behavior, 1989, ch. 3",
    separating_test="equal small steps at several loads, each held: the same force goes in every hold, however stiff",
    initial=initial,
    variant_of="relaxation",
    elements=elements,
)  # fmt: skip
