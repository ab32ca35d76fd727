"""Sets of effects that grow from nothing, every one estimated whole on blocks of time held back.

Two sets and one of other effects are carried on at every size (a beam), whether or not they stand: beside what is still
missing none may. Where nothing that stands explains all, another effect is tried in every member's place.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from thrustd.diagnose.search.base import Base
from thrustd.diagnose.search.better import eased, gained, inexact, simplest, stands
from thrustd.diagnose.search.floor import at_floor, floor_of, left, most_at_floor
from thrustd.diagnose.search.grow import (
    begin_at,
    begun_elsewhere,
    begun_like,
    grown,
    hopeful,
    joined,
    seen_beside,
    unheard,
)
from thrustd.diagnose.search.joint import Joint, joint_fit, unmoved, without
from thrustd.diagnose.search.library import Rig, laws, terms_of
from thrustd.diagnose.search.screen import (
    SAYS,
    TRIED,
    Looked,
    Probe,
    leading,
    probed,
    screened,
    screened_pairs,
    singles,
)
from thrustd.diagnose.search.table import Table, table_of
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.terms import Term
from thrustd.model.effect import Effect

MOST = 3  # effects in a set
BEAM = 2  # sets carried on


@dataclass(frozen=True, slots=True)
class Looks:
    """The fit without any effect, its linear look at every law, and the laws, each from every start."""

    nothing: Joint
    table: Table
    looked: list[Looked]
    probes: list[Probe]
    terms: list[Term]
    worth: float  # of the mean square beside the moved core that the best law removes

    def without(self, words: Sequence[str]) -> list[Probe]:
        """The laws of all other effects."""
        return [probe for probe in self.probes if probe.term.effect.word not in words]


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


def sets_grown(
    base: Base,
    records: Sequence[Record],
    looks: Looks,
    most: int,
    tell: Callable[[int, str], None],
    laws: int = 2 * TRIED,
    said: Callable[[list[Joint], Joint], bool] = lambda singles, best: False,
) -> tuple[Joint, list[Joint]]:
    """The best set of at most so many effects that grows from nothing, and every set that was estimated on the way.

    `said`: whether the single effects, of which this one stands, say that no set is to be looked for.
    """
    best, beam, fits = looks.nothing, [looks.nothing], list[Joint]()
    for size in range(most):
        if size and not room(base, looks.nothing, best):  # a core that has moved there is no reason not to look
            break
        larger = grown_from(base, records, looks, best, beam, partial(tell, size), laws)
        fits += larger
        best, beam = advanced(base, looks.nothing, best, larger)
        if len(best.terms) == 1 and size == 0 and not at_floor(best, base):  # the second is beside its best law
            others = otherwise(base, records, looks, best)
            fits += others
            best, beam = advanced(base, looks.nothing, looks.nothing, [*larger, *others])
        if (size == 0 and said(larger, best)) or not beam:
            return best, fits
    least = min(fits, key=lambda fit: fit.white, default=best)
    if len(least.terms) > 1 and room(base, looks.nothing, best):  # one of its members may be in the true one's place
        tried = [{*map(id, fit.terms)} for fit in fits]
        rests = [without(least, member).terms for member in least.terms]
        rivals = [joint_fit(base, records, rest) for rest in rests if {*map(id, rest)} not in tried]
        rivals += exchanged(base, records, looks, least, fits)
        best, _ = advanced(base, looks.nothing, best, rivals)
        fits += rivals
    return best, fits


def grown_from(
    base: Base,
    records: Sequence[Record],
    looks: Looks,
    best: Joint,
    beam: Sequence[Joint],
    tell: Callable[[str], None],
    most: int,
) -> list[Joint]:
    """Every set of the beam with one effect more, estimated whole: by `most` laws at most, those that look best."""
    found: list[Joint] = []
    for member in beam:
        seen = seen_beside(base, member, looks.without(member.words)) if member.terms else looks.looked
        own: list[Joint] = []
        size = len(member.terms) + 1
        wanted = taken(base, looks.nothing, best, size) if member.terms else np.inf
        for one in hopeful(base, leading(seen, most=most), best, found, wanted, max(MOST + 1 - size, 1)):
            tell(one.term.effect.word)
            own.append(grown(base, records, member, one))
        if any(stands(best, fit) for fit in own):
            own += [grown(base, records, member, one) for one in unheard(seen, own)]
        if member.terms and not base.benched and not any(at_floor(fit, base) for fit in own):
            own += [grown(base, records, member, one) for one in begun_elsewhere(seen, carried(best, own))]
        found += own
    if not best.terms and not any(stands(best, fit) for fit in found):  # two that hide each other show in no single
        pairs = screened_pairs(looks.table, singles(looks.looked, looks.probes))
        for terms in [pair.terms for pair in pairs if pair.removes > SAYS][:1]:
            start = np.concatenate([begin_at(term) for term in terms])
            found.append(joint_fit(base, records, terms, start))
    return found


def advanced(base: Base, nothing: Joint, best: Joint, grown: Sequence[Joint]) -> tuple[Joint, list[Joint]]:
    """The best set of those that gain, or the one before, and the sets that are grown further.

    What is missing beside an effect is an error that lasts, by which the effect itself may not be told from nothing. So
    sets that leave less are grown further whether or not they stand; one that no smaller set led to has to explain
    everything. A model that is no mount is judged by a mount's core in its stead: what is worse than the model gains
    nothing.
    """
    size = len(best.terms) + 1
    adding = [fit for fit in grown if fit.mse < base.own_mse and adds(base, nothing, best, fit)]
    better = [fit for fit in adding if len(fit.terms) <= size or at_floor(fit, base)]
    found = simplest(better) if better else best
    further = [fit for fit in grown if fit.white < found.white or any(fit is one for one in better)]
    return found, carried(found, further)


def adds(base: Base, nothing: Joint, best: Joint, fit: Joint) -> bool:
    """Whether a set with one effect more gains by it.

    A small effect beside a large one may be what the large one's law missed, unless it explains the rest to the floor.
    """
    removed = best.mse - fit.mse
    large = removed > inexact(base, nothing, best) or (at_floor(fit, base) and removed > fit.mse)
    return gained(best, fit) and fit.shown and (large or (not best.terms and eased(best, fit)))


def taken(base: Base, nothing: Joint, best: Joint, size: int) -> float:
    """Mean square below which a set of so many effects may be taken in the best one's place (`adds`, `advanced`)."""
    floor = most_at_floor(best, base)
    larger = max(best.mse - inexact(base, nothing, best), min(floor, best.mse / 2.0))
    return larger if size <= len(best.terms) + 1 else min(larger, floor)


