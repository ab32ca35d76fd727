"""What a search for an HW-PWL model works on: data in normalised units, a point in parameter space, normal equations.

J'J is summed at chosen samples spread evenly with jitter: with millions of samples a fraction of them determines eighty
parameters. Every segment of data has its own initial state, estimated along.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thrustd.identify import hw_kernel as kernel
from thrustd.identify.hw_theta import Layout, column_map, mode_table, power_table, starting_state
from thrustd.model.stage import Floats

COLOUR_BLOCKS = 100  # blocks whose means show how coloured the residual is
LONGEST_LAG = 64  # samples between two rows before decays are applied in between: 1 / a^64 must not overflow

Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Signal:
    """One segment in normalised units, and the samples that count."""

    u: Floats
    y: Floats
    dt_s: float
    chosen: Ints


@dataclass(frozen=True, slots=True)
class Point:
    """Where the search stands. starts (n_segments, width): initial deviations from rest. pins: the two knots of f whose
    heights stay and so fix the unit of w; its ends, unless f comes back to where it began."""

    layout: Layout
    theta: Floats
    starts: Floats
    pins: tuple[int, int] = (0, -1)


@dataclass(frozen=True, slots=True)
class Normal:
    """Normal equations: J'J and J'r over (theta, starts), sum of squares, rows."""

    matrix: Floats
    gradient: Floats
    squares: float
    rows: int


def choose_samples(y: Floats, stride: int, seed: int = 0) -> Ints:
    """One sample of every `stride` at a random place, so that nothing periodic is missed; only finite ones."""
    groups = np.arange(0, len(y) - stride + 1, stride)
    jitter = np.random.default_rng(seed).integers(0, stride, len(groups)) if stride > 1 else 0
    chosen = (groups + jitter).astype(np.int64)
    return chosen[np.isfinite(y[chosen])]


def simulate(point: Point, i: int, signal: Signal) -> Floats:
    """Output (n,) of segment i."""
    layout, theta = point.layout, point.theta
    table = mode_table(layout, theta, signal.dt_s)
    fx, fy = theta[layout.fx], theta[layout.fy]
    j = kernel.segment_at(fx, 0, signal.u[0])
    w0 = fy[j] + (fy[j + 1] - fy[j]) / (fx[j + 1] - fx[j]) * (signal.u[0] - fx[j])
    state = starting_state(layout, point.starts[i])
    state[kernel.R] += (np.array([[1.0], [0.0]]) - table[kernel.B1]) * w0
    out = np.empty(len(signal.u))
    hx, hy = theta[layout.hx], theta[layout.hy]
    kernel.simulate_block(signal.u, fx, fy, table, layout.n_real, theta[layout.c], hx, hy, state, out)
    return out


def residual_of(point: Point, i: int, signal: Signal) -> Floats:
    """Residual of segment i at its chosen samples."""
    return (signal.y - simulate(point, i, signal))[signal.chosen]


def residuals_of(point: Point, signals: Sequence[Signal]) -> Floats:
    """Residuals of all segments at their chosen samples, one after the other."""
    parts = [residual_of(point, i, signal) for i, signal in enumerate(signals) if len(signal.chosen)]
    return np.concatenate([np.empty(0), *parts])


def squares(residual: Floats) -> float:
    """Sum of squares; infinite when it is not a number."""
    total = float(residual @ residual)
    return total if np.isfinite(total) else float("inf")


def slow_variance(residual: Floats) -> float:
    """Variance of the residual as a white sequence of the same low-frequency power would have it.

    A residual that stays for minutes counts once and not thousands of times: block length times the variance of block
    means, for white noise the variance itself. Priors are weighed against this.
    """
    length = max(1, len(residual) // COLOUR_BLOCKS)
    means = residual[: len(residual) // length * length].reshape(-1, length).mean(axis=1)
    return float(max(np.mean(residual**2), length * np.mean(means**2)))


def normal_equations(point: Point, signals: Sequence[Signal]) -> Normal:
    """Pass over all data with the exact gradient."""
    layout, n = point.layout, point.layout.size
    columns = column_map(layout, point.theta)
    size = n + layout.width * len(signals)
    matrix, gradient, total, count = np.zeros((size, size)), np.zeros(size), 0.0, 0
    for i, signal in enumerate(signals):
        sums, part = _segment_sums(point, i, signal)
        at = np.concatenate((np.arange(n), n + layout.width * i + np.arange(layout.width)))
        gradient[at] += columns.T @ sums[-1]
        matrix[np.ix_(at, at)] += columns.T @ _mirrored(sums[:-1]) @ columns
        total += part
        count += len(signal.chosen)
    return Normal(matrix, gradient, total, count)


def _segment_sums(point: Point, i: int, signal: Signal) -> tuple[Floats, float]:
    layout, theta = point.layout, point.theta
    table = mode_table(layout, theta, signal.dt_s)
    n = 2 * (layout.n_f - 1) + 3 * layout.width + 1 + 2 * (layout.n_h - 1)
    sums = np.zeros((n + 1, n))
    total = kernel.normal_pass(
        signal.u,
        signal.y,
        signal.chosen,
        theta[layout.fx],
        theta[layout.fy],
        table,
        power_table(table, LONGEST_LAG),
        layout.n_real,
        theta[layout.c],
        theta[layout.hx],
        theta[layout.hy],
        starting_state(layout, point.starts[i]),
        sums,
    )
    return sums, total


def _mirrored(sums: Floats) -> Floats:
    """The symmetric matrix of which each pair of elements was summed on one side only (the other is zero)."""
    return sums + sums.T - np.diag(np.diag(sums))
