"""A drag polar by total least squares: C_D = C_D0 + k C_L^2, both sides measured.

    min over C_D0, k, x_i:   sum ((C_D,i - C_D0 - k x_i) / s_i)^2 + ((C_L,i^2 - x_i) / s_x,i)^2
    s_i^2 = s_y,i^2 + (b W / q S)^2

b: scatter of the excess thrust between points beyond what each says of itself (air that moves, pitch), such that the
sum is n - 2 (Paule & Mandel 1982). It is an error in g: the slower the flight, the larger is its C_D. k = 1 / (pi A
e), largest L/D = 1 / (2 sqrt(C_D0 k)). scipy's ODR leaves with scipy 1.19 and its successor has no wheels for the
aircraft's computers; the sum above is one call of `least_squares`.
"""

from math import pi, sqrt
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq, least_squares

from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError

FEWEST = 4  # points: two numbers, and something to judge them by
LEAST_SPREAD = 0.05  # of C_L^2 among the points: below it the two numbers cannot be told apart
MOST_SCATTER_G = 1.0


class PolarPoints(NamedTuple):
    """Each (n,): C_L^2 and C_D of the points with one sigma of their random part; C_D of 1 g, W / (q S)."""

    lift2: Floats
    lift2_std: Floats
    drag: Floats
    drag_std: Floats
    drag_per_g: Floats


class Polar(NamedTuple):
    zero_lift: float  # C_D0
    factor: float  # k
    covariance: Floats  # (2, 2) of them, random part
    scatter_g: float  # b
    points: int

    def efficiency(self, aspect_ratio: float) -> float:
        """Oswald's e."""
        return 1.0 / (pi * aspect_ratio * self.factor)

    @property
    def best_ratio(self) -> float:
        """Largest L/D."""
        return 1.0 / (2.0 * sqrt(self.zero_lift * self.factor))

    def drag(self, lift2: Floats) -> Floats:
        return np.asarray(self.zero_lift + self.factor * lift2)

    def point_std(self, points: PolarPoints) -> Floats:
        """One sigma (n,) of every point's C_D, the scatter in it."""
        return np.hypot(points.drag_std, self.scatter_g * points.drag_per_g)


def fit_polar(points: PolarPoints) -> Polar:
    """RecordingError when the points do not determine it."""
    n = len(points.drag)
    if n < FEWEST or np.ptp(points.lift2) < LEAST_SPREAD:
        spread = f"C_L^2 spread over {np.ptp(points.lift2):.3f}" if n else "none at all"
        raise RecordingError(
            f"{n} points, {spread}: no drag polar; expected {FEWEST} or more over {LEAST_SPREAD:g}: fly other speeds"
        )

    def excess(scatter_g: float) -> float:
        return _fit(points, scatter_g)[2] - (n - 2)

    scatter_g = 0.0 if excess(0.0) <= 0.0 else float(brentq(excess, 0.0, MOST_SCATTER_G, xtol=1e-7))
    beta, covariance, _ = _fit(points, scatter_g)
    if min(beta) <= 0.0:
        raise RecordingError(
            f"C_D0 = {beta[0]:.4f}, k = {beta[1]:.4f}: no drag polar; are thrust, mass and pitch right?"
        )
    return Polar(float(beta[0]), float(beta[1]), covariance, scatter_g, n)


def _fit(points: PolarPoints, scatter_g: float) -> tuple[Floats, Floats, float]:
    """(C_D0, k), their covariance, and the weighted sum of squares."""
    drag_std = np.maximum(np.hypot(points.drag_std, scatter_g * points.drag_per_g), 1e-6)
    lift_std = np.maximum(points.lift2_std, 1e-6)

    def misses(numbers: Floats) -> Floats:
        true_lift2 = points.lift2 + numbers[2:] * lift_std
        return np.concatenate(((points.drag - numbers[0] - numbers[1] * true_lift2) / drag_std, numbers[2:]))

    slope, level = np.polyfit(points.lift2, points.drag, 1)
    found = least_squares(misses, np.concatenate(((level, slope), np.zeros(len(drag_std)))), x_scale="jac")
    whole = np.linalg.inv(found.jac.T @ found.jac)
    return found.x[:2], whole[:2, :2], 2.0 * float(found.cost)
