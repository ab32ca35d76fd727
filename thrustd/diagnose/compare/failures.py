"""Where it fails, in words: the regions that the error goes with.

Every way of dividing the record competes on one scale, by motion, by load and by channel, alone and two at once: the
share of the squared error that belonging to its parts explains. Each part gets the mean that the other blocks of time
show there, and what that takes away from a block is its share:

    gain = sum over blocks b, parts c of (2 m_c S_cb - m_c^2 N_cb) / sum e^2,    m_c = (S_c - S_cb) / (N_c - N_cb)

N: samples, S: sum of the error less its mean over all. What happened once gains nothing, and what the best division of
all would gain by chance is asked of the record itself: the same with the sign of each block tossed (the wild bootstrap
of clusters; Cameron, Gelbach & Miller, Rev. Econ. Stat. 90 (2008) 414).

Of divisions within one standard error of the best (over blocks) that by motion is told before that by load, and this
before a channel: the mount's own motion is there in every record, a channel often only goes with it. Two at once are
told when they explain more than one, beyond doubt. The parts that are off farthest are named and set aside, and so on.
What is then left has no side: it is asked in the same way for parts where its square is larger than elsewhere.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from thrustd.core.columns import Flags, Floats
from thrustd.diagnose.compare.newtons import newtons
from thrustd.diagnose.compare.regions import ELSEWHERE, LOAD, MOTION, Region

MOST = 5
LEAST_SHARE = 0.04  # of the squared error: less is not worth a line, or another word
LIFT = 1.4  # times more error than time, where the error has no side
BLOCKS = 30
TOSSES = 199
DOUBT = 0.01  # of the best of all by chance
SURE = float(stdtrit(BLOCKS - 1, 1.0 - DOUBT))  # standard errors over blocks
NEARLY = 0.75  # of what a division explains, of the mean square of all: less of either is not where it fails


@dataclass(frozen=True, slots=True)
class Failure:
    """One place where the model fails; `mask` (n,) are its samples, shares are of the whole recording."""

    words: str
    labels: tuple[str, ...]
    share_of_squared_error: float
    share_of_time: float
    rmse_n: float
    bias_n: float
    mask: Flags
    unit: str = "N"
    explained: float = (
        0.0  # share of the squared error that is its mean; without a side, what it has more than the rest
    )

    @property
    def sentence(self) -> str:
        return (
            f"{self.words}: {100 * self.share_of_squared_error:.0f} % of the squared error"
            f" in {_percent(self.share_of_time)} % of the time"
            f" ({newtons(self.rmse_n, decimals=0, unit=self.unit)} RMS,"
            f" measured minus model {newtons(self.bias_n, '+', 0, self.unit)} on average)"
        )


@dataclass(frozen=True, slots=True)
class _Division:
    """Of all samples into parts, by one dimension or by two."""

    dimensions: tuple[str, ...]
    labels: tuple[tuple[str, ...], ...]  # by part
    part: NDArray[np.intp]  # (n,)

    @property
    def rank(self) -> int:
        """By motion, then by load, then by channel."""
        return sum(0 if name in MOTION else 1 if name == LOAD else 2 for name in self.dimensions)


@dataclass(frozen=True, slots=True)
class _Gained:
    """What a division explains, by block (blocks,), and what it would with tossed signs (tosses,)."""

    division: _Division
    gain: Floats
    by_chance: Floats

    @property
    def total(self) -> float:
        return float(self.gain.sum())

    def beats(self, other: "_Gained", sigmas: float) -> bool:
        """By more than so many standard errors over the blocks."""
        more = self.gain - other.gain
        return bool(more.sum() > sigmas * more.std(ddof=1) * BLOCKS**0.5)


def where_it_fails(regions: Sequence[Region], residual_n: Floats, unit: str = "N") -> list[Failure]:
    """Ranked, worst first; empty when the error goes with nothing."""
    known = np.isfinite(residual_n)
    error = np.where(known, residual_n, 0.0)
    total = float(np.sum(error**2))
    if total <= 0 or not regions:
        return []
    divisions, free = _divisions(regions), known.copy()
    found: list[list[Failure]] = []
    for squared in (False, True):
        while sum(map(len, found)) < MOST:
            best = _best(divisions, error**2 if squared else error, free)
            here = _parts(best, error, known, free, squared, unit) if best else []
            if not here:
                break
            found.append(here)
            for failure in here:
                free &= ~failure.mask
    found.sort(key=lambda here: -sum(failure.explained for failure in here))
    return [failure for here in found for failure in here][:MOST]


def _divisions(regions: Sequence[Region]) -> list[_Division]:
    """By every dimension, and by every two."""
    single = []
    for dimension in dict.fromkeys(region.dimension for region in regions):
        own = [region for region in regions if region.dimension == dimension]
        part = np.zeros(len(own[0].mask), dtype=np.intp)
        for i, region in enumerate(own, 1):
            part[region.mask] = i
        labels = ((ELSEWHERE.get(dimension, "elsewhere"),), *((region.label,) for region in own))
        single.append(_Division((dimension,), labels, part))
    single.sort(key=lambda division: division.rank)
    return [*single, *(_crossed(a, b) for a, b in combinations(single, 2))]


def _crossed(a: _Division, b: _Division) -> _Division:
    """Both at once; of two words where one follows from the other, the other alone."""
    part = a.part * len(b.labels) + b.part
    both = np.bincount(part, minlength=len(a.labels) * len(b.labels)).reshape(len(a.labels), len(b.labels))
    labels = tuple(
        a.labels[i] if both[i, j] == both[i].sum() else b.labels[j] if both[i, j] == both[:, j].sum()
        else a.labels[i] + b.labels[j]
        for i in range(len(a.labels)) for j in range(len(b.labels))
    )  # fmt: skip
    return _Division(a.dimensions + b.dimensions, labels, part)


def _best(divisions: Sequence[_Division], target: Floats, free: Flags) -> _Division | None:
    """The plainest of the best, if it explains more than the best would by chance."""
    if not free.any():
        return None
    centred, scale = target - target[free].mean(), float(np.sum(target**2))
    gained = _beyond_chance([_gained(division, centred, free, scale) for division in divisions])
    alone = _plain([one for one in gained if len(one.division.dimensions) == 1], ())
    near = alone.division.dimensions if alone else ()
    two = _plain([one for one in gained if len(one.division.dimensions) == 2], near)
    if alone and two and two.total >= alone.total + LEAST_SHARE and two.beats(alone, SURE):
        return two.division
    found = alone or two
    return found.division if found else None


def _beyond_chance(gained: Sequence[_Gained]) -> list[_Gained]:
    """Those that explain more than the best of all does by chance, as they are or over their own scatter."""
    tossed = np.array([one.by_chance for one in gained])
    middle, scatter = tossed.mean(axis=1), np.maximum(tossed.std(axis=1), np.finfo(float).tiny)
    sure = 1.0 - DOUBT
    share = np.quantile(tossed.max(axis=0), sure)
    sigmas = np.quantile(((tossed - middle[:, None]) / scatter[:, None]).max(axis=0), sure)
    return [
        one for one, least in zip(gained, np.minimum(share, middle + sigmas * scatter), strict=True)
        if one.total > max(least, LEAST_SHARE)
    ]  # fmt: skip


def _plain(gained: Sequence[_Gained], near: tuple[str, ...]) -> _Gained | None:
    """Of those within one standard error of the best: with dimensions that are named already, then by rank."""
    if not gained:
        return None
    best = max(gained, key=lambda one: one.total)
    alike = [one for one in gained if not best.beats(one, 1.0)]
    return min(alike, key=lambda g: (-len(set(near) & set(g.division.dimensions)), g.division.rank, -g.total))


def _gained(division: _Division, centred: Floats, free: Flags, scale: float) -> _Gained:
    counts, sums = _by_block(division, centred, free)
    tossed = np.swapaxes(sums[:, None, :] * _tosses(), 0, 1)
    by_chance = _held_back(counts, tossed).sum(axis=(1, 2))
    return _Gained(division, _held_back(counts, sums).sum(axis=0) / scale, by_chance / scale)


def _by_block(division: _Division, target: Floats, free: Flags) -> tuple[Floats, Floats]:
    """Samples and sum of every part by block (parts, blocks)."""
    shape = len(division.labels), BLOCKS
    where = (division.part * BLOCKS + np.arange(len(target)) * BLOCKS // len(target))[free]
    counts = np.bincount(where, minlength=shape[0] * BLOCKS).astype(np.float64)
    sums = np.bincount(where, target[free], shape[0] * BLOCKS).astype(np.float64)
    return counts.reshape(shape), sums.reshape(shape)


def _held_back(counts: Floats, sums: Floats) -> Floats:
    """Squares that the mean of the other blocks takes away (..., parts, blocks)."""
    samples, rest = (table.sum(axis=-1, keepdims=True) - table for table in (counts, sums))
    means = rest / np.maximum(samples, 1.0)
    found: Floats = means * (2.0 * sums - means * counts)
    return found


@cache
def _tosses() -> Floats:
    """Signs of the blocks, two neighbours alike (tosses, blocks)."""
    signs = np.random.default_rng(0).choice([-1.0, 1.0], size=(TOSSES, BLOCKS // 2))
    return np.repeat(signs, 2, axis=1)


def _parts(division: _Division, error: Floats, known: Flags, free: Flags, squared: bool, unit: str) -> list[Failure]:
    """The parts of a division that are off farthest, until the rest is not worth a line."""
    target = error**2 if squared else error
    middle, total = float(target[free].mean()), float(np.sum(error**2))
    counts, sums = _by_block(division, target - middle, free)
    sure = _held_back(counts, sums).sum(axis=1) > 0
    number = np.maximum(counts.sum(axis=1), 1.0)
    above = sums.sum(axis=1) / number
    more = above * number.sum() / np.maximum(number.sum() - number, 1.0)  # than in the rest
    mended = number * (more if squared else (above + middle) ** 2) / total
    worth = np.where(sure & (above * (above + middle) > 0), mended, 0.0)
    order = np.argsort(-worth)
    before = np.concatenate(([0.0], np.cumsum(worth[order])[:-1]))
    found = []
    for i in order[(worth[order] > 0) & (before < NEARLY * worth.sum())]:
        one = _failure(division.labels[i], free & (division.part == i), error, known, float(mended[i]), unit)
        least = (LIFT if squared else NEARLY) * one.share_of_time
        if one.share_of_squared_error >= max(LEAST_SHARE, least):
            found.append(one)
    return found


def _failure(labels: Sequence[str], mask: Flags, error: Floats, known: Flags, mended: float, unit: str) -> Failure:
    inside = error[mask]
    squares = float(np.sum(inside**2))
    return Failure(
        ", ".join(labels),
        tuple(labels),
        squares / float(np.sum(error**2)),
        inside.size / int(known.sum()),
        (squares / inside.size) ** 0.5,
        float(inside.mean()),
        mask,
        unit,
        mended,
    )


def _percent(share: float) -> str:
    return f"{100 * share:.0f}" if share >= 0.1 else f"{100 * share:.1f}"
