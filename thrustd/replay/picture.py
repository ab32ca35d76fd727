"""The picture of a flight, per engine: thrust and both sources, how far they are off, and the same near zero.

Off the truth where one is known, as in a simulated flight; else both sources off the fused thrust.
"""

from collections.abc import Mapping
from math import isfinite, nan
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from thrustd.core.columns import Flags, Floats
from thrustd.core.measures import SIGMAS_95
from thrustd.core.types import Estimate, Status
from thrustd.sinks.whole_file import whole_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MAX_POINTS = 4000  # per engine: more than a picture has columns
# Okabe & Ito: safe for colour-blind readers
BLUE, SKY, ORANGE, GREEN, GREY = "#0072b2", "#56b4e9", "#e69f00", "#007a59", "#555555"
COLOURS = {"fused": SKY, "mount": GREEN, "brochure": ORANGE}
WIDTHS = {"fused": 2.8, "mount": 0.9, "brochure": 0.9}  # a source that agrees is seen on the fused line
WASHES = (  # behind the lines while the status says so
    (Status.MOUNT_LOST | Status.MOUNT_FAILED, GREEN, "mount source lost or excluded"),
    (Status.BROCHURE_LOST | Status.BROCHURE_FAILED, ORANGE, "brochure source lost or excluded"),
    (Status.ONE_MOUNT, GREY, "thrust of one mount alone"),
)
BEYOND = "beyond the axis"
THRUST, OFF, NEAR = range(3)  # rows
PLACES = 100  # of such marks along the time axis, at most
Limits = tuple[float, float]


class Point(NamedTuple):
    t_s: float
    thrust_n: float
    std_n: float
    mount_n: float
    brochure_n: float
    status: int
    truth_n: float


class Track:
    """Every k-th estimate of one engine; k doubles when there are too many, so memory stays flat."""

    def __init__(self) -> None:
        self.points: list[Point] = []
        self._stride = 1
        self._seen = 0

    def add(self, point: Point) -> None:
        if self._seen % self._stride == 0:
            self.points.append(point)
            if len(self.points) > MAX_POINTS:
                self.points = self.points[::2]
                self._stride *= 2
        self._seen += 1


class FlightPicture:
    """Collects estimates, engine by engine, and draws them."""

    def __init__(self) -> None:
        self.tracks: dict[str, Track] = {}
        self._start_ns = -1

    def take(self, name: str, e: Estimate, truth_n: float = nan) -> None:
        """One estimate of the engine called `name` and the truth at its time."""
        if name not in self.tracks and not (isfinite(e.mount_n) or isfinite(e.brochure_n)):
            return  # before a source has spoken nobody knows anything
        if self._start_ns < 0:
            self._start_ns = e.t_ns
        t_s = (e.t_ns - self._start_ns) * 1e-9
        track = self.tracks.setdefault(name, Track())
        track.add(Point(t_s, e.thrust_n, e.thrust_std_n, e.mount_n, e.brochure_n, e.status, truth_n))

    def save(self, path: Path, title: str, largest_n: Mapping[str, Mapping[str, float]]) -> None:
        """PNG of `figure`."""
        with whole_file(path) as part:
            self.figure(title, largest_n).savefig(part, dpi=110, format="png")

    def figure(self, title: str, largest_n: Mapping[str, Mapping[str, float]]) -> "Figure":
        """Three rows, one column per engine; `largest_n`: by engine and source, of the differences."""
        from matplotlib.figure import Figure  # takes a second

        curves = {name: Curves.of(track.points) for name, track in self.tracks.items()}
        n = max(len(curves), 1)
        figure = Figure(figsize=(8 * n, 10.5), layout="constrained")
        axes = figure.subplots(3, n, sharex="col", sharey="row", squeeze=False, height_ratios=(3, 2, 2))
        limits = [_limits([c.reach(row) for c in curves.values()]) for row in range(3)]
        for column, (name, c) in zip(axes.T, curves.items(), strict=False):
            for row, axis in enumerate(column):
                c.draw(axis, row, limits[row])
            column[THRUST].set_title(f"{name} engine", loc="left")
            said_n = largest_n.get(name, {})
            largest = ", ".join(f"{source} {said_n[source]:.0f} N" for source in COLOURS if source in said_n)
            column[OFF].set_title(f"{c.difference}; largest: {largest or 'none'}", loc="left", fontsize=10, pad=8)
            column[NEAR].set_title("the same without the brochure", loc="left", fontsize=10, pad=8)
            column[NEAR].set_xlabel("time, s")
        axes[THRUST, 0].set_ylabel("net thrust, N (forward +)")
        axes[OFF, 0].set_ylabel("difference, N")
        axes[NEAR, 0].set_ylabel("difference, N")
        shown = [axis.get_legend_handles_labels() for axis in axes.flat]
        named = {label: handle for handles, labels in shown for handle, label in zip(handles, labels, strict=True)}
        figure.legend(named.values(), named, loc="outside lower left", ncols=5, fontsize=9)
        figure.suptitle(title, x=0.01, ha="left", fontsize=12)
        return figure


