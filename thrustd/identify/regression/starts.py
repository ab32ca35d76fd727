"""Where a general system's regression begins: the best straight model with the poles it has, by least squares."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from thrustd.core.columns import Floats
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.regress import first_point
from thrustd.identify.regression.shape import Point, Shape
from thrustd.identify.regression.sweep import normal_equations

RIDGE = 1e-7  # of the size of every column
TINY = 1e-3  # of the largest weight: a system that hardly answers at rest still gets a slope of this


def linear_point(shape: Shape, records: Sequence[Record]) -> Point:
    """y = offset + slope (w + sum g (w - L w) + pairs), w the deformation: linear in slope and slope times gains."""
    line: Floats = shape.f_grid.centres() - shape.zero
    point = replace(first_point(shape, records), f=line, offset=0.0)
    normal, where = normal_equations(shape, point, records), shape.parts()
    free = np.concatenate([np.arange(shape.n)[where[name]] for name in ("gain", "pair_gain", "offset")])
    basis = np.zeros((shape.n, len(free) + 1))
    basis[where["f"], 0] = line
    basis[free, 1 + np.arange(len(free))] = 1.0
    matrix = basis.T @ normal.matrix @ basis
    right = basis.T @ normal.right + matrix[:, 0]  # of y itself: the residual plus the straight line without memory
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    scaled = matrix / np.outer(size, size) + RIDGE * np.eye(len(size))
    found = np.linalg.solve(scaled, right / size) / size
    least = TINY * float(np.abs(found[:-1]).max())
    slope = float(found[0]) if abs(found[0]) > least else float(np.copysign(least, found[0] or 1.0))
    m = len(point.gain)
    return replace(
        point,
        f=slope * line,
        gain=found[1 : 1 + m] / slope,
        pair_gain=(found[1 + m : -1] / slope).reshape(-1, 2),
        offset=float(found[-1]),
    )
