"""Which of two sets of effects is better, on blocks of time held back, and which channels say most."""

from collections.abc import Sequence
from collections.abc import Set as AbstractSet

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.measures import SIGMAS_95
from thrustd.diagnose.search.base import Base
from thrustd.diagnose.search.curves import NEAR, Followed, nearly
from thrustd.diagnose.search.floor import EXACTLY, MOST, before
from thrustd.diagnose.search.joint import SURE, Joint, numbers_of, unlikely
from thrustd.model.elsewhere import AT
from thrustd.model.modulated import BY

FAR = 3.0  # as standard errors: a law so far from the best is no part of an interval
LAW = 0.01  # of the squared error removed: no law of rubber holds better than to a tenth of its force
WORTH = 0.03  # of the squared error: less is not worth an effect


def gained(before: Joint, after: Joint, worth: float = WORTH) -> bool:
    """Whether a larger set leaves clearly less on held-back blocks: in sum, or block by block as a ratio.

    Where a record moves now and then the sum is that of a few blocks, whatever was found; the ratio is of all that
    move. Or it leaves as little, and core and reference stay nearer to what was known of them (`eased`).
    """
    fall = (before.block_white - after.block_white) * before.block_size
    ratio = np.log(np.maximum(before.block_white, EXACTLY) / np.maximum(after.block_white, EXACTLY))
    sure = max(_sure(fall), _sure(ratio))
    less = max(before.mse / max(after.mse, EXACTLY), before.white / max(after.white, EXACTLY))
    return bool(less > 1.0 + worth and sure > SURE) or eased(before, after)


def _sure(less: Floats) -> float:
    """How many standard errors from block to block the mean of what is less is from nothing."""
    return float(less.mean() * np.sqrt(len(less)) / max(float(np.std(less)), EXACTLY))


def eased(before: Joint, after: Joint) -> bool:
    """Whether a larger set explains as much by an effect as a core or a reference that surely is no more as known."""
    nearer = relieved(before, after) and before.strain - after.strain > SURE**2
    return nearer and after.white <= (1.0 + NEAR) * before.white


def relieved(before: Joint | Followed, after: Joint) -> bool:
    """Whether core or reference surely stay nearer to what was known, by most of what they had moved.

    A bench that knew less than it says is a little further or nearer with every set.
    """
    parts = (before.moved, after.moved), (before.walked, after.walked)
    return any(was - now > SURE**2 and now < MOST * was for was, now in parts)


def borrowed(curve: Followed, best: Joint) -> bool:
    """Whether a curve lives on a core or reference that moves, by more than it explains beyond the best set.

    The noise is that of the one that leaves less: the other's has in it what it does not explain.
    """
    noise = min(curve.noise_variance, best.solution.noise_variance)
    explains = (best.white - curve.white) * float(np.sum(best.block_size)) / noise
    return relieved(curve, best) and explains < curve.moved + curve.walked - best.moved - best.walked


def stands(nothing: Joint, fit: Joint) -> bool:
    """Whether a set can be a verdict: nothing, or more than nothing explains, each of its effects told from nothing."""
    return not fit.terms or (fit.shown and gained(nothing, fit))


def simplest(fits: Sequence[Joint]) -> Joint:
    """With the fewest numbers, and the likeliest, of those that held-back blocks do not tell from the best.

    A law that reads another column than its own (a thermometer elsewhere, a modulation) has to be told from those that
    do not. Of those that the likeliest is not ahead of, the one that asks least of core, reference and effects.
    """
    best = min(fits, key=lambda fit: fit.white)
    alike = untold(best, fits)
    alike = [fit for fit in alike if not _reads_elsewhere(fit)] or alike
    fewest = min(map(numbers_of, alike))
    few = [fit for fit in alike if numbers_of(fit) == fewest]
    likeliest = min(few, key=lambda fit: unlikely(fit, best.solution.noise_variance))
    return min((fit for fit in few if not ahead(likeliest, fit)), key=lambda fit: fit.strain)


def _reads_elsewhere(fit: Joint) -> bool:
    return any(mark in term.effect.name for term in fit.terms for mark in (AT, BY))


def ahead(one: Joint, other: Joint) -> bool:
    """Whether it leaves less by a standard error of the difference from block to block."""
    return _sure((other.block_white - one.block_white) * one.block_size) > 1.0


def untold(best: Joint, fits: Sequence[Joint]) -> list[Joint]:
    """Those that held-back blocks do not tell from the best."""
    return [fit for fit in fits if fit.white < (1.0 + NEAR) * best.white and not gained(fit, best, 0.0)]


