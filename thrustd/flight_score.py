"""Estimates against a known truth: what a replay of a simulated flight was worth.

The truth is read alongside the replay, so that memory stays flat. Between two truth rows it is a straight line.
"""

from array import array
from collections import Counter, defaultdict, deque
from collections.abc import Iterable, Iterator
from math import isfinite, nan, sqrt
from typing import NamedTuple

import msgspec
import numpy as np

from thrustd.columns import Floats
from thrustd.types import Estimate, Fault, MountOutput, Output

BAND_SIGMAS = 1.96  # 95 % of a normal distribution
PCT_ABOVE_N = 2000.0  # per mount: the thesis' operating range
ENGINE_ROUTES, MOUNT_ROUTES = ("fused", "mount", "brochure"), ("mount",)
TOGETHER = 512  # rows of one name are counted at once


class ErrorSums:
    """Running sums of one estimate's error."""

    __slots__ = ("_abs_pct", "_inside", "_n", "_n_band", "_n_pct", "_squares", "_sum", "_worst")

    def __init__(self) -> None:
        self._n = self._n_pct = self._n_band = self._inside = 0
        self._sum = self._squares = self._abs_pct = self._worst = 0.0

    def add(self, value_n: Floats, std_n: Floats, truth_n: Floats, pct_above_n: float) -> None:
        """Estimates and the truth at their times, each (n,); NaN: not known."""
        known = np.isfinite(value_n) & np.isfinite(truth_n)
        error_n, std_n, truth_n = (value_n - truth_n)[known], std_n[known], truth_n[known]
        if not len(error_n):
            return
        far_n, counted, banded = abs(error_n), truth_n > pct_above_n, np.isfinite(std_n)
        self._n += len(error_n)
        self._sum += float(error_n.sum())
        self._squares += float(error_n @ error_n)
        self._worst = max(self._worst, float(far_n.max()))
        self._n_pct += int(counted.sum())
        self._abs_pct += float((far_n[counted] / truth_n[counted]).sum()) * 100.0
        self._n_band += int(banded.sum())
        self._inside += int((far_n <= BAND_SIGMAS * std_n).sum())

    def score(self) -> "Score":
        if self._n == 0:
            return Score(0, nan, nan, nan, nan, nan)
        return Score(
            self._n,
            sqrt(self._squares / self._n),
            self._sum / self._n,
            self._abs_pct / self._n_pct if self._n_pct else nan,
            self._worst,
            100.0 * self._inside / self._n_band if self._n_band else nan,
        )


class Score(msgspec.Struct, frozen=True):
    """Error of one estimate against the truth."""

    n: int
    rmse_n: float
    bias_n: float
    mae_pct_above_2kn: float  # mean absolute error in % of truth, where truth exceeds 2 kN per mount
    worst_n: float
    inside_95_pct: float  # share of truth inside the printed 95 % band


class TruthRow(NamedTuple):
    name: str
    t_ns: int
    value_n: float


