"""Columns on another, uniform time axis: means of the bins going down, straight lines going up, no invented values."""

import numpy as np

from thrustd.core.columns import Flags, Floats

GAP_FACTOR = 1.5  # a step longer than this many usual steps is a gap


class Grid:
    """From rows at time_s (n,) to points at grid_s (m,)."""

    def __init__(self, time_s: Floats, grid_s: Floats, rate_hz: float, longest_s: float | None) -> None:
        """longest_s: no value inside a longer step of time; None: see `Recording.resample`."""
        steps_s = np.diff(time_s)
        self._time_s, self._grid_s, self._edges = time_s, grid_s, np.zeros(0, np.intp)
        if len(steps_s) and rate_hz * float(np.median(steps_s)) < 1.0 / GAP_FACTOR:
            self._edges = np.searchsorted(time_s, np.append(grid_s, grid_s[-1] + 1.0 / rate_hz) - 0.5 / rate_hz)
        if longest_s is None:
            longest_s = GAP_FACTOR * max(1.0 / rate_hz, float(np.quantile(steps_s, 0.9)) if len(steps_s) else 0.0)
        before = np.clip(np.searchsorted(time_s, grid_s, side="right") - 1, 0, None)
        self._gap = (np.append(steps_s, 0.0)[before] > longest_s) & (grid_s > time_s[before])

    @property
    def step_share(self) -> float:
        """Of the variance that white noise of the rows has here, the share that half the square of its steps shows.

        1 where rows or means of them stand side by side. Lines between two rows share rows with their neighbours.
        """
        if len(self._edges) or len(self._time_s) < 2:
            return 1.0
        row = np.clip(np.searchsorted(self._time_s, self._grid_s, side="right") - 1, 0, len(self._time_s) - 2)
        later = np.clip((self._grid_s - self._time_s[row]) / np.diff(self._time_s)[row], 0.0, 1.0)
        earlier, on = 1.0 - later, np.diff(row)
        shared = np.where(on == 0, earlier[1:] * earlier[:-1] + later[1:] * later[:-1], 0.0)
        shared = np.where(on == 1, later[:-1] * earlier[1:], shared)
        return 1.0 - float(shared.sum() / (earlier**2 + later**2).sum())

    def __call__(self, column: Floats) -> Floats:
        """(m,) of a column (n,)."""
        good = np.isfinite(column)
        if not good.any():
            return np.full(len(self._grid_s), np.nan)
        near = np.interp(self._grid_s, self._time_s, _measured(good).astype(np.float64)) >= 0.5
        line = np.interp(self._grid_s, self._time_s[good], column[good])
        line = np.where(near & ~self._gap, line, np.nan)
        if not len(self._edges):
            return line
        total, number = (np.concatenate(([0.0], np.cumsum(part))) for part in (np.where(good, column, 0.0), good))
        inside = np.diff(number[self._edges])
        mean: Floats = np.diff(total[self._edges]) / np.maximum(inside, 1.0)
        return np.where(inside > 0, mean, line)


def _measured(good: Flags) -> Flags:
    """Rows (n,) with a value, and those between two values that follow one another as usual in a slower column."""
    rows = np.flatnonzero(good)
    steps = np.diff(rows)
    if len(rows) in (1, len(good)) or np.median(steps) == 1.0:
        return good
    edges = np.zeros(len(good) + 1)
    usual = steps <= GAP_FACTOR * np.median(steps)
    edges[rows[:-1][usual]] += 1.0
    edges[rows[1:][usual]] -= 1.0
    return np.asarray(good | (np.cumsum(edges[:-1]) > 0.0))
