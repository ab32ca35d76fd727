"""The picture of a flight: thrust with its band and both routes above, error against the truth below, per engine."""

from math import isfinite, nan
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

from thrustd.flight_score import BAND_SIGMAS
from thrustd.types import Estimate, Status

MAX_POINTS = 4000  # per engine: more than a picture has columns
NAMED = Status.MOUNT_FAILED | Status.BROCHURE_FAILED | Status.MOUNT_LOST | Status.BROCHURE_LOST


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
        if self._start_ns < 0:
            self._start_ns = e.t_ns
        t_s = (e.t_ns - self._start_ns) * 1e-9
        track = self.tracks.setdefault(name, Track())
        track.add(Point(t_s, e.thrust_n, e.thrust_std_n, e.mount_n, e.brochure_n, e.status, truth_n))

    def save(self, path: Path, title: str) -> None:
        """PNG, two rows, one column per engine."""
        import matplotlib

        matplotlib.use("Agg")
        import matplotlib.pyplot as plt

        n = max(len(self.tracks), 1)
        figure, axes = plt.subplots(
            2,
            n,
            figsize=(8 * n, 8),
            sharex="col",
            sharey="row",
            squeeze=False,
            height_ratios=(3, 2),
            layout="constrained",
        )
        for column, (name, track) in enumerate(self.tracks.items()):
            _draw(axes[0, column], axes[1, column], np.array(track.points, float).reshape(-1, len(Point._fields)))
            axes[0, column].set_title(f"{name} engine", loc="left")
            axes[1, column].set_xlabel("time, s")
        axes[0, 0].set_ylabel("net thrust, N (forward +)")
        axes[1, 0].set_ylabel("estimate minus truth, N")
        axes[0, 0].legend(loc="upper right", ncols=2, fontsize=9)
        figure.suptitle(title, x=0.01, ha="left", fontsize=12)
        figure.savefig(path, dpi=110)
        plt.close(figure)


BLUE, ORANGE, GREEN, GREY = "#0072b2", "#e69f00", "#009e73", "#555555"  # Okabe & Ito: safe for colour-blind readers


def _draw(above: "Axes", below: "Axes", p: NDArray[np.float64]) -> None:
    t, thrust, std, mount, brochure, status, truth = p.T
    band = BAND_SIGMAS * std
    above.plot(t, brochure, color=ORANGE, lw=0.8, label="brochure route")
    above.plot(t, mount, color=GREEN, lw=0.8, label="mount route")
    above.fill_between(t, thrust - band, thrust + band, color=BLUE, alpha=0.25, lw=0, label="95 % band")
    above.plot(t, thrust, color=BLUE, lw=1.2, label="fused")
    known = np.isfinite(truth)
    if known.any():
        above.plot(t, truth, color="black", lw=0.8, ls="--", label="truth")
        below.fill_between(t, -band, band, color=BLUE, alpha=0.25, lw=0)
        below.plot(t, brochure - truth, color=ORANGE, lw=0.7)
        below.plot(t, mount - truth, color=GREEN, lw=0.7)
        below.plot(t, thrust - truth, color=BLUE, lw=1.0)
        settled = known & (t > t[0] + 0.02 * (t[-1] - t[0]))
        spread = np.nanpercentile(np.abs(np.concatenate(((brochure - truth)[settled], band[settled]))), 98)
        if isfinite(spread):
            below.set_ylim(-1.6 * spread, 1.6 * spread)
    shown = np.concatenate((thrust, truth[known]))
    reach = float(np.ptp(shown)) or 1.0
    above.set_ylim(shown.min() - 0.08 * reach, shown.max() + 0.12 * reach)
    for axis in (above, below):
        axis.grid(alpha=0.3, lw=0.5)
        axis.margins(x=0)
        _mark_failed(axis, t, status)


def _mark_failed(axis: "Axes", t: NDArray[np.float64], status: NDArray[np.float64]) -> None:
    failed = (status.astype(int) & int(NAMED)) != 0
    edges = np.flatnonzero(np.diff(np.concatenate(([0], failed.astype(int), [0]))))
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        axis.axvspan(t[begin], t[min(end, len(t) - 1)], color=GREY, alpha=0.12, lw=0)