def rivals(best: Joint, fits: Sequence[Joint]) -> list[Joint]:
    """Sets of the same effects by other laws, or other starts, that held-back blocks do not tell from the best."""
    return untold(best, [fit for fit in fits if _is_other(fit, best)])


def likely(best: Joint, fits: Sequence[Joint]) -> list[tuple[Joint, float]]:
    """The same by how nearly they leave as little: 1 for who leaves no more, less by how much more and how surely.

    No law is in or out of an interval by a hair.
    """
    found = []
    for fit in fits:
        sure = _sure((fit.block_white - best.block_white) * best.block_size)
        far = np.clip([sure, (fit.white / best.white - 1.0) / NEAR], 0.0, FAR)
        share = float(np.exp(-far @ far / 2.0))
        if _is_other(fit, best) and np.all(far < FAR):
            found.append((fit, share))
    return found


def _is_other(fit: Joint, best: Joint) -> bool:
    return set(fit.words) == set(best.words) and _laws(fit) != _laws(best)


def _laws(fit: Joint) -> set[tuple[str, frozenset[tuple[str, float]]]]:
    return {(term.effect.name, frozenset(term.fixed.items())) for term in fit.terms}


def look_alikes(best: Joint, fits: Sequence[Joint], margin: float = 0.0) -> tuple[str, ...]:
    """Other sets of no more members that held-back blocks do not tell from the best, by any law of its effects.

    Nor where no more than the margin is between them. Of sets that say the same with a member more the smallest.
    """
    found: list[tuple[str, ...]] = []
    own = [best, *(fit for fit in fits if set(fit.words) == set(best.words))]
    for fit in sorted(fits, key=lambda fit: (len(fit.terms), fit.white)):
        told = fit.mse > best.mse + margin and any(gained(fit, one) for one in own)
        words = dict.fromkeys(fit.words)
        if 0 < len(fit.terms) <= len(best.terms) and words.keys() != set(best.words) and fit.shown and not told:
            found += [] if any(set(one) <= words.keys() for one in found) else [tuple(words)]
    return tuple("+".join(words) for words in found)


def inexact(base: Base, nothing: Joint, best: Joint) -> float:
    """Mean square that the laws found so far, here and before, may leave by not holding exactly.

    What is found in two rounds is judged as if it were found in one.
    """
    return LAW * (base.explained + max(before(nothing, base) - best.mse, 0.0))


def margin(base: Base, nothing: Joint, best: Joint) -> float:
    """Mean square that one law may leave more than another on these records though it is the true one.

    No law holds better than to LAW of what it explains, and what it misses by may be what the other law has. By chance
    that is the less likely the more ways these records try it in: every one is a trial (`ways`).
    """
    return SIGMAS_95**2 * inexact(base, nothing, best) / ways(nothing, best)


def ways(nothing: Joint, best: Joint) -> float:
    """In how many ways records try what a set explains: lines of its spectrum, as if all were as strong.

    A cycle that is repeated is one trial, a motion of many speeds and sizes many.
    """
    strong = much = 0.0
    for one, other in zip(nothing.solution.normal.residuals, best.solution.normal.residuals, strict=True):
        explained = (one - other)[np.isfinite(one - other)]
        power = np.abs(np.fft.rfft(explained - explained.mean()))[1:] ** 2 / len(explained)
        strong, much = strong + float(np.sum(power)), much + float(np.sum(power**2))
    return max(strong**2 / max(much, EXACTLY), 1.0)


def fewest(fits: Sequence[Joint], best: Joint) -> Joint:
    """The smallest set that held-back blocks do not tell from the best: nothing is named that need not be there."""
    nothing = next(fit for fit in fits if not fit.terms)
    alike = [fit for fit in fits if len(fit.terms) < len(best.terms) and not gained(fit, best) and stands(nothing, fit)]
    return min(alike, key=lambda fit: (len(fit.terms), fit.white)) if alike else best


def clearest(curves: Sequence[Followed]) -> tuple[Followed, ...]:
    """Three at most; of those that say nearly as much as the best, one channel before two combined."""
    best = min(curves, key=lambda c: c.white, default=None)
    return tuple(sorted(curves, key=lambda c: (not nearly(best, c), len(c.parts), c.white))[:3])


def another(curves: Sequence[Followed], own: Sequence[AbstractSet[str]]) -> list[Followed]:
    """Those along other channels than any one law's own; one of these times what hardly varies is no other.

    What joins two channels, of which two laws read one each, no law reads.
    """
    same = [one for one in curves if any(set(one.parts) <= channels for channels in own)]
    return [c for c in curves if c not in same and not any(set(s.parts) < set(c.parts) and nearly(c, s) for s in same)]
