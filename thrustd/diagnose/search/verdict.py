"""The verdict on what the search found: a set of effects, `none`, or `unknown`; and how sure that is."""

from collections.abc import Sequence
from dataclasses import dataclass

from thrustd.diagnose.search.base import Base
from thrustd.diagnose.search.better import another, borrowed, clearest
from thrustd.diagnose.search.curves import NEAR, Followed, followed, nearly
from thrustd.diagnose.search.floor import at_floor, floor_of, left, only_noise, shows, something, usual, white_floor
from thrustd.diagnose.search.joint import Joint
from thrustd.diagnose.search.library import curve_sigma
from thrustd.diagnose.search.ranking import Ranked
from thrustd.diagnose.search.table import table_of
from thrustd.diagnose.search.told import Likely, unsized
from thrustd.identify.regression.record import Record
from thrustd.model.modulated import BY

FOLLOWS = 0.5  # of what is left above the floor: a curve that removes as much says where it comes from
OUTDOES = 0.8  # of what the best set leaves above the floor: one free curve leaves less, and the law is another
FAINT = 0.1  # of the floor squared: less above it is not looked into


@dataclass(frozen=True, slots=True)
class Verdict:
    words: tuple[str, ...]
    fit: Joint
    channels: tuple[Followed, ...]  # what the rest follows, best first
    alike: tuple[str, ...] = ()  # sets that are not told from it
    rivals: Likely = ()  # the same effects by other laws or from other starts


def judge(base: Base, records: Sequence[Record], ranked: Ranked) -> Verdict:
    """The best set, `none`, or `unknown` where one free curve does better than every law and moves no core instead."""
    best, floor = ranked.best, floor_of(ranked.best, base) ** 2
    laws = [term.effect for term in best.terms if BY not in term.effect.name]
    curves = [c for c in another(ranked.curves, [set(law.channels) for law in laws]) if not borrowed(c, best)]
    several = len(best.terms) > 1 or (best.terms and not laws)
    alone = [c for c in curves if c.white <= best.white]
    if several and alone:  # one curve instead of several laws, or of one in proportion to it
        return Verdict(("unknown",), ranked.nothing, clearest(alone))
    if at_floor(best, base) or (not best.terms and left(best, base) <= usual(best, base)):
        return Verdict(best.words or ("none",), best, ())
    above, table = left(best, base) - floor, table_of(base, best)
    rest = [c for c in followed(table, curve_sigma(records)) if c.removed > FOLLOWS * above]
    missed, least = (best.white, white_floor(best, base)) if best.terms else (left(best, base), floor)
    leaves = {c.channel: c.white if best.terms else c.mse for c in curves}
    further = [c for c in curves if leaves[c.channel] * (1.0 + NEAR) < missed]  # a law is as good with fewer numbers
    strange = [c for c in further if missed - leaves[c.channel] > (1 - OUTDOES) * (missed - least)]
    if best.terms and not shows(best, base) and _of_no_channel(clearest(strange)):
        strange = []  # a law explains all that shows, and what curves do beside it any of them does
    much = above > FAINT * floor if best.terms else shows(best, base)  # a cell that drifts follows something by chance
    if (not best.terms and something(best, base)) or (much and (strange or (not best.terms and rest))):
        return Verdict(("unknown",), ranked.nothing, clearest(strange or rest))
    return Verdict(best.words or ("none",), best, clearest(rest))


def grade_of(base: Base, verdict: Verdict) -> str:
    """strong: no other set, nor channel, comes near; cannot be told: another does as well; weak: more is left.

    Or the size of an effect may be nothing.
    """
    said = verdict.channels if verdict.words == ("unknown",) else ()
    if verdict.alike or _of_no_channel(said):
        return "cannot be told"
    sized = not verdict.fit.terms or not unsized(base, verdict.fit, verdict.rivals)
    alone = sized and only_noise(verdict.fit, base) and not more_left(base, verdict)
    return "strong" if said or alone else "weak"


def _of_no_channel(curves: Sequence[Followed]) -> bool:
    """Whether a curve of other channels says as much as the best one: nothing tells what the error follows."""
    return any(not set(one.parts) & set(curves[0].parts) and nearly(curves[0], one) for one in curves[1:])


def more_left(base: Base, verdict: Verdict) -> bool:
    """Whether something else is missing too: the rest follows a channel, is much, or no effect was said to leave it."""
    nothing = verdict.words == ("none",) and not at_floor(verdict.fit, base)
    return bool(verdict.channels) or nothing or shows(verdict.fit, base)
