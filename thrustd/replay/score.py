"""Estimates against a known truth: what a replay of a simulated flight was worth.

The truth is read alongside the replay, so that memory stays flat. Between two truth rows it is a straight line.
"""

from array import array
from collections import Counter
from collections.abc import Sequence
from math import isfinite, nan, sqrt
from typing import NamedTuple

import msgspec
import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.measures import OPERATING_N, SIGMAS_95, percents
from thrustd.core.types import Estimate, Fault, MountOutput, Output
from thrustd.replay.means import ENGINE_SOURCES, TOGETHER, EngineMeans, FlightMeans

MOUNT_SOURCES = ("mount",)


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
        far_n, banded = abs(error_n), np.isfinite(std_n)
        large = percents(error_n, truth_n, pct_above_n)
        self._n += len(error_n)
        self._sum += float(error_n.sum())
        self._squares += float(error_n @ error_n)
        self._worst = max(self._worst, float(far_n.max()))
        self._n_pct += len(large)
        self._abs_pct += float(large.sum())
        self._n_band += int(banded.sum())
        self._inside += int((far_n <= SIGMAS_95 * std_n).sum())

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
    bias_n: float  # mean of estimate minus truth
    mae_pct_above_2kn: float  # mean absolute error in % of truth, where truth exceeds 2 kN per mount
    worst_n: float  # largest |error|
    inside_95_pct: float  # share of truth inside the printed 95 % band


class Truth(NamedTuple):
    """What is known of one engine or mount, times not decreasing."""

    name: str
    t_ns: Sequence[int]
    value_n: Sequence[float]


class FlightScore:
    """Listens to outputs; and to the truth, which may come a few seconds earlier or later."""

    def __init__(self, engines: tuple[str, ...], mounts: tuple[str, ...], n_mounts_of: tuple[int, ...]) -> None:
        self._engines, self._mounts = engines, mounts
        self._sums: dict[tuple[str, str], ErrorSums] = {}
        self._above_n = dict.fromkeys(mounts, OPERATING_N) | {
            name: OPERATING_N * n for name, n in zip(engines, n_mounts_of, strict=True)
        }
        # by name, what was not counted yet, row after row: time, then value and one sigma of each source
        self._rows = {name: array("d") for name in self.names}
        self._truth: dict[str, tuple[array[float], array[float]]] = {}  # by name: times and values
        self._means = tuple(FlightMeans() for _ in engines)
        self._heard: set[int] = set()  # engines of which a source has spoken: before, nobody knows anything
        self.faults: Counter[tuple[str, str]] = Counter()
        self.estimates = 0
        self.first_ns = self.last_ns = -1

    @property
    def names(self) -> tuple[str, ...]:
        """Engines and mounts a truth may be known of."""
        return (*self._engines, *self._mounts)

    def hear(self, truth: Truth) -> None:
        """What is known of one name; outputs are compared from here on."""
        name = truth.name
        times_ns, values_n = self._truth.setdefault(name, (array("d"), array("d")))
        times_ns.extend(truth.t_ns)
        values_n.extend(truth.value_n)
        if len(self._rows[name]) >= TOGETHER * self._width(name):
            self._count(name)

    def take(self, output: Output) -> None:
        """Count one output of the pipeline."""
        if isinstance(output, Estimate):
            self.estimates += 1
            self.first_ns = output.t_ns if self.first_ns < 0 else self.first_ns
            self.last_ns = output.t_ns
            self._means[output.engine].take(output)
            if self._truth:
                self._take_estimate(output)
        elif isinstance(output, MountOutput):
            name = self._mounts[output.mount]
            if name in self._truth:
                self._rows[name].extend((output.t_ns, output.force_n, output.std_n))
        elif isinstance(output, Fault) and output.active:
            self.faults[output.where, output.kind] += output.count

    def truth_n(self, name: str, t_ns: int) -> float:
        """As far as it was heard; NaN outside."""
        return float(np.interp(t_ns, *self._truth[name], nan, nan)) if name in self._truth else nan

    def means(self) -> dict[str, EngineMeans]:
        """By engine: what the estimates say of themselves, truth or not."""
        return {name: means.means() for name, means in zip(self._engines, self._means, strict=True)}

    def scores(self) -> dict[str, dict[str, Score]]:
        """By engine or mount name: source -> score."""
        for name in self._truth:
            self._count(name)
        table: dict[str, dict[str, Score]] = {}
        for (name, source), sums in sorted(self._sums.items()):
            table.setdefault(name, {})[source] = sums.score()
        return table

    def _take_estimate(self, e: Estimate) -> None:
        if isfinite(e.mount_n) or isfinite(e.brochure_n):
            self._heard.add(e.engine)
        name = self._engines[e.engine]
        if e.engine in self._heard and name in self._truth:
            sources = e.thrust_n, e.thrust_std_n, e.mount_n, e.mount_std_n, e.brochure_n, e.brochure_std_n
            self._rows[name].extend((e.t_ns, *sources))

    def _width(self, name: str) -> int:
        return 1 + 2 * len(self._sources(name))

    def _sources(self, name: str) -> tuple[str, ...]:
        return ENGINE_SOURCES if name in self._engines else MOUNT_SOURCES

    def _count(self, name: str) -> None:
        """Everything of which the truth is known by now; what is later waits for it."""
        times_ns, values_n = (np.array(column) for column in self._truth[name])
        rows = np.array(self._rows[name]).reshape(-1, self._width(name))
        n = int(np.searchsorted(rows[:, 0], times_ns[-1], "right"))
        self._rows[name] = array("d", rows[n:].tobytes())
        if n == 0:
            return
        first = max(int(np.searchsorted(times_ns, rows[n - 1, 0], "right")) - 1, 0)  # what is needed of it later
        self._truth[name] = array("d", times_ns[first:].tobytes()), array("d", values_n[first:].tobytes())
        asked_ns, *columns = rows[:n].T
        truth_n = np.interp(asked_ns, times_ns, values_n, nan, nan)
        for source, value_n, std_n in zip(self._sources(name), columns[::2], columns[1::2], strict=True):
            if (np.isfinite(value_n) & np.isfinite(truth_n)).any():
                sums = self._sums.setdefault((name, source), ErrorSums())
                sums.add(value_n, std_n, truth_n, self._above_n[name])
