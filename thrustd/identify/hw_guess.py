"""Further starting points with free knots, for systems that no cubic between straight lines comes near.

straight      f and h straight: knots move to where the data bend the curves, play and jumps included
static        no dynamics, h what the output is on average at that input: finds even curves, dead zones, steps
hammerstein   f from linear least squares (Bai, Automatica 34(3), 1998): y on the hat functions of u, each passed
              through every mode, gives a matrix of products of f's heights and the modes' gains; its leading singular
              vectors are both. f may come back to where it began, so its unit is fixed at its lowest and highest knot.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from thrustd.identify import hw_kernel as kernel
from thrustd.identify.hw_problem import Point, Signal
from thrustd.identify.hw_shapes import Shape
from thrustd.identify.hw_start import linear_fit, spaced_knots
from thrustd.identify.hw_theta import mode_table
from thrustd.identify.linear_start import spread
from thrustd.model.stage import Floats

RIDGE = 1e-5
LONGEST = 30.0  # of the longest segment: slowest mode in the least squares
HATS = 9  # knots of f in the least squares
ROWS = 20_000


def guesses(point: Point, shapes: tuple[Shape, Shape], signals: Sequence[Signal]) -> list[Point]:
    """Those which these shapes allow; point: layout and poles to start from."""
    found: list[Point | None] = [straight(point, signals)]
    if shapes[1] == "pwl":
        found.append(static(point, signals))
    if shapes[0] == "pwl":
        found.append(hammerstein(point, signals))
    return [guess for guess in found if guess is not None]


def straight(point: Point, signals: Sequence[Signal]) -> Point:
    """Poles as they are, gains by least squares, both curves straight."""
    layout, theta = point.layout, point.theta.copy()
    theta[layout.fy] = theta[layout.fx]
    theta[layout.gains] = 0.0
    theta[layout.c] = 1.0
    theta[layout.hx] = theta[layout.hy] = np.linspace(-0.1, 1.1, layout.n_h)
    return linear_fit(replace(point, theta=theta, starts=np.zeros_like(point.starts)), list(signals))


def static(point: Point, signals: Sequence[Signal]) -> Point:
    """No dynamics yet: h is the mean of the output at every input."""
    layout, theta = point.layout, point.theta.copy()
    u = np.concatenate([signal.u[signal.chosen] for signal in signals])
    y = np.concatenate([signal.y[signal.chosen] for signal in signals])
    theta[layout.fy] = theta[layout.fx]
    theta[layout.gains] = 0.0
    theta[layout.c] = 1.0
    theta[layout.hx] = spaced_knots(u, layout.n_h)
    theta[layout.hy] = _heights(hats(u, theta[layout.hx]), y)
    return replace(point, theta=theta, starts=np.zeros_like(point.starts))


def hammerstein(point: Point, signals: Sequence[Signal]) -> Point | None:
    """f from linear least squares, gains along; None where the data do not show any."""
    layout = point.layout
    if layout.n_complex or not layout.n_real:
        return None
    point = replace(point, theta=point.theta.copy())
    longest_s = max(len(signal.u) * signal.dt_s for signal in signals)
    poles = spread(layout.n_real, 2 * signals[0].dt_s, longest_s / LONGEST)
    point.theta[layout.poles] = np.log(poles.tau_s)
    knots = np.linspace(0.0, 1.0, HATS)
    blocks, targets = zip(*(_filtered_hats(point, signal, knots) for signal in signals), strict=True)
    table, y = np.concatenate(blocks), np.concatenate(targets)
    size = table.reshape(len(table), HATS, -1).std(axis=0).mean(axis=0) + 1e-9  # of what comes through each mode
    found = _heights(np.column_stack((table, np.ones(len(table)))), y)[:-1].reshape(HATS, -1)
    f, strength, gains = np.linalg.svd(found * size, full_matrices=False)
    height = float(np.ptp(f[:, 0]))
    if not height > 0:
        return None
    weights = gains[0] / size * strength[0] * height
    return _with_curve(point, signals, knots, (f[:, 0] - f[:, 0].min()) / height, weights)


def _with_curve(point: Point, signals: Sequence[Signal], knots: Floats, f: Floats, weights: Floats) -> Point | None:
    """weights (n_real + 1,): of the modes and of what passes directly, output per unit of w."""
    layout, theta = point.layout, point.theta.copy()
    theta[layout.fy] = np.interp(theta[layout.fx], knots, f)
    low, high = int(np.argmin(theta[layout.fy])), int(np.argmax(theta[layout.fy]))
    slope = float(weights.sum())
    if abs(slope) < 0.05 * float(np.abs(weights).max()) or low == high:
        return None
    theta[layout.gains] = weights[:-1] / slope
    theta[layout.c] = 1.0
    w = np.concatenate([np.interp(signal.u, theta[layout.fx], theta[layout.fy]) for signal in signals])
    y = np.concatenate([signal.y[signal.chosen] for signal in signals])
    span = np.linspace(w.min() - 0.3, w.max() + 0.3, layout.n_h)
    theta[layout.hx], theta[layout.hy] = span, slope * (span - float(w.mean())) + float(y.mean())
    return replace(point, theta=theta, starts=np.zeros_like(point.starts), pins=(low, high))


def _filtered_hats(point: Point, signal: Signal, knots: Floats) -> tuple[Floats, Floats]:
    """Columns (n_rows, HATS x (n_real + 1)): every hat through every mode, and directly."""
    table = mode_table(point.layout, point.theta, signal.dt_s)
    rows = signal.chosen[:: max(1, len(signal.chosen) // ROWS)]
    columns = np.empty((len(rows), HATS, point.layout.n_real + 1))
    for i, hat in enumerate(hats(signal.u, knots).T):
        for q in range(point.layout.n_real):
            a, b1 = table[kernel.A, 0, q], table[kernel.B1, 0, q]
            b0 = table[kernel.BETA, 0, q] - a * b1
            start = [hat[0] * (1.0 - b1)]
            columns[:, i, q] = lfilter([b1, b0], [1.0, -a], hat, zi=start)[0][rows]
        columns[:, i, -1] = hat[rows]
    return columns.reshape(len(rows), -1), signal.y[rows]


def hats(v: Floats, knots: Floats) -> Floats:
    """Hat functions of v, (n, n_knots); constant beyond the ends."""
    at = np.clip(np.searchsorted(knots, v, side="right") - 1, 0, len(knots) - 2)
    t = np.clip((v - knots[at]) / np.diff(knots)[at], 0.0, 1.0)
    table = np.zeros((len(v), len(knots)))
    rows = np.arange(len(v))
    table[rows, at] = 1.0 - t
    table[rows, at + 1] += t
    return table


def _heights(table: Floats, y: Floats) -> Floats:
    """Least squares with a ridge in units of the columns' size."""
    matrix = table.T @ table
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-12 * len(table)))
    scaled = matrix / np.outer(scale, scale) + RIDGE * np.eye(len(scale))
    found: Floats = np.linalg.solve(scaled, (table.T @ y) / scale) / scale
    return found
