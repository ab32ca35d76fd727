"""Levenberg-Marquardt for HW-PWL models on streamed normal equations.

J'J is summed at chosen samples spread evenly with jitter: with millions of samples a fraction of
them determines eighty parameters. Every segment of data has its own initial state, estimated along. Weak priors keep
knots straight where there is no data, and initial states near rest; they weigh as much as a few samples.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from thrustd.identify import hw_kernel as kernel
from thrustd.identify.hw_theta import Layout, column_map, mode_table, power_table, starting_state
from thrustd.model.stage import Floats

BEND_STD = 0.02  # prior: a knot lies this near to the line of its neighbours, in units of the output's range
REST_STD = 0.1  # prior: initial states lie this near to rest, in units of the input's range
COLOUR_BLOCKS = 100  # blocks whose means show how coloured the residual is
LONGEST_LAG = 64  # samples between two rows before decays are applied in between: 1 / a^64 must not overflow
GAIN_STD = 1.0  # prior: a mode's gain, in units of the DC gain; keeps modes from cancelling each other
KNOT_REACH = 0.45  # a knot moves at most so far towards its neighbour in one step
CLOSEST = 1e-4  # two knots come no nearer, in units of the curve's range
STALL = 1e-5  # relative fall of the cost over one iteration that ends the search

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
    """Where the search stands. starts (n_segments, width): initial deviations from rest."""

    layout: Layout
    theta: Floats
    starts: Floats


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


def squares(point: Point, signals: Sequence[Signal]) -> float:
    """Sum of squared residuals at the chosen samples."""
    total = 0.0
    for i, signal in enumerate(signals):
        residual = residual_of(point, i, signal)
        total += float(residual @ residual)
    return total if np.isfinite(total) else float("inf")


def slow_variance(point: Point, signals: Sequence[Signal]) -> float:
    """Variance of the residual as a white sequence of the same low-frequency power would have it.

    A residual that stays for minutes counts once and not thousands of times: block length times the variance of block
    means, for white noise the variance itself. Priors are weighed against this.
    """
    residual = np.concatenate([residual_of(point, i, signal) for i, signal in enumerate(signals)])
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
        gradient[at] += sums[-1] @ columns
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


def bend_rows(layout: Layout, theta: Floats) -> Floats:
    """Rows (n_inner, size) whose product with theta is each inner knot's distance from the line of its neighbours."""
    rows = []
    for y_part, x_part in ((layout.fy, layout.fx), (layout.hy, layout.hx)):
        x = theta[x_part]
        for j in range(1, len(x) - 1):
            t = (x[j] - x[j - 1]) / (x[j + 1] - x[j - 1])
            row = np.zeros(layout.size)
            row[y_part.start + j - 1 : y_part.start + j + 2] = t - 1, 1, -t
            rows.append(row)
    return np.array(rows).reshape(-1, layout.size)


def with_priors(point: Point, normal: Normal, variance: float) -> tuple[Normal, float]:
    """Add the weak priors, against the residual's variance; returns the normal equations and the priors' cost."""
    rows, distance = _prior_rows(point)
    matrix = normal.matrix + variance * rows.T @ rows
    gradient = normal.gradient - variance * rows.T @ distance
    return Normal(matrix, gradient, normal.squares, normal.rows), variance * float(distance @ distance)


def _prior_rows(point: Point) -> tuple[Floats, Floats]:
    """Rows (n_priors, n_columns) and values, in units of one sigma of the prior: bends, gains, initial states."""
    layout, n = point.layout, point.layout.size
    bends = bend_rows(layout, point.theta) / BEND_STD
    rows = np.zeros((len(bends) + layout.width + point.starts.size, n + point.starts.size))
    rows[: len(bends), :n] = bends
    gains = len(bends) + np.arange(layout.width)
    rows[gains, layout.gains.start + np.arange(layout.width)] = 1 / GAIN_STD
    starts = np.arange(point.starts.size)
    rows[len(bends) + layout.width + starts, n + starts] = 1 / REST_STD
    return rows, rows @ np.concatenate((point.theta, point.starts.ravel()))


def free_columns(layout: Layout, n_starts: int, pin_c: bool = True) -> NDArray[np.bool_]:
    """All but the knots that fix the units inside: both ends of f, the x of h's ends, and c."""
    free = np.ones(layout.size + n_starts, bool)
    for at in (0, -1):
        for part in (layout.fy, layout.fx, layout.hx):
            free[np.arange(layout.size)[part][at]] = False
    free[layout.c] = not pin_c
    return free


def moved(point: Point, step: Floats, limits: tuple[float, float]) -> Point:
    """The point after a step; knots keep their order, time constants stay within `limits` (s)."""
    layout, n = point.layout, point.layout.size
    theta = point.theta + step[:n]
    for part in (layout.fx, layout.hx):
        old = point.theta[part]
        gap = np.maximum(0.0, np.diff(old) - CLOSEST * (old[-1] - old[0])) * KNOT_REACH
        theta[part][1:-1] = np.clip(theta[part][1:-1], old[1:-1] - gap[:-1], old[1:-1] + gap[1:])
    poles = theta[layout.poles]
    poles[: layout.n_real] = np.clip(poles[: layout.n_real], *np.log(limits))
    poles[layout.n_real :] = np.clip(poles[layout.n_real :], -np.log(limits[1]), -np.log(limits[0]))
    return replace(point, theta=theta, starts=point.starts + step[n:].reshape(point.starts.shape))


def damped_step(normal: Normal, directions: Floats, damping: float) -> Floats:
    """Minimise along the directions (n_columns, n_free): (D'MD + damping diag) step = D'g."""
    matrix, gradient = directions.T @ normal.matrix @ directions, normal.gradient @ directions
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-12 * max(1e-300, float(np.max(np.diag(matrix))))))
    scaled = matrix / np.outer(size, size)
    scaled[np.diag_indices_from(scaled)] += damping
    step: Floats = directions @ (np.linalg.lstsq(scaled, gradient / size, rcond=1e-14)[0] / size)
    return step


def search(
    point: Point,
    signals: Sequence[Signal],
    limits: tuple[float, float],
    iterations: int,
    stall: float = STALL,
    progress: Callable[[float], None] | None = None,
    directions: Floats | None = None,
) -> tuple[Point, float]:
    """Minimise from a point; returns where it ends and the mean squared residual there.

    directions (n_columns, n_free) restrict where it may go; None: everything but what fixes the units.
    """
    if directions is None:
        free = free_columns(point.layout, point.starts.size)
        directions = np.eye(len(free))[:, free]
    damping, cost = 1e-3, np.inf
    for _ in range(iterations):
        variance = slow_variance(point, signals)
        normal, prior = with_priors(point, normal_equations(point, signals), variance)
        before = normal.squares + prior
        if not np.isfinite(normal.matrix).all():
            break
        for _ in range(6):
            trial = moved(point, damped_step(normal, directions, damping), limits)
            cost = squares(trial, signals) + _prior_cost(trial, variance)
            if cost < before:
                point, damping = trial, max(damping / 10, 1e-9)
                break
            damping *= 10
        if progress is not None:
            progress(float(np.sqrt(min(cost, before) / max(1, normal.rows))))
        if before - cost <= stall * before:
            break
    return point, min(cost, before) / max(1, normal.rows)


def _prior_cost(point: Point, variance: float) -> float:
    _, distance = _prior_rows(point)
    return variance * float(distance @ distance)
