"""Where it fails, in words: the few combinations of regions that hold most of the error in least of the time.

Combinations of up to three regions (of different dimensions) are ranked by  share of error * log(share of error /
share of time), the part they contribute to the difference between the error's and the clock's distribution
(Kullback-Leibler). The best is taken, its samples are set aside, and so on.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from math import log

import numpy as np

from thrustd.diagnose.compare.newtons import newtons
from thrustd.diagnose.compare.regions import Mask, Region
from thrustd.model.stage import Floats

MOST = 5
LEAST_SHARE = 0.04  # of the squared error: less is not worth a line
LIFT = 1.4  # times more error than time
CORE = ("force", "direction", "time since step")  # dimensions that are combined by three


@dataclass(frozen=True, slots=True)
class Failure:
    """One place where the model fails; `mask` (n,) are its samples, shares are of the whole recording."""

    words: str
    labels: tuple[str, ...]
    share_of_squared_error: float
    share_of_time: float
    rmse_n: float
    bias_n: float
    mask: Mask

    @property
    def sentence(self) -> str:
        return (
            f"{self.words}: {100 * self.share_of_squared_error:.0f} % of the squared error"
            f" in {_percent(self.share_of_time)} % of the time"
            f" ({newtons(self.rmse_n, decimals=0)} N RMS,"
            f" measured minus model {newtons(self.bias_n, '+', 0)} N on average)"
        )


def where_it_fails(regions: Sequence[Region], residual_n: Floats) -> list[Failure]:
    """Ranked, worst first; empty when the error is spread as evenly as the time."""
    good = np.isfinite(residual_n)
    squares = np.where(good, residual_n, 0.0) ** 2
    total, count = float(squares.sum()), int(good.sum())
    free = good.copy()
    failures: list[Failure] = []
    pools = list(_combinations(regions))
    while len(failures) < MOST and total > 0:
        best = max(
            ((_score(m & free, squares, total, count), c, m) for c, m in pools), key=lambda s: s[0], default=None
        )
        if best is None or best[0] <= 0:
            break
        failures.append(_failure(best[1], best[2] & free, residual_n, total, count))
        free &= ~best[2]
    return sorted(failures, key=lambda f: -f.share_of_squared_error)


def _combinations(regions: Sequence[Region]) -> list[tuple[tuple[Region, ...], Mask]]:
    """Single regions, pairs, and triples of the core dimensions, that hold at least 0.1 % of the samples."""
    pools: list[tuple[tuple[Region, ...], Mask]] = [((region,), region.mask) for region in regions]
    for a, b in combinations(regions, 2):
        if a.dimension != b.dimension and {a.dimension, b.dimension} != {"rate", "direction"}:
            pools.append(((a, b), a.mask & b.mask))
    for a, b, c in combinations([r for r in regions if r.dimension in CORE], 3):
        if len({a.dimension, b.dimension, c.dimension}) == 3:
            pools.append(((a, b, c), a.mask & b.mask & c.mask))
    return [(chosen, mask) for chosen, mask in pools if mask.mean() > 1e-3]


def _score(mask: Mask, squares: Floats, total: float, count: int) -> float:
    error, time = float(squares[mask].sum()) / total, float(mask.sum()) / count
    if time == 0 or error < LEAST_SHARE or error < LIFT * time:
        return 0.0
    return error * log(error / time)


def _failure(chosen: tuple[Region, ...], mask: Mask, residual_n: Floats, total: float, count: int) -> Failure:
    inside = residual_n[mask]
    squares = float(np.sum(inside**2))
    labels = tuple(region.label for region in chosen)
    return Failure(
        ", ".join(labels),
        labels,
        squares / total,
        inside.size / count,
        (squares / inside.size) ** 0.5,
        float(inside.mean()),
        mask,
    )


def _percent(share: float) -> str:
    return f"{100 * share:.0f}" if share >= 0.1 else f"{100 * share:.1f}"
