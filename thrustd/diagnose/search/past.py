"""What a mount may remember from before its record: one hypothesis, not a freedom of all of them.

A record that begins without load began at rest. Only where that leaves something, and a memory explains as much as the
effects that were found or clearly more beside them, is the search made once more with every lag free to remember an
earlier load. Only what held-back blocks then say clearly, or the evidence where both explain everything, speaks for it:
free memories are many numbers, and beside them a gain of 1 % is none.
"""

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from thrustd.diagnose.search.base import Base, remembering
from thrustd.diagnose.search.better import gained
from thrustd.diagnose.search.floor import at_floor, explains_all
from thrustd.diagnose.search.joint import Joint, joint_fit, prior_from
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.solve import prior_of
from thrustd.identify.segments import Segment

Found = TypeVar("Found")


def by_past(
    base: Base,
    rows: Sequence[Record],
    segments: Sequence[Segment],
    search: Callable[[Base, Sequence[Record]], Found],
    best_of: Callable[[Found], Joint],
    said: Callable[[Base, Found], bool],
) -> tuple[Base, Found]:
    """What a search finds from rest, or where the mount remembers, and the base that it was found from.

    `said`: whether what was found needs no memory, though no effect explains it.
    """
    rested = search(base, rows)
    best, other = best_of(rested), remembering(base, segments)
    if other is None or said(base, rested) or (at_floor(best, base) and not best.terms):
        return base, rested
    alone = joint_fit(other, rows, ())
    if at_floor(best, base):
        quiet = min(alone, best, key=lambda fit: fit.solution.noise_variance)  # what lasts beside one would hide it
        if not explains_all(alone, other) or surprise(other, alone, quiet) > surprise(base, best, quiet):
            return base, rested
        return other, search(other, rows)
    if gained(alone, best) and not gained(best, joint_fit(other, rows, best.terms)):  # memory stands for none of it
        return base, rested
    found = search(other, rows)
    return (other, found) if gained(best, best_of(found)) else (base, rested)


def surprise(base: Base, fit: Joint, like: Joint) -> float:
    """Minus twice the log of the evidence (Laplace), but for what two fits share; the noise is that of `like`."""
    found = fit.solution
    vector = found.point.vector(found.shape)
    groups = prior_of(found.shape, found.precisions)
    squares = found.normal.squares / like.solution.noise_variance
    prior = prior_from(base, found.shape).cost(vector) + float(vector @ groups @ vector)
    return float(squares + prior + np.linalg.slogdet(found.information)[1])