def room(base: Base, nothing: Joint, best: Joint) -> bool:
    """Whether one effect more could gain, were it to explain everything down to the floor."""
    level = floor_of(best, base) ** 2
    return not at_floor(best, base) and left(best, base) - level > min(inexact(base, nothing, best), level)


def carried(best: Joint, fits: Sequence[Joint]) -> list[Joint]:
    """The sets that are grown further: the best if it is one, those that leave least, and one of other effects.

    Beside another effect an effect's law may be another: two laws of one would hide what the beam is there for.
    """
    order = sorted(fits, key=lambda fit: (fit is not best, fit.white))
    apart = [fit for fit in order if set(fit.words) != set(order[0].words)]
    return [*order[:BEAM], *(fit for fit in apart[:1] if not any(fit is one for one in order[:BEAM]))]


def otherwise(base: Base, records: Sequence[Record], looks: Looks, best: Joint) -> list[Joint]:
    """A single effect by its other laws, each begun where this one ended: from its own starts it may end elsewhere."""
    [known], mine = best.terms, best.solution.point.terms[base.shape.sizes["terms"] :]
    first = {term.effect.name: term for term in reversed(looks.terms) if term.effect.word == known.effect.word}
    begun = [begun_like(term, known.values(mine)) for name, term in first.items() if name != known.effect.name]
    return [joint_fit(base, records, (term,), start, best) for term, start in begun]


def exchanged(base: Base, records: Sequence[Record], looks: Looks, best: Joint, fits: Sequence[Joint]) -> list[Joint]:
    """Sets with another effect in a member's place that nobody tried: they are no proof against the one found.

    The linear look from no effect says little of a law whose shapes are unknown yet, or that the core hides. Looked at
    from what the found set leaves to a member, the core and other members as the set has them, its rivals come first.
    """
    tried, found = {_laws(fit.terms) for fit in fits}, []
    for rest in [without(best, member) for member in best.terms]:
        seen = leading(seen_beside(base, rest, looks.without(best.words)))
        new = [one for one in seen if _laws((*rest.terms, one.term)) not in tried]
        found += [joined(base, records, rest, one) for one in hopeful(base, new, None, [best], best.mse)]
    return found


def _laws(terms: Sequence[Term]) -> frozenset[str]:
    return frozenset(term.effect.name for term in terms)
