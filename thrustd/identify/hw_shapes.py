"""Shapes of the two curves: free knots, a cubic, or a straight line; each as directions in which a search may move.

A cubic is carried as many fixed knots whose heights move together, so one recursion serves all shapes:
f = x + (a + b x) x (1 - x) keeps f's ends where they are, h is a full cubic.
"""

from typing import Literal

import numpy as np

from thrustd.identify.hw_prior import free_columns
from thrustd.identify.hw_problem import Point
from thrustd.model.stage import Floats

Shape = Literal["pwl", "cubic", "line"]
CUBIC_KNOTS = 25  # a cubic between them is straight to 0.02 % of its range


def knots_of(shape: Shape) -> int:
    """Number of knots, ends included, that a smooth shape is carried on; free knots start as a cubic."""
    return 2 if shape == "line" else CUBIC_KNOTS


def smooth(shapes: tuple[Shape, Shape]) -> tuple[Shape, Shape]:
    """The same with cubics for free knots."""
    first, second = ("cubic" if shape == "pwl" else shape for shape in shapes)
    return first, second


def directions_of(point: Point, input_shape: Shape, output_shape: Shape, at_rest: bool = False) -> Floats:
    """Directions (n_columns, n_free) for this pair of shapes; at_rest: initial states stay."""
    layout, n = point.layout, point.layout.size
    free = free_columns(point)
    free[n:] &= not at_rest
    added = []
    if input_shape != "pwl":
        free[layout.fy] = free[layout.fx] = False
        x = point.theta[layout.fx]
        added += [_column(len(free), layout.fy, x**k * (1 - x)) for k in (1, 2) if input_shape == "cubic"]
    if output_shape == "cubic":
        free[layout.hy] = free[layout.hx] = False
        x = point.theta[layout.hx]
        z = 2 * (x - x[0]) / (x[-1] - x[0]) - 1
        added += [_column(len(free), layout.hy, z**k) for k in range(4)]
    assert n <= len(free)
    return np.column_stack([np.eye(len(free))[:, free], *added])


def _column(size: int, part: slice, heights: Floats) -> Floats:
    column = np.zeros(size)
    column[part] = heights
    return column
