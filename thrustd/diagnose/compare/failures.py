"""Where it fails, in words: the few combinations of regions in which the error is larger than elsewhere, or one-sided.

Combinations of up to three regions (of different dimensions) are ranked by how much likelier the error becomes when
their samples get a variance and, where it is told, a mean of their own (normal likelihood, per sample of the record):

    gain = -1/2 (t log(v / s2) + (1 - t) log(v_rest / s2))        t: share of time, s2: variance of the whole error

The best is taken, its samples are set aside, and so on.

Neighbouring samples are not independent, and among a thousand slices some stand out by chance. So the record is cut
into blocks, and a slice counts only when the scatter of its share or of its mean from block to block (of those it
visits) leaves no doubt at the level of all slices together (Student's t, Bonferroni). What happened once is no rule.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np
from scipy.stats import t as student

from thrustd.core.columns import Flags, Floats
from thrustd.diagnose.compare.newtons import newtons
from thrustd.diagnose.compare.regions import Region

MOST = 5
LEAST_SHARE = 0.04  # of the squared error: less is not worth a line
LIFT = 1.4  # times more error than time
ONE_SIDED = 0.5  # of the squared error of a slice: its mean
LEAST_TIME = 1e-3  # of the record
CORE = ("force", "direction", "speed", "travel since reversal", "last movement", "time held")  # combined by three
BLOCKS = 30
DOUBT = 0.01  # of any slice by chance
PLAINER = 0.75  # of the best gain: the fewer words win
SAME = 0.95  # of the smaller one's samples: two regions that say the same


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

    @property
    def sentence(self) -> str:
        return (
            f"{self.words}: {100 * self.share_of_squared_error:.0f} % of the squared error"
            f" in {_percent(self.share_of_time)} % of the time"
            f" ({newtons(self.rmse_n, decimals=0, unit=self.unit)} RMS,"
            f" measured minus model {newtons(self.bias_n, '+', 0, self.unit)} on average)"
        )


@dataclass(frozen=True, slots=True)
class _Slices:
    """Combinations of regions; squared error, samples and sum of the error of each by block, (m, blocks)."""

    members: list[tuple[int, ...]]
    squares: Floats
    counts: Floats
    sums: Floats


def where_it_fails(regions: Sequence[Region], residual_n: Floats, unit: str = "N") -> list[Failure]:
    """Ranked, worst first; empty when the error is spread as evenly as the time."""
    good = np.isfinite(residual_n)
    error = np.where(good, residual_n, 0.0)
    squares = error**2
    total, count = float(squares.sum()), int(good.sum())
    if total <= 0 or not regions:
        return []
    masks = np.array([region.mask for region in regions])
    members, free = _combinations(regions, masks), good.copy()
    whole = _by_block(masks, [()], error, good)
    failures: list[Failure] = []
    while len(failures) < MOST:
        chosen = _best(_by_block(masks, members, error, free), whole)
        if chosen is None:
            break
        mask, labels = np.all(masks[list(chosen)], axis=0), [regions[i].label for i in chosen]
        inside, rest = float(np.mean(squares[mask & free])), squares[good & ~mask]
        if inside * LIFT < np.mean(rest):  # one-sided, and right beside the rest
            if failures:
                break
            mask, labels = ~mask, [regions[chosen[0]].rest, *labels[1:]]
        failures.append(_failure(labels, mask & free, residual_n, total, count, unit))
        free &= ~mask
    return sorted(failures, key=lambda f: -f.share_of_squared_error)


def _combinations(regions: Sequence[Region], masks: Flags) -> list[tuple[int, ...]]:
    """Single regions, pairs, and triples of the core dimensions; not those that say one thing twice."""
    thin = masks.astype(np.float32)
    both = thin @ thin.T
    alone = np.diagonal(both)
    apart = (both > 0) & (both < SAME * np.minimum(alone[:, None], alone[None, :]))
    dimension = [region.dimension for region in regions]

    def pairs(among: Sequence[int]) -> Iterator[tuple[int, int]]:
        return ((i, j) for i, j in combinations(among, 2) if dimension[i] != dimension[j] and apart[i, j])

    core = [i for i, name in enumerate(dimension) if name in CORE]
    triples = [
        (i, j, k)
        for i, j in pairs(core)
        for k in core
        if k > j and dimension[k] not in (dimension[i], dimension[j]) and apart[i, k] and apart[j, k]
    ]
    return [*((i,) for i in range(len(regions))), *pairs(range(len(regions))), *triples]


def _by_block(masks: Flags, members: Sequence[tuple[int, ...]], error: Floats, free: Flags) -> _Slices:
    """Sums by block of all combinations: products of matrices for pairs, for triples one set per third region."""
    edges = np.linspace(0, len(error), BLOCKS + 1).astype(int)
    table = np.zeros((3, len(members), BLOCKS))
    singles = np.array([m for m in members if len(m) == 1], dtype=int).reshape(-1, 1)
    at = {m: i for i, m in enumerate(members)}
    wide = [[m for m in members if len(m) == width] for width in (2, 3)]
    thirds = sorted({m[2] for m in wide[1]})
    for block, (a, b) in enumerate(pairwise(edges)):
        part = masks[:, a:b].astype(np.float32)
        mine_error = error[a:b] * free[a:b]
        for row, weight in enumerate((mine_error**2, free[a:b], mine_error)):
            weighted = part * weight.astype(np.float32)
            if () in at:
                table[row, at[()], block] = float(weight.sum())
            if singles.size:
                table[row, [at[(int(i),)] for (i,) in singles], block] = weighted[singles[:, 0]].sum(axis=1)
            if wide[0]:
                pairs = np.array(wide[0])
                table[row, at[wide[0][0]] : at[wide[0][-1]] + 1, block] = (weighted @ part.T)[pairs[:, 0], pairs[:, 1]]
            for third in thirds:
                mine = [m for m in wide[1] if m[2] == third]
                rows = sorted({i for m in mine for i in m[:2]})
                place = {r: i for i, r in enumerate(rows)}
                sums = (weighted[rows] * part[third]) @ part[rows].T
                table[row, [at[m] for m in mine], block] = sums[
                    [place[m[0]] for m in mine], [place[m[1]] for m in mine]
                ]
    return _Slices(list(members), *table)


def _best(slices: _Slices, whole: _Slices) -> tuple[int, ...] | None:
    """The plainest of the best combinations that stand out beyond chance."""
    score = _scores(slices, whole)
    if not (score > 0).any():
        return None
    near = np.flatnonzero(score >= PLAINER * score.max())
    return min((slices.members[i] for i in near), key=lambda m: (len(m), -score[slices.members.index(m)]))


def _scores(slices: _Slices, whole: _Slices) -> Floats:
    """Gain in likelihood; 0 for what is small, or as elsewhere, or may be chance (m,)."""
    total, count = whole.squares.sum(), whole.counts.sum()
    samples = np.maximum(slices.counts.sum(axis=1), 1e-300)
    share, time = slices.squares.sum(axis=1) / total, samples / count
    visits = np.maximum((slices.counts > 0).sum(axis=1), 1)
    sure = student.ppf(1 - DOUBT / max(1, int((time > LEAST_TIME).sum())), np.maximum(visits - 1, 1))
    counted = (visits > 1) & (share >= LEAST_SHARE) & (time > LEAST_TIME)
    spread = np.sqrt(visits / np.maximum(visits - 1, 1))
    larger = counted & _larger(slices, whole, share, time, sure * spread)
    mean = slices.sums.sum(axis=1) / samples - whole.sums.sum() / count
    scatter = np.linalg.norm(slices.sums - (slices.sums.sum(axis=1) / samples)[:, None] * slices.counts, axis=1)
    one_sided = counted & (np.abs(mean) > sure * spread * scatter / samples)
    one_sided &= mean**2 >= ONE_SIDED * share * total / samples
    own = np.where(one_sided, mean**2, 0.0)
    found: Floats = np.where(larger | one_sided, _gain(slices, whole, samples / count, own), 0.0)
    return found


def _larger(slices: _Slices, whole: _Slices, share: Floats, time: Floats, sure: Floats) -> Flags:
    """More squared error than time, and more than in the rest by the scatter of both from block to block."""
    inside, in_std = _mean_square(slices.squares, slices.counts)
    outside, out_std = _mean_square(whole.squares - slices.squares, whole.counts - slices.counts)
    apart = np.log(np.maximum(inside, 1e-300)) - np.log(np.maximum(outside, 1e-300))
    found: Flags = (share > LIFT * time) & (apart > sure * np.hypot(in_std, out_std))
    return found


def _mean_square(squares: Floats, counts: Floats) -> tuple[Floats, Floats]:
    """Of each slice, and one sigma of its logarithm by blocks (m,)."""
    total, samples = squares.sum(axis=1), np.maximum(counts.sum(axis=1), 1.0)
    scatter = np.linalg.norm(squares - (total / samples)[:, None] * counts, axis=1)
    return total / samples, scatter / np.maximum(total, 1e-300)


def _gain(slices: _Slices, whole: _Slices, time: Floats, own: Floats) -> Floats:
    """`own` (m,): square of the mean that a slice gets."""
    count, middle = whole.counts.sum(), whole.sums.sum() / whole.counts.sum()
    all_n2 = whole.squares.sum() - count * middle**2
    inside = slices.squares.sum(axis=1) - 2 * middle * slices.sums.sum(axis=1) + time * count * middle**2
    variance = inside / (time * count) - own
    rest = (all_n2 - inside) / np.maximum((1 - time) * count, 1e-300)
    least = 1e-12 * all_n2 / count
    gain: Floats = -0.5 * (
        time * np.log(np.maximum(variance, least) * count / all_n2)
        + (1 - time) * np.log(np.maximum(rest, least) * count / all_n2)
    )
    return gain


def _failure(labels: Sequence[str], mask: Flags, residual_n: Floats, total: float, count: int, unit: str) -> Failure:
    inside = residual_n[mask]
    squares = float(np.sum(inside**2))
    return Failure(
        ", ".join(labels),
        tuple(labels),
        squares / total,
        inside.size / count,
        (squares / inside.size) ** 0.5,
        float(inside.mean()),
        mask,
        unit,
    )


def _percent(share: float) -> str:
    return f"{100 * share:.0f}" if share >= 0.1 else f"{100 * share:.1f}"
