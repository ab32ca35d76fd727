"""Which set of effects explains these records: sets grow from nothing (`sets`), and free curves compete (`curves`).

What a member no longer explains beside the others is taken out again; an effect is judged by the best of its laws.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from thrustd.core.types import Progress
from thrustd.diagnose.search.base import Base
from thrustd.diagnose.search.better import fewest, gained, simplest, stands
from thrustd.diagnose.search.curves import Followed, estimated, followed
from thrustd.diagnose.search.floor import at_floor, far_above, hardly_anything
from thrustd.diagnose.search.grow import grown, joined
from thrustd.diagnose.search.joint import Joint, joint_fit
from thrustd.diagnose.search.library import Rig, curve_sigma
from thrustd.diagnose.search.screen import Looked, leading, screened_modulations
from thrustd.diagnose.search.sets import MOST, Looks, adds, exchanged, look, sets_grown
from thrustd.diagnose.search.table import table_of
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.terms import Term
from thrustd.model.effect import Effect
from thrustd.model.stage import DEFORMATION

RESISTS = "force", DEFORMATION  # where friction and damping act, and what they read


@dataclass(frozen=True, slots=True)
class Ranked:
    """Fits by what they leave on held-back blocks; the linear look at every effect; free curves, estimated whole."""

    nothing: Joint
    best: Joint
    fits: tuple[Joint, ...]  # every set estimated whole, best first
    looked: tuple[Looked, ...]
    curves: tuple[Followed, ...]  # where the best single effect leaves something
    tremble: float  # see `Base`: without it all this was found


def rank(
    base: Base, records: Sequence[Record], effects: Sequence[Effect], rig: Rig, progress: Progress | None = None
) -> Ranked:
    """Judge every set that grows from nothing."""
    nothing = joint_fit(base, records, ())
    looks = look(base, records, nothing, effects, rig)
    curves: list[Followed] = []
    strange = False

    def said(singles: list[Joint], best: Joint) -> bool:
        """By one curve: no further law is looked for."""
        nonlocal curves, strange
        asks = best.terms or not at_floor(nothing, base)
        if asks and not any(at_floor(fit, base) for fit in singles):
            curves = _curves(base, records, looks, singles)
            strange = _strange(curves, looks.terms, singles)
        return strange

    best, larger = sets_grown(base, records, looks, MOST, partial(_tell, progress), said=said)
    fits = [nothing, *larger]
    best = pruned(base, records, nothing, best, fits)
    if far_above(best, base) and not strange and not curve_says_it(base, best, curves):
        more = following(base, records, nothing, best, looks.terms, rig)
        fits += more
        best = pruned(base, records, nothing, simplest([best, *more]), fits)
    best = settled(base, records, looks, fits, fewest(fits, best))
    rivals = exchanged(base, records, looks, best, fits)
    fits += rivals
    best = simplest([best, *(fit for fit in rivals if adds(base, nothing, nothing, fit))])
    ordered = tuple(sorted(fits, key=lambda fit: fit.white))
    return Ranked(nothing, best, ordered, tuple(looks.looked), tuple(curves), base.tremble)


def settled(base: Base, records: Sequence[Record], looks: Looks, fits: list[Joint], best: Joint) -> Joint:
    """A single effect by the law that `extend` would take, which tries this effect's laws and no other's."""
    if len(best.terms) != 1:
        return best
    tried = {fit.terms[0].effect.name for fit in fits if fit.words == best.words}
    same = leading([one for one in looks.looked if one.term.effect.word == best.words[0]])
    fits += [joined(base, records, looks.nothing, one) for one in same if one.term.effect.name not in tried]
    return simplest([fit for fit in fits if fit.words == best.words and (fit.shown or fit is best)])


def _curves(base: Base, records: Sequence[Record], looks: Looks, grown: Sequence[Joint]) -> list[Followed]:
    """Beside what the best law removes, at its linear look or estimated whole."""
    seen = followed(looks.table, curve_sigma(records))
    worth = max([looks.worth, *(looks.nothing.mse - fit.mse for fit in grown)])
    return estimated(base, records, looks.nothing, seen, worth, lambda fit: at_floor(fit, base))


def _strange(curves: Sequence[Followed], terms: Sequence[Term], singles: Sequence[Joint]) -> bool:
    """Whether one curve of a channel that no law reads explains it, and no law as well: several would say it worse."""
    read = {channel for term in terms for channel in term.effect.channels}
    least = min((fit.white for fit in singles), default=np.inf)
    return any(curve.whole and curve.white < least and not set(curve.parts) & read for curve in curves)


def curve_says_it(base: Base, best: Joint, curves: Sequence[Followed]) -> bool:
    """Whether one free curve leaves hardly anything where all laws leave much: no further law is looked for."""
    return far_above(best, base) and any(hardly_anything(curve.mse, best, base) for curve in curves)


def following(
    base: Base, records: Sequence[Record], nothing: Joint, best: Joint, terms: Sequence[Term], rig: Rig
) -> list[Joint]:
    """Sets grown by what resists motion, in proportion to a channel, while that gains.

    From the best, and from nothing: what was found before may stand for a part of it.
    """
    resisting = [term for term in terms if (term.effect.site, *term.effect.channels) == RESISTS]
    found: list[Joint] = []
    for last in [best, nothing] if best.terms else [nothing]:
        while len(last.terms) < MOST and far_above(last, base):
            seen = screened_modulations(table_of(base, last), resisting, rig)
            more = [grown(base, records, last, one) for one in leading(seen)]
            if not (better := [fit for fit in more if adds(base, nothing, last, fit)]):
                break
            found.append(last := simplest(better))
    return found


def pruned(base: Base, records: Sequence[Record], nothing: Joint, best: Joint, fits: list[Joint]) -> Joint:
    """Without the members that the others explain as well, told from nothing; what it estimates joins `fits`."""
    while len(best.terms) > 1:
        rests = [[term for term in best.terms if term is not left_out] for left_out in best.terms]
        fewer = [_estimated(base, records, rest, fits) for rest in rests]
        smaller = min((fit for fit in fewer if stands(nothing, fit)), key=lambda fit: fit.white, default=best)
        if smaller is best or gained(smaller, best):
            break
        best = smaller
    return best


def _estimated(base: Base, records: Sequence[Record], terms: Sequence[Term], fits: list[Joint]) -> Joint:
    """A set that has been estimated, or is now and joins them."""
    if not any({*map(id, fit.terms)} == {*map(id, terms)} for fit in fits):
        fits.append(joint_fit(base, records, terms))
    return next(fit for fit in fits if {*map(id, fit.terms)} == {*map(id, terms)})


def _tell(progress: Progress | None, size: int, what: str) -> None:
    if progress is not None:
        progress(1.0 - 0.5 ** (size + 1), what)