class FlightScore:
    """Listens to outputs; `truth` rows of all names in time order (any interleaving of names)."""

    def __init__(self, engines: tuple[str, ...], mounts: tuple[str, ...], n_mounts_of: tuple[int, ...]) -> None:
        self._engines, self._mounts = engines, mounts
        self._sums: dict[tuple[str, str], ErrorSums] = {}
        self._above_n = dict.fromkeys(mounts, PCT_ABOVE_N) | {
            name: PCT_ABOVE_N * n for name, n in zip(engines, n_mounts_of, strict=True)
        }
        # by name, what was not counted yet, row after row: truth, then value and one sigma of each route
        self._rows = {name: array("d") for name in self.names}
        self._lines: dict[str, _Line] = {}
        self._heard: set[int] = set()  # engines of which a route has spoken: before, nobody knows anything
        self.faults: Counter[tuple[str, str]] = Counter()
        self.estimates = 0
        self.first_ns = self.last_ns = -1

    @property
    def names(self) -> tuple[str, ...]:
        """Engines and mounts a truth may be known of."""
        return (*self._engines, *self._mounts)

    def follow(self, truth: Iterable[TruthRow]) -> None:
        """Compare with this truth from now on."""
        feed = _Feed(iter(truth))
        self._lines = {name: _Line(feed, name) for name in self.names}

    def take(self, output: Output) -> None:
        """Count one output of the pipeline."""
        if isinstance(output, Estimate):
            self.estimates += 1
            self.first_ns = output.t_ns if self.first_ns < 0 else self.first_ns
            self.last_ns = output.t_ns
            if self._lines:
                self._take_estimate(output)
        elif isinstance(output, MountOutput):
            if self._lines:
                name = self._mounts[output.mount]
                self._keep(name, (self._lines[name].at(output.t_ns), output.force_n, output.std_n))
        elif isinstance(output, Fault):
            self.faults[output.where, output.kind] += output.count

    def truth_n(self, name: str) -> float:
        """The truth at the time it was last asked for; NaN without."""
        return self._lines[name].value_n if name in self._lines else nan

    def scores(self) -> dict[str, dict[str, Score]]:
        """By engine or mount name: route -> score."""
        for name in self.names:
            self._count(name)
        table: dict[str, dict[str, Score]] = {}
        for (name, route), sums in sorted(self._sums.items()):
            table.setdefault(name, {})[route] = sums.score()
        return table

    def _take_estimate(self, e: Estimate) -> None:
        if isfinite(e.mount_n) or isfinite(e.brochure_n):
            self._heard.add(e.engine)
        if e.engine not in self._heard:
            return
        name = self._engines[e.engine]
        routes = e.thrust_n, e.thrust_std_n, e.mount_n, e.mount_std_n, e.brochure_n, e.brochure_std_n
        self._keep(name, (self._lines[name].at(e.t_ns), *routes))

    def _keep(self, name: str, row: tuple[float, ...]) -> None:
        rows = self._rows[name]
        rows.extend(row)
        if len(rows) >= TOGETHER * len(row):
            self._count(name)

    def _count(self, name: str) -> None:
        if not self._rows[name]:
            return
        routes = ENGINE_ROUTES if name in self._engines else MOUNT_ROUTES
        truth_n, *columns = np.frombuffer(self._rows[name]).reshape(-1, 1 + 2 * len(routes)).T
        self._rows[name] = array("d")
        for route, value_n, std_n in zip(routes, columns[::2], columns[1::2], strict=True):
            if (np.isfinite(value_n) & np.isfinite(truth_n)).any():
                sums = self._sums.setdefault((name, route), ErrorSums())
                sums.add(value_n, std_n, truth_n, self._above_n[name])


class _Feed:
    """One pass over the truth rows, dealt to the lines by name."""

    def __init__(self, rows: Iterator[TruthRow]) -> None:
        self._rows = rows
        self._waiting: defaultdict[str, deque[TruthRow]] = defaultdict(deque)

    def next(self, name: str) -> TruthRow | None:
        waiting = self._waiting[name]
        while not waiting:
            row = next(self._rows, None)
            if row is None:
                return None
            self._waiting[row[0]].append(row)
        return waiting.popleft()


class _Line:
    """The straight line between the two truth rows around the present time."""

    def __init__(self, feed: _Feed, name: str) -> None:
        self._feed, self._name = feed, name
        self._before: TruthRow | None = None
        self._after = feed.next(name)
        self.value_n = nan
        self._asked_ns = -1

    def at(self, t_ns: int) -> float:
        """Truth at t_ns (not decreasing from call to call); NaN outside the rows."""
        if t_ns != self._asked_ns:
            self._asked_ns, self.value_n = t_ns, self._at(t_ns)
        return self.value_n

    def _at(self, t_ns: int) -> float:
        while self._after is not None and self._after.t_ns < t_ns:
            self._before, self._after = self._after, self._feed.next(self._name)
        if self._after is None:
            return nan
        if self._after.t_ns == t_ns:
            return self._after.value_n
        if self._before is None:
            return nan
        part = (t_ns - self._before.t_ns) / (self._after.t_ns - self._before.t_ns)
        return self._before.value_n + part * (self._after.value_n - self._before.value_n)
