"""Where a search for an HW-PWL model starts: poles, gains by least squares, and smooth curves.

Candidates for the poles are spread over the time scales of the data and, where these oscillate, taken from the best
linear model. Each is tried for a few iterations on part of the data, with cubics in place of piecewise-linear curves.
An even output curve hides its linear block from every linear model; `even_start` finds it in the products.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from thrustd.identify import even_start, linear_start
from thrustd.identify.hw_held_out import MIDDLE, folds_of, mean_square
from thrustd.identify.hw_prior import on_line
from thrustd.identify.hw_problem import Point, Signal, normal_equations, simulate
from thrustd.identify.hw_shapes import Shape, knots_of
from thrustd.identify.hw_theta import Layout
from thrustd.identify.linear_start import Poles
from thrustd.model.stage import Floats

HEAT = 3  # iterations of every starting point before the best go on
FINALISTS = 2
PAIRS_WORTH = 0.7  # error of poles that oscillate over that of real ones, from which on they are taken
TINY_GAIN = 1e-3
FEW = 100_000  # samples: the data are too short to show slow modes by themselves
UNEXPLAINED = 0.5  # of the output's variance: where more is left, an even output curve is looked for

Search = Callable[[Point, list[Signal], int], tuple[Point, float]]


def best_start(trial: Signal, order: int, shapes: tuple[Shape, Shape], search: Search) -> Point:
    """Try the candidates on one segment, its middle held back; the one that predicts it best.

    Poles that oscillate follow a slow residual closely where there is no oscillation, hence the middle held back.
    """
    (fold,) = folds_of([trial], (MIDDLE,))
    points = [starting_point(poles, trial, shapes) for poles in candidates(trial, order)]
    heated = [search(point, fold.train, HEAT) for point in points]
    if shapes[1] != "line" and min(error for _, error in heated) > UNEXPLAINED:
        heated += [search(point, fold.train, HEAT) for point in even_points(fold.train[0], trial, order, shapes)]
    finals = [heated[0], *sorted(heated[1:], key=lambda result: result[1])[: FINALISTS - 1]]
    ends = [search(point, fold.train, 3 * HEAT)[0] for point, _ in finals]
    return min(ends, key=lambda end: mean_square(end, fold.held) / (PAIRS_WORTH**2 if end.layout.n_complex else 1.0))


def candidates(signal: Signal, order: int) -> list[Poles]:
    """Starting poles for one segment."""
    dt_s, n = signal.dt_s, len(signal.u)
    spread = linear_start.spread(order, 2 * dt_s, max(4 * dt_s, n * dt_s / 8))
    good = np.isfinite(signal.y)
    y = np.interp(np.arange(n), np.flatnonzero(good), signal.y[good])
    found = linear_start.realised(signal.u - signal.u.mean(), y - y.mean(), dt_s, order)
    options = [spread]
    if len(found.pairs):
        options.append(linear_start.filled(found, order, spread.tau_s))
        options.append(linear_start.filled(Poles(np.empty(0), found.pairs), order, spread.tau_s))
    elif len(found.tau_s) and n < FEW:
        options.append(linear_start.filled(found, order, spread.tau_s))
    return options


def even_points(seen: Signal, trial: Signal, order: int, shapes: tuple[Shape, Shape]) -> list[Point]:
    """What lies behind an even output curve as if it had been measured, then h as a cubic of it; [] if there is none.

    seen: the samples that may be looked at.
    """
    hidden = even_start.before_even_curve(seen.u, seen.y, seen.chosen)
    if hidden is None:
        return []
    spare = linear_start.spread(order, 2 * trial.dt_s, max(4 * trial.dt_s, len(trial.u) * trial.dt_s / 8)).tau_s
    poles = linear_start.filled(linear_start.realised(seen.u - seen.u.mean(), hidden, seen.dt_s, order), order, spare)
    point = starting_point(poles, replace(seen, y=hidden), shapes)
    theta, layout = point.theta.copy(), point.layout
    x = before_output(point, [seen])
    theta[layout.hy] = np.polynomial.Polynomial.fit(x, seen.y[seen.chosen], 3)(theta[layout.hx])
    return [replace(point, theta=theta)]


def starting_point(poles: Poles, signal: Signal, shapes: tuple[Shape, Shape]) -> Point:
    """f = identity, gains by linear least squares for these poles, h = the straight line."""
    n_f, n_h = knots_of(shapes[0]), knots_of(shapes[1])
    layout = Layout(n_f, len(poles.tau_s), len(poles.pairs), n_h)
    theta = np.zeros(layout.size)
    theta[layout.fx] = spaced_knots(signal.u, n_f)
    theta[layout.fy] = theta[layout.fx]
    theta[layout.poles] = np.concatenate((np.log(poles.tau_s), np.log(poles.pairs).ravel()))
    theta[layout.c] = 1.0
    theta[layout.hx] = theta[layout.hy] = np.linspace(-0.1, 1.1, n_h)
    return linear_fit(Point(layout, theta, np.zeros((1, layout.width))), [signal])


def spaced_knots(v: Floats, n: int) -> Floats:
    """Half even, half quantile spacing over the range of v."""
    share = np.linspace(0, 1, n)
    knots: Floats = 0.5 * np.quantile(v, share) + 0.5 * (v.min() + np.ptp(v) * share)
    return knots


def linear_fit(point: Point, signals: list[Signal]) -> Point:
    """Gains and a straight h by least squares: y = offset + slope x, slope = DC gain unless that is tiny.

    With f and h identities the columns of gains and c are what the linear block puts out per unit of each.
    """
    layout = point.layout
    normal = normal_equations(point, signals)
    columns = np.concatenate((np.arange(layout.size)[layout.gains], [layout.c]))
    offset = np.zeros(normal.matrix.shape[0])
    offset[layout.hy] = 1.0  # all knots up together: a constant
    basis = np.zeros((normal.matrix.shape[0], len(columns) + 1))
    basis[columns, np.arange(len(columns))] = 1.0
    basis[:, -1] = offset
    matrix = basis.T @ normal.matrix @ basis
    right = basis.T @ (normal.gradient + normal.matrix @ basis[:, -2])  # residual of the model plus c w itself = y
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    scaled = matrix / np.outer(size, size) + 1e-6 * np.eye(len(size))
    found = np.linalg.solve(scaled, right / size) / size
    gain, level = found[-2], found[-1]
    biggest = float(np.max(np.abs(found[:-1])))
    slope = gain if abs(gain) > TINY_GAIN * biggest else float(np.copysign(biggest, gain or 1.0))
    theta = point.theta.copy()
    theta[layout.gains] = found[:-2] / slope
    theta[layout.c] = gain / slope
    return _fitted_output(replace(point, theta=theta), signals, slope, level)


def _fitted_output(point: Point, signals: list[Signal], slope: float, level: float) -> Point:
    """h as a straight line over the range that x takes."""
    layout, theta = point.layout, point.theta.copy()
    theta[layout.hx] = spaced_knots(before_output(point, signals), layout.n_h)
    theta[layout.hy] = level + slope * theta[layout.hx]
    return replace(point, theta=theta)


def before_output(point: Point, signals: Sequence[Signal]) -> Floats:
    """What enters h, at the samples that count."""
    layout, theta = point.layout, point.theta.copy()
    theta[layout.hx] = theta[layout.hy] = np.linspace(-1, 1, layout.n_h)
    straight = replace(point, theta=theta)
    return np.concatenate([simulate(straight, i, signal)[signal.chosen] for i, signal in enumerate(signals)])


def freed(point: Point, shapes: tuple[Shape, Shape], knots: tuple[int, int], signals: Sequence[Signal]) -> Point:
    """The same curves on new knots that may move, where the shape asks for them; n_f and n_h knots, ends included."""
    layout, theta = point.layout, point.theta
    n_f = knots[0] if shapes[0] == "pwl" else layout.n_f
    n_h = knots[1] if shapes[1] == "pwl" else layout.n_h
    w_like = np.concatenate([signal.u[signal.chosen] for signal in signals])
    new = Layout(n_f, layout.n_real, layout.n_complex, n_h)
    moved = np.zeros(new.size)
    moved[new.poles], moved[new.gains], moved[new.c] = theta[layout.poles], theta[layout.gains], theta[layout.c]
    moved[new.fx] = spaced_knots(w_like, n_f) if shapes[0] == "pwl" else theta[layout.fx]
    moved[new.fx][[0, -1]] = theta[layout.fx][[0, -1]]  # of all data, not only of the samples that count
    moved[new.hx] = spaced_knots(before_output(point, signals), n_h) if shapes[1] == "pwl" else theta[layout.hx]
    moved[new.fy] = on_line(moved[new.fx], theta[layout.fx], theta[layout.fy])
    moved[new.hy] = on_line(moved[new.hx], theta[layout.hx], theta[layout.hy])
    return replace(point, layout=new, theta=moved)
