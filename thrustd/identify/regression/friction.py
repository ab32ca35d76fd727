"""What a mount may have beside curve, relaxation and stops: friction that yields, branches that no curve bends.

Stops obey Masing's rule; real joints and fillers often do not: cycled gently they let go what they hold. One element
whose force, and the deformation over which it turns over, are estimated with everything else says which it is
(Bouc-Wen, Berg, or one behind a free play, whichever follows the data better). Data without it leave it at nothing.
A rubber that hardens may relax whole, hardening and all, or only in what its deformation stretches
(`relaxation_maxwell`), or flow there by a power of its load (`relaxation_power`): the data choose.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from thrustd.core.columns import Floats
from thrustd.identify.regression.curve import travel
from thrustd.identify.regression.shape import Point, Shape
from thrustd.identify.regression.solve import Solution
from thrustd.identify.regression.table import FRICTION, WITHIN, std_of
from thrustd.identify.regression.terms import Term, at_start, split
from thrustd.identify.regression.walk import is_walk
from thrustd.model.artifact import EffectSpec
from thrustd.model.effect import Effect
from thrustd.model.effects.hysteresis import EFFECT
from thrustd.model.effects.hysteresis_backlash import EFFECT as BACKLASH
from thrustd.model.effects.hysteresis_berg import EFFECT as BERG
from thrustd.model.effects.relaxation_maxwell import EFFECT as BRANCHES
from thrustd.model.effects.relaxation_maxwell import STIFFNESSES, ladder
from thrustd.model.effects.relaxation_power import EFFECT as FLOWING

YIELDING = (EFFECT, BERG, BACKLASH)
BESIDE = (BRANCHES, FLOWING)  # the spring
GROWS = (
    FRICTION,
    *(law.name for law in YIELDING),
    BRANCHES.name,
    FLOWING.name,
)  # what `identify` finds by itself may be found once more, on top
SIZE = 0.1  # of the output's spread: one sigma of the friction
PLAY = 0.5  # of the deformation of the turn: where a play begins that is crossed without force
YIELD = 0.1  # of the travel: where the deformation of the turn begins, one sigma is a factor of e
FLOW = 0.25  # of the travel: the stretch at which branches that flow have the time constants of the lags
STIFFNESS = 0.1  # of the output's spread over the travel: one sigma of a branch, until the data tell their common size
BEGIN = 0.1  # of its sigma: where the friction begins, so that the deformation of the turn can move
NOISE = 3.0  # sigmas: where the play begins that keeps the tremble of a reading out of friction, nearly all of it
CALM, AT_CALM = 0.25, 0.3186  # share of Gaussian samples below so many sigmas


def noise_of(d: Floats) -> float:
    """One sigma of the white noise of a reading (n,), from the smallest of its second differences."""
    bends = np.abs(np.diff(d, 2))
    return float(np.quantile(bends, CALM) / (AT_CALM * np.sqrt(6.0))) if len(bends) else 0.0


def play_of(d: Floats) -> float:
    """Where the play around a reading begins."""
    return NOISE * noise_of(d)


def yielding(d: Sequence[Floats], scale: float, play: float | None = None) -> Term:
    """The element for these deformations and this spread of the output; play: None for that of their noise."""
    travel = max(float(x.max()) for x in d) - min(float(x.min()) for x in d)
    shape = {"yield_mm": YIELD * travel, "deadband_mm": max(map(play_of, d)) if play is None else play}
    return at_start(EFFECT, {"friction_n": SIZE * scale}, shape)


def by_law(term: Term, law: Effect, loose: bool) -> list[Term]:
    """The element by another law, whose shapes begin where that of the turn does.

    A play around the reading begins at the reading's noise; where joints may be `loose`, also at a gap that one crosses
    while its friction stands.
    """
    turn, found = term.fixed["yield_mm"], []
    gaps = [PLAY * turn] if loose and "deadband_mm" in law.neutral() else []
    for play in (term.fixed["deadband_mm"], *gaps):
        fixed = {"yield_mm": turn, "deadband_mm": play, "play_mm": PLAY * turn}
        values = {name: fixed.get(name, value) for name, value in law.neutral().items()}
        found.append(replace(term, effect=law, fixed=values))
    return found


def begun(terms: Sequence[Term]) -> Floats:
    """Numbers of terms that begin: their shapes as they are."""
    return np.array([BEGIN if p.amplitude else 0.0 for term in terms for p in term.free], float)


def law_of(shape: Shape) -> Effect:
    """By which the mount yields."""
    return next(term.effect for term in shape.terms if term.effect in YIELDING)


def branches_beside(shape: Shape, law: Effect, taus_s: Floats) -> Term:
    """The branches, over these time constants."""
    mm = travel(shape.f_grid)
    begin = {"fastest_s": float(taus_s[0]), "slowest_s": float(taus_s[-1]), "flow_mm": FLOW * mm}
    own = {name: begin.get(name, value) for name, value in law.neutral().items()}
    return at_start(law, dict.fromkeys(STIFFNESSES, STIFFNESS * shape.output_scale / mm), own)


def branched(shape: Shape) -> Effect | None:
    """The law of its branches, where it has any."""
    return next((term.effect for term in shape.terms if term.effect in BESIDE), None)


def stretched(shape: Shape, point: Point) -> list[tuple[float, float]]:
    """Time constants of the branches, s, and the force, N, that the travel stretches each by."""
    parts = zip(shape.terms, split(shape.terms, point.terms), strict=True)
    found = [term.values(numbers) for term, numbers in parts if term.effect in BESIDE]
    mm = travel(shape.f_grid)
    return [(float(tau), mm * p[k]) for p in found for tau, k in zip(ladder(p), STIFFNESSES, strict=True)]


def effects_of(found: Solution) -> list[EffectSpec]:
    """What is beside the core as it flies; friction that is a tenth of the noise does not."""
    where = found.shape.parts()["terms"]
    terms, numbers = found.shape.terms, found.point.terms
    least = WITHIN * float(np.sqrt(found.mean_square)) * found.shape.output_scale
    parts = zip(terms, split(terms, numbers), split(terms, std_of(found)[where]), strict=True)
    told = [
        EffectSpec(term.effect.name, term.values(own), term.sigma(own, std))
        for term, own, std in parts
        if not is_walk(term)
    ]
    return [e for e in told if e.name not in [law.name for law in YIELDING] or e.parameters["friction_n"] > least]
