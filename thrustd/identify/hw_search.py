"""Levenberg-Marquardt for HW-PWL models on streamed normal equations with weak priors (`hw_prior`)."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from thrustd.identify.hw_prior import LOOSE, Reins, free_columns, prior_cost, with_priors
from thrustd.identify.hw_problem import Normal, Point, Signal, normal_equations, residuals_of, slow_variance, squares
from thrustd.model.stage import Floats

KNOT_REACH = 0.45  # a knot moves at most so far towards its neighbour in one step
LAST = 0.02  # of the curve's range: an end segment is no shorter
LEAST_DAMPING = 1e-9  # keeps the equations solvable where the data say nothing
STALL = 1e-5  # relative fall of the cost over one iteration that ends the search


def moved(point: Point, step: Floats, limits: tuple[float, float], closest: float) -> Point:
    """The point after a step; knots keep their order and distance, time constants stay within `limits` (s)."""
    layout, n = point.layout, point.layout.size
    theta = point.theta + step[:n]
    for part in (layout.fx, layout.hx):
        old = point.theta[part]
        least = np.full(len(old) - 1, closest)
        least[[0, -1]] = np.maximum(closest, LAST)  # what is beyond the data continues the last segments
        gap = np.maximum(0.0, np.diff(old) - least * (old[-1] - old[0])) * KNOT_REACH
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
    step: Floats = directions @ (np.linalg.solve(scaled, gradient / size) / size)
    return step


def search(
    point: Point,
    signals: Sequence[Signal],
    limits: tuple[float, float],
    iterations: int,
    stall: float = STALL,
    progress: Callable[[float], None] | None = None,
    directions: Floats | None = None,
    reins: Reins = LOOSE,
) -> tuple[Point, float]:
    """Minimise from a point; returns where it ends and the mean squared residual (with priors) there.

    directions (n_columns, n_free) restrict where it may go; None: everything but what fixes the units.
    """
    if directions is None:
        free = free_columns(point)
        directions = np.eye(len(free))[:, free]
    damping, cost, before, rows = 1e-3, np.inf, np.inf, sum(len(signal.chosen) for signal in signals)
    residual = residuals_of(point, signals) if reins.variance is None else np.empty(0)
    for _ in range(iterations):
        variance = slow_variance(residual) if reins.variance is None else reins.variance
        normal, prior = with_priors(point, normal_equations(point, signals), variance, reins)
        before = normal.squares + prior
        if not np.isfinite(normal.matrix).all():
            break
        for _ in range(6):
            trial = moved(point, damped_step(normal, directions, damping), limits, reins.closest)
            missed = residuals_of(trial, signals)
            cost = squares(missed) + prior_cost(trial, variance, reins)
            if cost < before:
                point, residual, damping = trial, missed, max(damping / 10, LEAST_DAMPING)
                break
            damping *= 10
        if progress is not None:
            progress(float(np.sqrt(min(cost, before) / max(1, rows))))
        if before - cost <= stall * before:
            break
    return point, min(cost, before) / max(1, rows)
