"""Relaxation that flows: Maxwell branches beside the spring, whose dashpots give way by a power of their load.

    force of the rubber = core force + sum_i k_i e_i,    de_i/dt = dx/dt - s / tau_i |e_i / s|^m sgn(e_i)

e_i (mm): what is left of a branch's stretch; tau_i from fastest_s to slowest_s by equal ratios: how fast it lets go
at a stretch of s (flow_mm; at another one by another tau, so s is fixed). m = 1 is `relaxation_maxwell`. Chains that
slip past their network do so by m of about 4 (Bergstrom & Boyce, J. Mech. Phys. Solids 46 (1998) 931); m of about 10
is hard to tell from flow over a barrier that load lowers (sinh; Eyring, J. Chem. Phys. 4 (1936) 283), over the loads
of one mount. A large stretch is gone at once, a small one stays: it looks like friction whose level grows a little
with the rate.

Between samples half of the stretch comes, then time passes, then the other half: each exact, together right to second
order of the step. A variant of `relaxation`, and what `identify` finds by itself. Positive k_i: rubber dissipates.
Starts relaxed. Left out: a power of each branch's own, flow that hardens.
"""

import math
from collections.abc import Mapping

import numpy as np

from thrustd.core.columns import Flags
from thrustd.model.effect import Effect, Parameter
from thrustd.model.effects.relaxation_maxwell import N_BRANCHES, PARAMETERS, STIFFNESSES, ladder
from thrustd.model.stage import Floats, jit

MOST = 600.0  # natural logarithm of a rate: nothing is left


@jit
def advance(x: Floats, c: Floats, d: float) -> None:
    """x (1 + n,): last deformation, stretches; c: rate at s (n,), stiffness (n,), s, m - 1."""
    n = c.size // 2 - 1
    s, power = c[2 * n], c[2 * n + 1]
    half = 0.5 * (d - x[0])
    x[0] = d
    for i in range(n):
        e = x[1 + i] + half
        if e != 0.0:
            rate = c[i] * math.exp(min(power * math.log(abs(e) / s), MOST))
            e *= math.exp(-math.log(1.0 + rate) / power)
        x[1 + i] = e + half


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    n = c.size // 2 - 1
    advance(x, c, u[0])
    total = 0.0
    for i in range(n):
        total += c[n + i] * x[1 + i]
    return v + total


@jit
def elements(x: Floats, c: Floats, u: Floats, wanted: Flags, out: Floats) -> None:
    """What each branch would add with a stiffness of 1, at the samples that are wanted."""
    n, at = c.size // 2 - 1, 0
    for k in range(u.shape[0]):
        advance(x, c, u[k, 0])
        if wanted[k]:
            for i in range(n):
                out[at, i] = x[1 + i]
            at += 1


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    """Rate at s times m - 1, stiffness, s, m - 1; branches without any stiffness are left out."""
    stiffness = np.array([p[name] for name in STIFFNESSES])
    there, power = stiffness != 0.0, p["power"] - 1.0
    return np.concatenate((power * dt_s / ladder(p)[there], stiffness[there], [p["flow_mm"], power]))


def initial(x: Floats, c: Floats, u: Floats, v: float) -> None:
    x[0] = u[0]
    for i in range(c.size // 2 - 1):
        x[1 + i] = 0.0


EFFECT = Effect(
    name="relaxation_power",
    title="relaxation beside the spring that flows by a power of its load",
    site="linear",
    channels=("deformation_mm",),
    parameters=(
        Parameter("flow_mm", "mm", neutral=0.3, low=1e-6, high=1e6, starts=(0.3,),
                  meaning="stretch at which the branches have their time constants",
                  expected="a quarter of the travel", amplitude=False, estimate=False),
        Parameter("power", "-", neutral=4.0, low=1.01, high=30.0, starts=(4.0,),
                  meaning="of its load, by which a branch flows", expected="about 4 for rubber, 1: in proportion",
                  amplitude=False),
        *PARAMETERS,
    ),
    step=step,
    prepare=prepare,
    n_state=1 + N_BRANCHES,
    equation="F = F_core + sum k_i e_i,  de_i/dt = dx/dt - s |e_i / s|^m sgn(e_i) / tau_i",
    source="Bergstrom & Boyce, J. Mech. Phys. Solids 46 (1998) 931; Eyring, J. Chem. Phys. 4 (1936) 283",
    separating_test="steps of several heights, each held for 30 min: the larger loses the larger share at once",
    initial=initial,
    variant_of="relaxation",
    elements=elements,
)  # fmt: skip
