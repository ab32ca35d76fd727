"""A solution as the artifact keeps it, and back: what was learnt on the bench is the prior of the next record."""

import numpy as np

from thrustd.identify.regression.curve import Grid, travel
from thrustd.identify.regression.shape import Point, Shape
from thrustd.identify.regression.solve import Solution
from thrustd.identify.regression.stops import radii_of
from thrustd.model.artifact import Posterior
from thrustd.model.stage import Floats


def kept(found: Solution) -> Posterior:
    """Mean and information of the base, effects and where each record began integrated out."""
    shape = found.shape
    n = shape.parts()["terms"].start
    whole = found.information
    base = whole[:n, :n]
    if n < shape.n:
        base = base - whole[:n, n:] @ np.linalg.lstsq(whole[n:, n:], whole[n:, :n], rcond=None)[0]
    grid, h_grid = shape.f_grid, shape.h_grid
    lower = base[np.tril_indices(n)]
    return Posterior(
        (grid.low, grid.high, grid.n),
        shape.zero,
        [float(tau) for tau in np.exp(found.point.log_tau)],
        shape.output_scale,
        [float(value) for value in found.point.vector(shape)[:n]],
        [float(value) for value in lower],
        float(np.sqrt(found.noise_variance)) * shape.output_scale,
        float(np.sqrt(found.mean_square)) * shape.output_scale,
        {name: float(value) for name, value in found.precisions.items() if name != "begin"},
        [(float(a), float(b)) for a, b in found.point.log_pole],
        (h_grid.low, h_grid.high, h_grid.n) if h_grid else None,
        "zoh" if shape.hold == "zoh" else "foh",
        shape.passive,
    )


def shape_of(posterior: Posterior) -> Shape:
    """The fixed side; poles stay where the bench put them."""
    low, high, n = posterior.input_grid
    others = n + len(posterior.tau_s) + 2 * len(posterior.log_pole) + 1
    others += posterior.output_grid[2] if posterior.output_grid else 0
    return Shape(
        Grid(low, high, n),
        posterior.zero_mm,
        np.array(posterior.tau_s),
        radii_of(travel(Grid(low, high, n))) if len(posterior.mean) > others else np.zeros(0),
        posterior.output_scale,
        Grid(*posterior.output_grid) if posterior.output_grid else None,
        np.array(posterior.log_pole).reshape(-1, 2),
        posterior.hold,
        posterior.passive,
    )


def point_of(posterior: Posterior) -> Point:
    """The mean."""
    shape = shape_of(posterior)
    empty = np.zeros(0)
    p = len(shape.poles)
    blank = Point(
        empty, empty, np.log(shape.taus_s), np.zeros((p, 2)), shape.poles.copy(), empty, 0.0, empty, empty
    )  # fmt: skip
    return blank.at(shape, np.array(posterior.mean))


def information_of(posterior: Posterior) -> Floats:
    """Inverse covariance (n, n) of the mean's numbers."""
    n = len(posterior.mean)
    matrix = np.zeros((n, n))
    matrix[np.tril_indices(n)] = posterior.information
    full: Floats = matrix + np.tril(matrix, -1).T
    return full
