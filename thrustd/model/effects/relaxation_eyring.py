"""Relaxation that flows: Maxwell branches stretched by the deformation, whose dashpots give way under load (Eyring).

    force of the rubber = core force + sum_i k_i e_i,    de_i/dt = dx/dt - s / tau_i sinh(e_i / s)

e_i (mm): what is left of a branch's stretch; tau_i from fastest_s to slowest_s by equal ratios; s (flow_mm): stretch
from which on a branch flows faster than in proportion. Far below s it is `relaxation_maxwell`; far above, it gives way
like friction whose level grows with the logarithm of the rate. Chains that slip past a filler do so over a barrier
that load lowers (Eyring, J. Chem. Phys. 4 (1936) 283); a power law instead (Bergstrom & Boyce, J. Mech. Phys. Solids
46 (1998) 931) is hard to tell from it over the loads of one mount.

Between samples half of the stretch comes, then time passes, then the other half: each exact, together right to second
order of the step. Under a constant deformation tanh(e / 2 s) decays with tau. A variant of `relaxation`, and what
`identify` finds by itself. Positive k_i: rubber dissipates. Starts relaxed. Left out: an s of each branch's own.
"""

import math
from collections.abc import Mapping

import numpy as np

from thrustd.core.columns import Flags
from thrustd.model.effect import Effect, Parameter
from thrustd.model.effects.relaxation_maxwell import N_BRANCHES, PARAMETERS, STIFFNESSES, ladder
from thrustd.model.stage import Floats, jit

MOST = 100.0  # stretches s in half a step: of more nothing is left a step later


@jit
def advance(x: Floats, c: Floats, d: float) -> None:
    """x (1 + n,): last deformation, exp(e / s) of the branches; c: decay (n,), stiffness (n,), s."""
    n = (c.size - 1) // 2
    half = math.exp(min(max(0.5 * (d - x[0]) / c[2 * n], -MOST), MOST))
    x[0] = d
    for i in range(n):
        left, gone = 1.0 + c[i], 1.0 - c[i]
        e = x[1 + i] * half
        x[1 + i] = min(max((left * e + gone) / (gone * e + left) * half, 1e-99), 1e99)


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    n = (c.size - 1) // 2
    advance(x, c, u[0])
    total = 0.0
    for i in range(n):
        total += c[n + i] * math.log(x[1 + i])
    return v + c[2 * n] * total


@jit
def elements(x: Floats, c: Floats, u: Floats, wanted: Flags, out: Floats) -> None:
    """What each branch would add with a stiffness of 1, at the samples that are wanted."""
    n, at = (c.size - 1) // 2, 0
    for k in range(u.shape[0]):
        advance(x, c, u[k, 0])
        if wanted[k]:
            for i in range(n):
                out[at, i] = c[2 * n] * math.log(x[1 + i])
            at += 1


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    """Decay, stiffness, s; branches without any stiffness are left out."""
    stiffness = np.array([p[name] for name in STIFFNESSES])
    there = stiffness != 0.0
    return np.concatenate((np.exp(-dt_s / ladder(p)[there]), stiffness[there], [p["flow_mm"]]))


def initial(x: Floats, c: Floats, u: Floats, v: float) -> None:
    x[0] = u[0]
    for i in range((c.size - 1) // 2):
        x[1 + i] = 1.0


EFFECT = Effect(
    name="relaxation_eyring",
    title="relaxation beside the spring that flows under load (Eyring)",
    site="linear",
    channels=("deformation_mm",),
    parameters=(
        Parameter("flow_mm", "mm", neutral=0.05, low=1e-6, high=1e6, starts=(0.05,),
                  meaning="stretch of a branch from which on it flows faster than in proportion",
                  expected="a few per cent of the travel", amplitude=False),
        *PARAMETERS,
    ),
    step=step,
    prepare=prepare,
    n_state=1 + N_BRANCHES,
    equation="F = F_core + sum k_i e_i,  de_i/dt = dx/dt - s sinh(e_i / s) / tau_i",
    source="Eyring, J. Chem. Phys. 4 (1936) 283; Bergstrom & Boyce, J. Mech. Phys. Solids 46 (1998) 931",
    separating_test="steps of several heights, each held for 30 min: the larger loses the larger share at once",
    initial=initial,
    variant_of="relaxation",
    elements=elements,
)  # fmt: skip
