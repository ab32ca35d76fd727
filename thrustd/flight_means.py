"""What the estimates of a flight say of themselves, also where no truth is known: means, bands, shares of the time."""

from array import array

import msgspec
import numpy as np

from thrustd.columns import Integers
from thrustd.types import Estimate, Status

ENGINE_ROUTES = "fused", "mount", "brochure"
TOGETHER = 512  # estimates of one engine are counted at once
STD_EDGES_N = np.geomspace(0.1, 1e5, 691)  # bins of 2 %: a median takes no memory that grows
BITS = np.array([int(bit) for bit in Status])


class RouteMean(msgspec.Struct, frozen=True):
    """One route over a whole flight."""

    known_pct: float  # share of the estimates in which it had a value
    mean_n: float
    std_n: float  # one sigma as printed, median (to 1 %)
    farthest_n: float  # largest distance from the fused thrust


class EngineMeans(msgspec.Struct, frozen=True):
    """One engine over a whole flight."""

    routes: dict[str, RouteMean]  # those that ever had a value
    status_pct: dict[str, float]  # share of the estimates with each status bit that was ever on


class FlightMeans:
    """Listens to the estimates of one engine; memory stays flat."""

    __slots__ = ("_bits", "_farthest", "_known", "_n", "_rows", "_stds", "_sum")

    def __init__(self) -> None:
        self._rows = array("d")  # what was not counted yet: value and one sigma of each route, status
        self._n = 0
        self._known, self._sum, self._farthest = np.zeros((3, len(ENGINE_ROUTES)))
        self._stds = np.zeros((len(ENGINE_ROUTES), len(STD_EDGES_N) + 1), np.int64)
        self._bits = np.zeros(len(BITS), np.int64)

    def take(self, e: Estimate) -> None:
        routes = e.thrust_n, e.thrust_std_n, e.mount_n, e.mount_std_n, e.brochure_n, e.brochure_std_n
        self._rows.extend((*routes, e.status))
        if len(self._rows) >= TOGETHER * 7:
            self._count()

    def means(self) -> EngineMeans:
        """Of everything that was taken so far."""
        self._count()
        n = max(self._n, 1)
        return EngineMeans(
            {
                route: RouteMean(100 * known / n, total / known, _median(stds), farthest)
                for route, known, total, stds, farthest in zip(
                    ENGINE_ROUTES, self._known.tolist(), self._sum.tolist(), self._stds, self._farthest.tolist(),
                    strict=True,
                )
                if known
            },
            {str(bit.name).lower(): 100 * on / n for bit, on in zip(Status, self._bits.tolist(), strict=True) if on},
        )  # fmt: skip

    def _count(self) -> None:
        rows = np.array(self._rows).reshape(-1, 7)
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
        self._bits += (rows[:, 6:].astype(np.int64) & BITS != 0).sum(axis=0)


def _median(counts: Integers) -> float:
    """Middle of the bin that holds it."""
    at = int(np.searchsorted(np.cumsum(counts), counts.sum() / 2))
    low_n, high_n = STD_EDGES_N[[max(at - 1, 0), min(at, len(STD_EDGES_N) - 1)]]
    return float(np.sqrt(low_n * high_n))
