"""What the estimates of a flight say of themselves, also where no truth is known: means, bands, shares of the time."""

from array import array
from math import nan

import msgspec
import numpy as np

from thrustd.core.columns import Integers
from thrustd.core.measures import OPERATING_N
from thrustd.core.types import Estimate, Status

ENGINE_SOURCES = "fused", "mount", "brochure"
TOGETHER = 512  # estimates of one engine are counted at once
UNFIT = int(
    Status.TRANSIENT | Status.ONE_MOUNT | Status.ENGINE_OFF | Status.CONVERGING | Status.GAP | Status.SENSOR_EXCLUDED
    | Status.LOAD_FACTOR_STALE | Status.MOUNT_REJECTED | Status.BROCHURE_REJECTED | Status.MOUNT_FAILED
    | Status.BROCHURE_FAILED
)  # fmt: skip
COLUMNS = 8
STD_EDGES_N = np.geomspace(0.1, 1e5, 691)  # bins of 2 %: a median takes no memory that grows
BITS = np.array([int(bit) for bit in Status])


class SourceMean(msgspec.Struct, frozen=True):
    """One source over a whole flight."""

    known_pct: float  # share of the estimates in which it had a value
    mean_n: float
    std_n: float  # one sigma as printed, median (to 1 %)
    farthest_n: float  # largest distance from the fused thrust


class EngineMeans(msgspec.Struct, frozen=True):
    """One engine over a whole flight."""

    sources: dict[str, SourceMean]  # those that ever had a value
    status_pct: dict[str, float]  # share of the estimates with each status bit that was ever on
    # steady, above 2 kN, both sources and both mounts trusted; NaN where there was no such time:
    residual_pct: float = nan  # mounts minus brochure, of the brochure's thrust: it falls while an engine wears
    load_share: float = nan  # upper mount's part, -: it moves when a mount or a transducer does


class FlightMeans:
    """Listens to the estimates of one engine; memory stays flat."""

    __slots__ = ("_bits", "_farthest", "_known", "_n", "_rows", "_stds", "_sum", "_trend")

    def __init__(self) -> None:
        self._rows = array("d")  # what was not counted yet: value and one sigma of each source, status, load share
        self._n = 0
        self._known, self._sum, self._farthest = np.zeros((3, len(ENGINE_SOURCES)))
        self._stds = np.zeros((len(ENGINE_SOURCES), len(STD_EDGES_N) + 1), np.int64)
        self._bits = np.zeros(len(BITS), np.int64)
        self._trend = np.zeros(4)  # sums of residual, brochure thrust and load share, and how many

    def take(self, e: Estimate) -> None:
        sources = e.thrust_n, e.thrust_std_n, e.mount_n, e.mount_std_n, e.brochure_n, e.brochure_std_n
        self._rows.extend((*sources, e.status, e.load_share))
        if len(self._rows) >= TOGETHER * COLUMNS:
            self._count()

    def means(self) -> EngineMeans:
        """Of everything that was taken so far."""
        self._count()
        n = max(self._n, 1)
        return EngineMeans(
            {
                source: SourceMean(100 * known / n, total / known, _median(stds), farthest)
                for source, known, total, stds, farthest in zip(
                    ENGINE_SOURCES, self._known.tolist(), self._sum.tolist(), self._stds, self._farthest.tolist(),
                    strict=True,
                )
                if known
            },
            {str(bit.name).lower(): 100 * on / n for bit, on in zip(Status, self._bits.tolist(), strict=True) if on},
            *self._trends(),
        )  # fmt: skip

    def _trends(self) -> tuple[float, float]:
        residual_n, brochure_n, share, n = self._trend.tolist()
        return (100 * residual_n / brochure_n, share / n) if n else (nan, nan)

    def _count(self) -> None:
        rows = np.array(self._rows).reshape(-1, COLUMNS)
        self._rows = array("d")
        values_n, stds_n = rows[:, 0:6:2], rows[:, 1:6:2]
        known = np.isfinite(values_n) & np.isfinite(stds_n)
        self._n += len(rows)
        self._known += known.sum(axis=0)
        self._sum += np.where(known, values_n, 0.0).sum(axis=0)
        apart_n = np.where(known, abs(values_n - values_n[:, :1]), 0.0)
        self._farthest = np.maximum(self._farthest, apart_n.max(axis=0, initial=0.0))
        for counts, std_n, there in zip(self._stds, stds_n.T, known.T, strict=True):
            counts += np.bincount(np.searchsorted(STD_EDGES_N, std_n[there]), minlength=len(counts))
        status = rows[:, 6:7].astype(np.int64)
        self._bits += (status & BITS != 0).sum(axis=0)
        fit = (status[:, 0] & UNFIT == 0) & known.all(axis=1) & (rows[:, 4] > OPERATING_N) & np.isfinite(rows[:, 7])
        mount_n, brochure_n, share = rows[fit][:, [2, 4, 7]].T
        self._trend += (mount_n - brochure_n).sum(), brochure_n.sum(), share.sum(), len(share)


def _median(counts: Integers) -> float:
    """Middle of the bin that holds it."""
    at = int(np.searchsorted(np.cumsum(counts), counts.sum() / 2))
    low_n, high_n = STD_EDGES_N[[max(at - 1, 0), min(at, len(STD_EDGES_N) - 1)]]
    return float(np.sqrt(low_n * high_n))
