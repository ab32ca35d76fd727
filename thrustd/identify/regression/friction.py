"""Friction that yields (Bouc-Wen) as a part of every mount, beside the stops: data without it leave it at nothing.

Stops obey Masing's rule; real joints and fillers often do not: cycled gently they let go what they hold. One element
whose force, and the deformation over which it turns over, are estimated with everything else says which it is.
"""

from collections.abc import Sequence

import numpy as np

from thrustd.core.columns import Floats
from thrustd.identify.regression.solve import Solution
from thrustd.identify.regression.table import FRICTION, WITHIN, std_of
from thrustd.identify.regression.terms import Term, at_start, split
from thrustd.model.artifact import EffectSpec
from thrustd.model.effects.hysteresis import EFFECT

GROWS = (FRICTION, EFFECT.name)  # what `identify` finds by itself may be found once more, on top
SIZE = 0.1  # of the output's spread: one sigma of the friction
YIELD = 0.1  # of the travel: where the deformation of the turn begins, one sigma is a factor of e
BEGIN = 0.1  # of its sigma: where the friction begins, so that the deformation of the turn can move
NOISE = 1.5  # sigmas: where the play begins that keeps the tremble of a reading out of friction
CALM, AT_CALM = 0.25, 0.3186  # share of Gaussian samples below so many sigmas


def play_of(d: Floats) -> float:
    """Where the play around a reading begins, from its noise: from the smallest of its second differences."""
    bends = np.abs(np.diff(d, 2))
    return float(NOISE * np.quantile(bends, CALM) / (AT_CALM * np.sqrt(6.0))) if len(bends) else 0.0


def yielding(d: Sequence[Floats], scale: float, play: float | None = None) -> Term:
    """The element for these deformations and this spread of the output; play: None for that of their noise."""
    travel = max(float(x.max()) for x in d) - min(float(x.min()) for x in d)
    shape = {"yield_mm": YIELD * travel, "deadband_mm": max(map(play_of, d)) if play is None else play}
    return at_start(EFFECT, {"friction_n": SIZE * scale}, shape)


def effects_of(found: Solution) -> list[EffectSpec]:
    """What is beside the core as it flies; friction that is a tenth of the noise does not."""
    where = found.shape.parts()["terms"]
    terms, numbers = found.shape.terms, found.point.terms
    least = WITHIN * float(np.sqrt(found.mean_square)) * found.shape.output_scale
    parts = zip(terms, split(terms, numbers), split(terms, std_of(found)[where]), strict=True)
    told = [EffectSpec(term.effect.name, term.values(own), term.sigma(own, std)) for term, own, std in parts]
    return [e for e in told if e.name != EFFECT.name or e.parameters["friction_n"] > least]