class Curves(NamedTuple):
    """What is drawn of one engine, each (n,)."""

    t_s: Floats
    sources: dict[str, Floats]  # N, fused first
    band_n: Floats
    status: Floats
    truth_n: Floats

    @classmethod
    def of(cls, points: list[Point]) -> "Curves":
        t_s, fused, std, mount, brochure, status, truth = np.array(points, float).reshape(-1, len(Point._fields)).T
        return cls(t_s, {"fused": fused, "mount": mount, "brochure": brochure}, SIGMAS_95 * std, status, truth)

    @property
    def judged(self) -> bool:
        """A truth is known."""
        return bool(np.isfinite(self.truth_n).any())

    @property
    def difference(self) -> str:
        return "estimate minus truth" if self.judged else "source minus fused (no truth is known)"

    def differences(self) -> dict[str, Floats]:
        zero = self.truth_n if self.judged else self.sources["fused"]
        return {name: line - zero for name, line in self.sources.items() if self.judged or name != "fused"}

    def lines(self, row: int) -> dict[str, Floats]:
        """What a row shows, by source."""
        lines = self.sources if row == THRUST else self.differences()
        return {name: line for name, line in lines.items() if row != NEAR or name != "brochure"}

    def reach(self, row: int) -> Limits:
        """Of its axis: all of fused and truth, all but spikes of the rest; of differences the start left out."""
        if row == THRUST:
            trimmed = [_trimmed(line, 0.2) for line in self.sources.values()]
            shown = np.concatenate((self.sources["fused"], self.truth_n, *trimmed))
            return float(np.nanmin(shown)), float(np.nanmax(shown))
        settled = self.t_s > self.t_s[0] + 0.02 * (self.t_s[-1] - self.t_s[0])
        lines = [abs(line[settled]) for line in (*self.lines(row).values(), self.band_n)]
        most = max((float(_trimmed(line, 2.0)[1]) for line in lines), default=1.0)
        return -1.4 * most, 1.4 * most

    def draw(self, axis: "Axes", row: int, limits: Limits) -> None:
        """One row; what its axis cuts off gets a mark."""
        middle = self.sources["fused"] if row == THRUST else 0.0
        axis.fill_between(
            self.t_s, middle - self.band_n, middle + self.band_n, color=BLUE, alpha=0.25, lw=0,
            label="95 % band of fused (of differences: around zero)",
        )  # fmt: skip
        for name, line in self.lines(row).items():
            colour, label = COLOURS[name], name if name == "fused" else f"{name} source"
            axis.plot(self.t_s, line, color=colour, lw=WIDTHS[name], label=label)
            _mark_beyond(axis, self.t_s, line, limits, colour, 4.0 + WIDTHS[name])
        axis.set_ylim(*limits)
        axis.grid(alpha=0.3, lw=0.5)
        axis.margins(x=0)
        for bits, colour, label in WASHES:
            _wash(axis, self.t_s, (self.status.astype(int) & int(bits)) != 0, colour, label)
        if row != THRUST:
            axis.axhline(0.0, color="black", lw=0.5)
        elif self.judged:
            axis.plot(self.t_s, self.truth_n, color="black", lw=0.9, ls=(0, (4, 8)), label="truth")


def _trimmed(line: Floats, pct: float) -> Floats:
    """Lowest and highest (2,) without the outermost `pct` per cent on either side; nothing known: zeros."""
    known = line[np.isfinite(line)]
    return np.percentile(known, (pct, 100.0 - pct)) if len(known) else np.zeros(2)


def _limits(of_engines: list[Limits]) -> Limits:
    """The same for all engines, with some air."""
    low, high = min((low for low, _ in of_engines), default=0.0), max((high for _, high in of_engines), default=1.0)
    air = 0.08 * (high - low) or 1.0
    return low - air, high + air


def _mark_beyond(axis: "Axes", t_s: Floats, line: Floats, limits: Limits, colour: str, size: float) -> None:
    """A triangle on the edge of the axis wherever the line is beyond it."""
    width = (t_s[-1] - t_s[0]) / PLACES or 1.0
    for beyond, edge, mark in ((line < limits[0], limits[0], "v"), (line > limits[1], limits[1], "^")):
        at = t_s[0] + width * np.unique(np.round((t_s[beyond] - t_s[0]) / width))
        if len(at):
            axis.plot(at, np.full(len(at), edge), mark, color=colour, ms=size, clip_on=False, zorder=5)
            axis.plot([], [], "^", color=GREY, mfc="none", ms=6, label=BEYOND)


def _wash(axis: "Axes", t_s: Floats, on: Flags, colour: str, label: str) -> None:
    shortest_s = 1e-3 * (t_s[-1] - t_s[0])  # less is no column of the picture
    edges = np.flatnonzero(np.diff(np.concatenate(([0], on.astype(int), [0]))))
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        begin_s, end_s = t_s[begin], t_s[min(end, len(t_s) - 1)]
        if end_s - begin_s > shortest_s:
            axis.axvspan(begin_s, end_s, color=colour, alpha=0.12, lw=0, label=label)
