"""One effect more: the linear look at every other one beside a set, and the set with it, estimated whole."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from thrustd.diagnose.search.base import Base
from thrustd.diagnose.search.floor import SHOWS, at_floor, over
from thrustd.diagnose.search.joint import BEGIN, Joint, joint_fit
from thrustd.diagnose.search.screen import Looked, Probe, screened
from thrustd.diagnose.search.table import table_of
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.terms import Term
from thrustd.model.stage import Floats

STARTS = 2  # further ones of a law that is grown further
SHOWN = 0.75  # of what a law removes: a look shows so much at least where the core is known, and more than this


def seen_beside(base: Base, member: Joint, probes: Iterable[Probe]) -> list[Looked]:
    """Laws from where a set stands, best first.

    Their columns are those of the first look: what a law does to the core hardly depends on the laws beside it, and a
    run of every law over a long record takes longer than a set estimated whole.
    """
    return screened(table_of(base, member), probes)


def joined(base: Base, records: Sequence[Record], member: Joint, one: Looked) -> Joint:
    """A set with one effect more, begun where the set was; the core as it was known."""
    return joint_fit(base, records, (*member.terms, one.term), begin_of(base, member, one))


def grown(base: Base, records: Sequence[Record], member: Joint, one: Looked) -> Joint:
    """The core, too, begun where the set was: one that has taken on what no effect explains yet is no such place."""
    like = member if member.terms else None
    return joint_fit(base, records, (*member.terms, one.term), begin_of(base, member, one), like)


def begin_of(base: Base, member: Joint, one: Looked) -> Floats:
    """Where the set was, and the newcomer nearly neutral."""
    known = member.solution.point.terms[base.shape.sizes["terms"] :]
    return np.concatenate((known, begin_at(one.term)))


def begin_at(term: Term) -> list[float]:
    """Nearly neutral amplitudes, a tenth of typical, and shapes at their starts."""
    return [min(BEGIN, 0.1 * abs(p.starts[0]) / term.std[p.name]) if p.amplitude else 0.0 for p in term.free]


def begun_like(term: Term, values: Mapping[str, float]) -> tuple[Term, Floats]:
    """A term whose shapes begin where another law of the same names ended, and its numbers there."""
    shapes = [p for p in term.effect.parameters if p.estimate and not p.amplitude and p.spread == 0.0]
    here = {p.name: values[p.name] for p in shapes if p.name in values}
    begun, start = replace(term, fixed={**term.fixed, **here}), []
    neutral = begun.values(np.zeros(len(begun.free)))
    for p in begun.free:
        away = values.get(p.name, neutral[p.name]) - neutral[p.name]
        start.append(away / (begun.std.get(p.name) or p.spread) if p.name not in here and away else 0.0)
    return begun, np.array(start)


def unheard(looked: Iterable[Looked], tried: Sequence[Joint]) -> list[Looked]:
    """Other effects that leave as little at a linear look as the best estimated: none of them loses by its place.

    Where many laws explain everything, as they do a thing that settles once, a look does not say whose turn it is.
    """
    least, words = min(fit.mse for fit in tried), {word for fit in tried for word in fit.words}
    found: dict[str, Looked] = {}
    for one in looked:
        if one.term.effect.word not in words and one.leaves <= least:
            found.setdefault(one.term.effect.word, one)
    return list(found.values())


def begun_elsewhere(looked: Iterable[Looked], fits: Iterable[Joint]) -> list[Looked]:
    """The newest law of these sets from its next best starts: where a core is free, a look hardly tells the best."""
    found, newest = [], [fit.terms[-1] for fit in fits]
    for term in newest:
        same = [one for one in looked if one.term.effect.name == term.effect.name]
        found += [one for one in same if not any(one.term is tried for tried in newest)][:STARTS]
    return list({id(one): one for one in found}.values())


def hopeful(
    base: Base,
    looked: Iterable[Looked],
    best: Joint | None,
    fits: Sequence[Joint],
    wanted: float = np.inf,
    further: int = 1,
) -> list[Looked]:
    """Without those whose look leaves more than the best smaller set did: such a set says less with more.

    Nor, behind one of `fits` at the floor, those that leave so much that something else would be missing. Nor, where a
    bench knows the core, those that are far from leaving what is `wanted`, were `further` effects to remove as much.
    """
    gains = [one for one in looked if best is None or not best.terms or one.leaves < best.mse]
    if base.benched:
        gains = [one for one in gains if one.promises * further > SHOWN * (one.before + one.averaged - wanted)]
    done = [fit for fit in fits if at_floor(fit, base)]
    return [one for one in gains if not any(over(one.leaves, fit, base) > SHOWS for fit in done)]
