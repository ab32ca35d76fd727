"""Hysteresis as a sum of stop operators with a weight each (Prandtl-Ishlinskii, free density).

    force = core force + (1 + g |x| / r_n) sum_i c_i s_i
    s_i <- clip(s_i + dx / r_i, -1, 1),   r_i = travel_mm * share_i

Springs, each in series with a dry slider (Iwan's and Jenkins' elements), which slip after deformations r_i spaced by
ratios; c_i is the force at which element i slips. Any loop that obeys Masing's rule is a sum of them; g lets all of
them grow with the deformation, as the friction of a filled rubber under load does. A variant of
`hysteresis`, and what `identify` finds by itself: the density is estimated, no shape of the loop is assumed. Positive
c_i resist motion; negative ones follow it late, as the elongation of a piezo stack does its voltage. Rate-independent.
Starts as if it had been loaded from no deformation, where every spring is relaxed.
Left out: unsymmetric loops.
"""

from collections.abc import Mapping

import numpy as np

from thrustd.core.columns import Flags
from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats, jit

USUAL = np.geomspace(0.004, 0.7, 16)  # radii as shares of the travel: above the last it is a spring
FINER = 10  # more of them, as far apart, for readings that show so little
SHARES = np.concatenate((USUAL[0] * (USUAL[0] / USUAL[1]) ** np.arange(FINER, 0, -1.0), USUAL))


@jit
def advance(state: Floats, radii: Floats, x: float) -> None:
    """state (1 + n,): last deformation, stops in units of their radius."""
    dx = x - state[0]
    state[0] = x
    for i in range(radii.size):
        state[1 + i] = min(max(state[1 + i] + dx / radii[i], -1.0), 1.0)


@jit
def step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    n = c.size // 2
    advance(x, c[:n], u[0])
    total = 0.0
    for i in range(n):
        total += c[n + i] * x[1 + i]
    return v + (1.0 + c[2 * n] * abs(u[0])) * total


@jit
def elements(x: Floats, c: Floats, u: Floats, wanted: Flags, out: Floats) -> None:
    """What each element would add with a weight of 1, at the samples that are wanted."""
    n, at = c.size // 2, 0
    radii = c[:n]
    for k in range(u.shape[0]):
        advance(x, radii, u[k, 0])
        if wanted[k]:
            for i in range(n):
                out[at, i] = (1.0 + c[2 * n] * abs(u[k, 0])) * x[1 + i]
            at += 1


def prepare(p: Mapping[str, float], dt_s: float) -> Floats:
    """Radii, weights, growth; elements without weight are left out."""
    weights = np.array([p[name] for name in WEIGHTS])
    there = weights != 0.0
    return np.concatenate(
        (p["travel_mm"] * SHARES[there], weights[there], [p["growth"] / (p["travel_mm"] * SHARES[-1])])
    )


def initial(x: Floats, c: Floats, u: Floats, v: float) -> None:
    x[0] = u[0]
    for i in range(c.size // 2):
        x[1 + i] = min(max(u[0] / c[i], -1.0), 1.0)


GROWTH = Parameter(
    "growth", "-", neutral=0.0, low=0.0, high=1e6, starts=(0.0, 0.5),
    meaning="by how much of itself the friction grows up to the deformation r_n", amplitude=False, spread=1.0,
)  # fmt: skip
PLACES = (*range(len(SHARES), len(USUAL), -1), *range(1, len(USUAL) + 1))  # finer ones are counted on
WEIGHTS = tuple(f"friction_{place:02d}_n" for place in PLACES)

EFFECT = Effect(
    name="hysteresis_stops",
    title="hysteresis by internal friction (stops with free weights)",
    site="force",
    channels=("deformation_mm",),
    parameters=(
        Parameter("travel_mm", "mm", neutral=1.0, low=1e-6, high=1e6, starts=(1.0,),
                  meaning="deformation that the radii are shares of", amplitude=False, estimate=False),
        GROWTH,
        *(
            Parameter(name, "N", neutral=0.0, low=-1e9, high=1e9, starts=(5.0,), passive=True,
                      meaning=f"force of the element that slips after {share:.2g} of the travel",
                      expected="positive; all of them 1 to 3 % of full load")
            for name, share in zip(WEIGHTS, SHARES, strict=True)
        ),
    ),
    step=step,
    prepare=prepare,
    n_state=1 + len(SHARES),
    equation="F = F_core + (1 + g |x| / r_n) sum c_i s_i,  s_i = clip(s_i + dx / r_i, -1, 1)",
    source="Brokate & Sprekels, Hysteresis and Phase Transitions, 1996, ch. 2; Iwan, J. Appl. Mech. 33 (1966) 893",
    separating_test="slow triangles of several amplitudes: small cycles make small loops",
    initial=initial,
    variant_of="hysteresis",
    elements=elements,
)  # fmt: skip
