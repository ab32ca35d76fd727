"""The laws of a set with as few shapes as the data tell, and where shapes that they do not tell could be instead."""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from thrustd.core.columns import Floats
from thrustd.diagnose.search.base import Base
from thrustd.diagnose.search.better import eased, gained, look_alikes, margin, rivals, stands, untold
from thrustd.diagnose.search.floor import at_floor, mostly
from thrustd.diagnose.search.grow import begun_like, hopeful, joined
from thrustd.diagnose.search.joint import PRIOR, Joint, joint_fit, numbers_of, unlikely, without
from thrustd.diagnose.search.library import Rig, terms_of
from thrustd.diagnose.search.ranking import Ranked
from thrustd.diagnose.search.screen import leading, probed, screened
from thrustd.diagnose.search.table import table_of
from thrustd.diagnose.search.told import disputed
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.terms import Term, split
from thrustd.model.effect import Effect
from thrustd.model.effects import laws_like
from thrustd.model.stage import DEFORMATION


def undisputed(base: Base, records: Sequence[Record], ranked: Ranked, rig: Rig) -> tuple[Ranked, list[Joint]]:
    """With the best set's laws plain, and without an effect that other laws or starts say may as well be nothing.

    What remains has to explain most of what is unexplained, or nothing is named. Beside it the same effects otherwise.
    """
    best, fits = plain(base, records, ranked.best, rig), list(ranked.fits)
    while True:
        best, moved = elsewhere(base, records, best, rig)
        fits += [fit for fit in (best, *moved) if not any(fit is one for one in fits)]
        words = disputed(best, rivals(best, fits))
        if not words:
            real = mostly(ranked.nothing, best, base) or eased(ranked.nothing, best)
            best = best if real else ranked.nothing
            otherwise = [*moved, *by_other_laws(base, records, best, rig, fits)] if real else []
            return replace(ranked, best=best, fits=tuple(fits)), otherwise
        fewer = joint_fit(base, records, [term for term in best.terms if term.effect.word not in words])
        best = fewer if stands(ranked.nothing, fewer) else ranked.nothing


def plain(base: Base, records: Sequence[Record], best: Joint, rig: Rig) -> Joint:
    """Each law by the one of its word with as many shapes as held-back blocks tell, begun where it ended.

    A law with more shapes may end elsewhere from its own starts. A shape of which these data say nothing would be its
    prior's in flight: two chambers, each at one temperature, do not say how late a mount warms.
    """

    def instead(i: int, law: Effect) -> Joint:
        begun = split(best.terms, best.solution.point.terms[base.shape.sizes["terms"] :])
        other, start = begun_like(next(terms_of(law, rig)), best.terms[i].values(begun[i]))
        terms = (*best.terms[:i], other, *best.terms[i + 1 :])
        return joint_fit(base, records, terms, np.concatenate((*begun[:i], start, *begun[i + 1 :])), best)

    for i in range(len(best.terms)):
        for law in [] if at_floor(best, base) else _richer(best.terms[i], records):
            trial = instead(i, law)
            best = trial if trial.shown and gained(best, trial) else best
        for law in _simpler(best.terms[i]):
            trial = instead(i, law)
            best = trial if numbers_of(trial) <= numbers_of(best) and untold(best, [trial]) else best
    return best


def elsewhere(base: Base, records: Sequence[Record], best: Joint, rig: Rig) -> tuple[Joint, list[Joint]]:
    """The same laws with each shape that these data do not tell at its other starts: the likeliest end, and the others.

    What is not told there leaves the amplitude as much less known: how fast a rubber ages at first depends on how soon
    it has settled.
    """
    begun = split(best.terms, best.solution.point.terms[base.shape.sizes["terms"] :])
    sure = split(best.terms, best.std[best.new])
    found = []
    for i, term in enumerate(best.terms):
        numbers = dict(zip((p.name for p in term.free), begun[i], strict=True))
        for name, value in _unknown(term, sure[i], rig):
            moved = replace(term, fixed={**term.fixed, name: value})
            start = np.array([0.0 if p.name == name else numbers.get(p.name, 0.0) for p in moved.free])
            terms = (*best.terms[:i], moved, *best.terms[i + 1 :])
            found.append(joint_fit(base, records, terms, np.concatenate((*begun[:i], start, *begun[i + 1 :])), best))
    ends = sorted([best, *found], key=lambda fit: unlikely(fit, best.solution.noise_variance))
    return ends[0], ends[1:]


def by_other_laws(base: Base, records: Sequence[Record], best: Joint, rig: Rig, tried: Sequence[Joint]) -> list[Joint]:
    """Each effect by the other law of its word that says most in its place, whatever the search came by."""
    found = []
    for term in best.terms:
        rest = without(best, term)
        laws = [one for law in _judgeable(term, records) if law != term.effect for one in terms_of(law, rig)]
        table = table_of(base, rest)
        seen = leading(screened(table, probed(table, laws)), most=1)
        for one in hopeful(base, seen, None, [best]):
            names = sorted((one.term.effect.name, *(other.effect.name for other in rest.terms)))
            same = [fit for fit in tried if sorted(each.effect.name for each in fit.terms) == names]
            found.append(min(same, key=lambda fit: fit.white) if same else joined(base, records, rest, one))
    return found


def alike(base: Base, records: Sequence[Record], ranked: Ranked, best: Joint, rig: Rig) -> tuple[str, ...]:
    """Sets that these records do not tell from the best, whether or not the search had cause to estimate them.

    Beside one effect every other that looks so; beside several those without a member, by other laws of the rest.
    """
    within = margin(base, ranked.nothing, best)
    if len(best.terms) > 1:
        fewer = [by_other_laws(base, records, without(best, term), rig, ranked.fits) for term in best.terms]
        return look_alikes(best, [*ranked.fits, *itertools.chain(*fewer)], within)
    tried = {word for fit in ranked.fits if len(fit.terms) == 1 for word in fit.words}
    seen = [one.term.effect.word for one in ranked.looked if one.leaves < best.mse + within]
    return look_alikes(best, ranked.fits, within) + tuple(dict.fromkeys(word for word in seen if word not in tried))


def _unknown(term: Term, std: Floats, rig: Rig) -> list[tuple[str, float]]:
    """Other starts of its shapes that these data do not tell."""
    loose = [p.name for p, one in zip(term.free, std, strict=True) if not p.amplitude and one >= PRIOR]
    found = [(name, other.fixed[name]) for other in terms_of(term.effect, rig) for name in loose]
    return [one for one in dict.fromkeys(found) if one[1] != term.fixed[one[0]]]


def _richer(term: Term, records: Sequence[Record]) -> list[Effect]:
    """Laws of the same word with all of its parameters and more that these records can judge, fewest more first."""
    mine = {p.name for p in term.effect.parameters}
    more = [law for law in _judgeable(term, records) if {p.name for p in law.parameters} > mine]
    return sorted(more, key=lambda law: len(law.parameters))


def _judgeable(term: Term, records: Sequence[Record]) -> list[Effect]:
    """Laws of the same word whose channels are there."""
    there = {DEFORMATION}.union(*(one.channels for one in records))
    return [law for law in laws_like(term.effect) if set(law.channels) <= there]


def _simpler(term: Term) -> Iterator[Effect]:
    """Laws of the same word with some of its parameters and no other, those with most of them first."""
    mine = {p.name for p in term.effect.parameters}
    fewer = [law for law in laws_like(term.effect) if {p.name for p in law.parameters} < mine]
    yield from sorted(fewer, key=lambda law: -len(law.parameters))
