"""The laws of a set with as few shapes as the data tell."""

from collections.abc import Iterator, Sequence

from thrustd.diagnose.search.base import Base
from thrustd.diagnose.search.joint import Joint, joint_fit, numbers_of
from thrustd.diagnose.search.library import Rig, terms_of
from thrustd.diagnose.search.ranking import untold
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.terms import Term
from thrustd.model.effect import Effect
from thrustd.model.effects import shelf


def plain(base: Base, records: Sequence[Record], best: Joint, rig: Rig) -> Joint:
    """Each law by the one of its word with fewer shapes, where held-back blocks do not tell the two.

    A shape of which these data say nothing would be its prior's in flight: two chambers, each at one temperature, do
    not say how late a mount warms.
    """
    for i, term in enumerate(best.terms):
        for law in _simpler(term):
            trials = [
                joint_fit(base, records, (*best.terms[:i], one, *best.terms[i + 1 :])) for one in terms_of(law, rig)
            ]
            trial = min(trials, key=lambda fit: fit.mse)
            best = trial if numbers_of(trial) <= numbers_of(best) and untold(best, [trial]) else best
    return best


def _simpler(term: Term) -> Iterator[Effect]:
    """Laws of the same word with some of its parameters and no other, those with most of them first."""
    mine = {p.name for p in term.effect.parameters}
    fewer = [
        law for law in shelf().values() if law.word == term.effect.word and {p.name for p in law.parameters} < mine
    ]
    yield from sorted(fewer, key=lambda law: -len(law.parameters))
