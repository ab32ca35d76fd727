"""The laws of a set with as few shapes as the data tell."""

from collections.abc import Sequence

from thrustd.diagnose.search.base import Base
from thrustd.diagnose.search.joint import Joint, joint_fit, numbers_of
from thrustd.diagnose.search.library import Rig, terms_of
from thrustd.diagnose.search.ranking import untold
from thrustd.identify.regression.record import Record
from thrustd.model.effects import shelf


def plain(base: Base, records: Sequence[Record], best: Joint, rig: Rig) -> Joint:
    """Each law by the one of its word with fewer shapes, where held-back blocks do not tell the two.

    A shape of which these data say nothing would be its prior's in flight: two chambers, each at one temperature, do
    not say how late a mount warms.
    """
    for i, term in enumerate(best.terms):
        mine = {p.name for p in term.effect.parameters}
        for law in (one for one in shelf().values() if one.word == term.effect.word):
            if {p.name for p in law.parameters} < mine:
                fewer = (*best.terms[:i], next(terms_of(law, rig)), *best.terms[i + 1 :])
                trial = joint_fit(base, records, fewer)
                best = trial if numbers_of(trial) <= numbers_of(best) and untold(best, [trial]) else best
    return best
