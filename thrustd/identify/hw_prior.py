"""What is believed before the data speak, in rows of one sigma each: gentle curves, moderate gains, starts near rest.

A knot is expected near the line of its neighbours or, when a smooth reference curve is given, bent as that is. The
rows are weighed against the variance of the residual: that of a white sequence with the same low-frequency power, so
that a residual which stays for minutes counts once; or a variance given, so that a model which follows its data too
closely does not loosen its own reins.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thrustd.identify.hw_problem import Normal, Point
from thrustd.identify.hw_theta import Layout
from thrustd.model.stage import Floats

BEND_STD = 0.02  # of the output's range
REST_STD = 0.1  # initial states, in units of the input's range
GAIN_STD = 1.0  # a mode's gain, in units of the DC gain; keeps modes from cancelling each other
CLOSEST = 1e-4  # two knots come no nearer, in units of the curve's range


@dataclass(frozen=True, slots=True)
class Reins:
    """How tightly the curves are held. f, h: (2, n) x and y of the smooth curves they stay near."""

    bend_std: float = BEND_STD
    closest: float = CLOSEST
    variance: float | None = None
    f: Floats | None = None
    h: Floats | None = None


LOOSE = Reins()


def bend_rows(layout: Layout, theta: Floats) -> Floats:
    """Rows (n_inner, size) whose product with theta is each inner knot's distance from the line of its neighbours."""
    rows = np.zeros((layout.n_f + layout.n_h - 4, layout.size))
    first = 0
    for y_part, x_part in ((layout.fy, layout.fx), (layout.hy, layout.hx)):
        x = theta[x_part]
        inner = np.arange(len(x) - 2)
        t = (x[1:-1] - x[:-2]) / (x[2:] - x[:-2])
        for place, weight in enumerate((t - 1, np.ones_like(t), -t)):
            rows[first + inner, y_part.start + place + inner] = weight
        first += len(inner)
    return rows


def with_priors(point: Point, normal: Normal, variance: float, reins: Reins) -> tuple[Normal, float]:
    """Add the priors, against the residual's variance; returns the normal equations and the priors' cost."""
    rows, distance = _prior_rows(point, reins)
    matrix = normal.matrix + variance * rows.T @ rows
    gradient = normal.gradient - variance * rows.T @ distance
    return Normal(matrix, gradient, normal.squares, normal.rows), variance * float(distance @ distance)


def prior_cost(point: Point, variance: float, reins: Reins) -> float:
    _, distance = _prior_rows(point, reins)
    return variance * float(distance @ distance)


def _prior_rows(point: Point, reins: Reins) -> tuple[Floats, Floats]:
    """Rows (n_priors, n_columns) and values, in units of one sigma of the prior: bends, gains, initial states."""
    layout, n = point.layout, point.layout.size
    bends = bend_rows(layout, point.theta) / reins.bend_std
    rows = np.zeros((len(bends) + layout.width + point.starts.size, n + point.starts.size))
    rows[: len(bends), :n] = bends
    gains = len(bends) + np.arange(layout.width)
    rows[gains, layout.gains.start + np.arange(layout.width)] = 1 / GAIN_STD
    starts = np.arange(point.starts.size)
    rows[len(bends) + layout.width + starts, n + starts] = 1 / REST_STD
    values = rows @ np.concatenate((point.theta, point.starts.ravel()))
    values[: len(bends)] -= bends @ _reference(point, reins)
    return rows, values


def _reference(point: Point, reins: Reins) -> Floats:
    """theta with the heights of the reference curves at the present knots; zero where there is none."""
    theta = np.zeros(point.layout.size)
    for curve, x, y in (
        (reins.f, point.layout.fx, point.layout.fy),
        (reins.h, point.layout.hx, point.layout.hy),
    ):
        if curve is not None:
            theta[y] = on_line(point.theta[x], *curve)
    return theta


def on_line(x: Floats, knots_x: Floats, knots_y: Floats) -> Floats:
    """A piecewise-linear curve at x; its end segments continue."""
    at = np.clip(np.searchsorted(knots_x, x, side="right") - 1, 0, len(knots_x) - 2)
    slopes = np.diff(knots_y) / np.diff(knots_x)
    heights: Floats = knots_y[at] + slopes[at] * (x - knots_x[at])
    return heights


def free_columns(point: Point) -> NDArray[np.bool_]:
    """All but what fixes the units inside: two heights of f, the x of both curves' ends, and c."""
    layout = point.layout
    free = np.ones(layout.size + point.starts.size, bool)
    heights = np.arange(layout.size)[layout.fy]
    free[heights[list(point.pins)]] = False
    for at in (0, -1):
        for part in (layout.fx, layout.hx):
            free[np.arange(layout.size)[part][at]] = False
    free[layout.c] = False
    return free
