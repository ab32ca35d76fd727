"""Which set of effects: sets grow from the best few, every one re-estimated whole, judged on blocks held back.

Two sets and one of other effects are carried on at every size (a beam), so that a pair whose members say little alone
is not lost behind the best single; what a member no longer explains beside the others is taken out again.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thrustd.core.types import Progress
from thrustd.diagnose.search.base import Base
from thrustd.diagnose.search.better import LAW, eased, fewest, gained, simplest, stands
from thrustd.diagnose.search.curves import Followed, estimated, followed
from thrustd.diagnose.search.floor import at_floor, before, far_above, floor_of, hardly_anything, left
from thrustd.diagnose.search.grow import begin_at, grown, hopeful, joined, seen_beside, unheard
from thrustd.diagnose.search.joint import Joint, joint_fit, unmoved
from thrustd.diagnose.search.library import Rig, curve_sigma, laws, terms_of
from thrustd.diagnose.search.screen import (
    SAYS,
    TRIED,
    Looked,
    Probe,
    Table,
    leading,
    probed,
    screened,
    screened_modulations,
    screened_pairs,
    singles,
    table_of,
)
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.terms import Term, split
from thrustd.model.effect import Effect
from thrustd.model.stage import DEFORMATION

MOST = 3  # effects in a set
BEAM = 2  # sets carried on
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


@dataclass(frozen=True, slots=True)
class Looks:
    """The fit without any effect, its linear look at every law, and the laws, each from every start."""

    nothing: Joint
    table: Table
    looked: list[Looked]
    probes: list[Probe]
    terms: list[Term]
    worth: float  # of the mean square beside the moved core that the best law removes


def look(base: Base, records: Sequence[Record], nothing: Joint, effects: Sequence[Effect], rig: Rig) -> Looks:
    """Every law is looked at from two places: core and reference moved to these records, and both as they were.

    A core, or a cell that walks, that has taken on much of a large effect hides it; one that was wrong shows too much.
    The laws' own columns are those beside the moved core in both: a linear look needs no second run of each.
    """
    terms = [term for effect in laws(effects) for term in terms_of(effect, rig)]
    table = table_of(base, nothing)
    probes, left_mse = probed(table, terms), table.mse()
    moved = screened(table, probes)
    still = screened(table_of(base, unmoved(base, records, nothing), still=base.benched), probes)
    seen = [*moved, *(replace(one, before=max(one.before, left_mse) if base.benched else left_mse) for one in still)]
    clearest = {id(one.term): one for one in sorted(seen, key=lambda one: one.removes)}
    looked = sorted(clearest.values(), key=lambda one: -one.removes)
    return Looks(nothing, table, looked, probes, terms, max((left_mse - one.mse for one in moved[:1]), default=0.0))


def rank(
    base: Base, records: Sequence[Record], effects: Sequence[Effect], rig: Rig, progress: Progress | None = None
) -> Ranked:
    """Judge every set that grows from nothing."""
    nothing = joint_fit(base, records, ())
    looks = look(base, records, nothing, effects, rig)
    fits, best, beam = [nothing], nothing, [nothing]
    curves: list[Followed] = []
    strange = False
    for size in range(MOST):
        if best.terms and not room(base, nothing, best):  # a core that has moved there is no reason not to look
            break
        larger = grown_from(base, records, looks, best, beam, lambda word: _tell(progress, size, word))  # noqa: B023
        fits += larger
        step = advanced(base, nothing, best, larger)
        asks = step is not None or not at_floor(nothing, base)
        if size == 0 and asks and not any(at_floor(fit, base) for fit in larger):
            curves = _curves(base, records, looks, larger)
            if strange := _strange(curves, looks.terms, larger):
                break
        if step is None:
            break
        best, beam = step
    best = pruned(base, records, nothing, best, fits)
    if far_above(best, base) and not strange and not curve_says_it(base, best, curves):
        more = following(base, records, nothing, best, looks.terms, rig)
        fits += more
        best = pruned(base, records, nothing, simplest([best, *more]), fits)
    best = settled(base, records, looks, fits, fewest(fits, best))
    rivals = exchanged(base, records, looks, best, fits)
    fits += rivals
    best = simplest([best, *(fit for fit in rivals if adds(base, nothing, nothing, fit))])
    ordered = tuple(sorted(fits, key=lambda fit: fit.mse))
    return Ranked(nothing, best, ordered, tuple(looks.looked), tuple(curves), base.tremble)


def grown_from(
    base: Base,
    records: Sequence[Record],
    looks: Looks,
    best: Joint,
    beam: Sequence[Joint],
    tell: Callable[[str], None],
    most: int = 2 * TRIED,
) -> list[Joint]:
    """Every set of the beam with one effect more, estimated whole; from nothing a pair where no single stands.

    By `most` laws at most, those that look best.
    """
    found: list[Joint] = []
    for member in beam:
        seen = seen_beside(base, member, looks.terms, member.words) if member.terms else looks.looked
        own: list[Joint] = []
        for one in hopeful(base, leading(seen, most=most), best, found):
            tell(one.term.effect.word)
            own.append(grown(base, records, member, one))
        if any(stands(best, fit) for fit in own):
            own += [grown(base, records, member, one) for one in unheard(seen, own)]
        found += own
    if not best.terms and not any(stands(best, fit) for fit in found):  # together they may say what none says alone
        helped = any(gained(best, fit) for fit in found)
        pairs = screened_pairs(looks.table, singles(looks.looked, looks.probes))
        for pair in [pair for pair in pairs if pair.removes > SAYS][:1]:
            start = np.concatenate([begin_at(term) for term in pair.terms])
            both = joint_fit(base, records, pair.terms, start)
            if helped and not at_floor(both, base):  # some of it many laws take, and any two take more
                break
            found.append(both)
            if gained(best, both) and not both.shown:  # one of them stands beside the other, which no look told alone
                found += [joint_fit(base, records, (term,)) for term in pair.terms]
    return found


def advanced(base: Base, nothing: Joint, best: Joint, grown: Sequence[Joint]) -> tuple[Joint, list[Joint]] | None:
    """The best set of those that gain, and the sets that are grown further; None where none gains.

    A model that is no mount is judged by a mount's core in its stead: what is worse than the model gains nothing.
    """
    better = [fit for fit in grown if fit.mse < base.own_mse and adds(base, nothing, best, fit)]
    if not better:
        return None
    found = simplest(better)
    return found, carried(found, better)


def adds(base: Base, nothing: Joint, best: Joint, fit: Joint) -> bool:
    """Whether a set with one effect more gains by it.

    A small effect beside a large one may be what the large one's law missed, unless it explains the rest to the floor.
    """
    removed = best.mse - fit.mse
    large = removed > _known(base, nothing, best) or (at_floor(fit, base) and removed > fit.mse)
    return gained(best, fit) and fit.shown and (large or (not best.terms and eased(best, fit)))


def room(base: Base, nothing: Joint, best: Joint) -> bool:
    """Whether one effect more could gain, were it to explain everything down to the floor."""
    level = floor_of(best, base) ** 2
    return not at_floor(best, base) and left(best, base) - level > min(_known(base, nothing, best), level)


def _known(base: Base, nothing: Joint, best: Joint) -> float:
    """What the laws found so far may leave by not holding exactly."""
    return LAW * (before(nothing, base) - best.mse)


def settled(base: Base, records: Sequence[Record], looks: Looks, fits: list[Joint], best: Joint) -> Joint:
    """A single effect by the law that `extend` would take, which tries this effect's laws and no other's."""
    if len(best.terms) != 1:
        return best
    tried = {fit.terms[0].effect.name for fit in fits if fit.words == best.words}
    same = leading([one for one in looks.looked if one.term.effect.word == best.words[0]])
    fits += [joined(base, records, looks.nothing, one) for one in same if one.term.effect.name not in tried]
    return simplest([fit for fit in fits if fit.words == best.words and (fit.shown or fit is best)])


def exchanged(base: Base, records: Sequence[Record], looks: Looks, best: Joint, fits: Sequence[Joint]) -> list[Joint]:
    """Sets with another effect in a member's place that nobody tried: they are no proof against the one found.

    The linear look from no effect says little of a law whose shapes are unknown yet, or that the core hides. Looked at
    from what the found set leaves to a member, the core and other members as the set has them, its rivals come first.
    """
    tried, found = {_laws(fit.terms) for fit in fits}, []
    for rest in [without(best, member) for member in best.terms]:
        seen = leading(seen_beside(base, rest, looks.terms, best.words))
        new = [one for one in seen if _laws((*rest.terms, one.term)) not in tried]
        found += [joined(base, records, rest, one) for one in hopeful(base, new, None, [best])]
    return found


def without(fit: Joint, member: Term) -> Joint:
    """As if one of its effects were neutral, all else as it was."""
    whole = fit.solution
    numbers = zip(whole.shape.terms, split(whole.shape.terms, whole.point.terms), strict=True)
    rest = [(term, own) for term, own in numbers if term is not member]
    shape = replace(whole.shape, terms=tuple(term for term, _ in rest))
    point = replace(whole.point, terms=np.concatenate([np.zeros(0), *(own for _, own in rest)]))
    left_over = tuple(term for term in fit.terms if term is not member)
    return replace(fit, terms=left_over, solution=replace(whole, shape=shape, point=point))


def _laws(terms: Sequence[Term]) -> frozenset[str]:
    return frozenset(term.effect.name for term in terms)


def _curves(base: Base, records: Sequence[Record], looks: Looks, grown: Sequence[Joint]) -> list[Followed]:
    """Beside what the best law removes, at its linear look or estimated whole."""
    seen = followed(looks.table, curve_sigma(records))
    worth = max([looks.worth, *(looks.nothing.mse - fit.mse for fit in grown)])
    return estimated(base, records, looks.nothing, seen, worth, lambda fit: at_floor(fit, base))


def _strange(curves: Sequence[Followed], terms: Sequence[Term], singles: Sequence[Joint]) -> bool:
    """Whether one curve of a channel that no law reads explains it, and no law as well: several would say it worse."""
    read = {channel for term in terms for channel in term.effect.channels}
    least = min((fit.mse for fit in singles), default=np.inf)
    return any(curve.whole and curve.mse < least and not set(curve.parts) & read for curve in curves)


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
            more = [grown(base, records, last, one) for one in leading(seen, most=len(resisting))]
            if not (better := [fit for fit in more if adds(base, nothing, last, fit)]):
                break
            found.append(last := simplest(better))
    return found


def carried(best: Joint, fits: Sequence[Joint]) -> list[Joint]:
    """The sets that are grown further: the best, those that leave least of the others, and one of other effects.

    Beside another effect an effect's law may be another: two laws of one would hide what the beam is there for.
    """
    order = [best, *(fit for fit in sorted(fits, key=lambda fit: fit.mse) if fit is not best)]
    apart = [fit for fit in order if set(fit.words) != set(best.words)]
    return [*order[:BEAM], *(fit for fit in apart[:1] if not any(fit is one for one in order[:BEAM]))]


def pruned(base: Base, records: Sequence[Record], nothing: Joint, best: Joint, fits: list[Joint]) -> Joint:
    """Without the members that the others explain as well, told from nothing; what it estimates joins `fits`."""
    while len(best.terms) > 1:
        rests = [[term for term in best.terms if term is not left_out] for left_out in best.terms]
        fewer = [_estimated(base, records, rest, fits) for rest in rests]
        smaller = min((fit for fit in fewer if stands(nothing, fit)), key=lambda fit: fit.mse, default=best)
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
