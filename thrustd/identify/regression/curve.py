"""A smooth curve: cubic B-spline on a uniform grid, straight beyond its ends.

    f(v) = sum_j c_j B_j(v),   prior  p(c) ~ exp(-lambda/2 sum (third differences of c)^2)

Third differences leave every parabola free: the prior asks for few bends, not for a small curve (Eilers & Marx,
Statist. Sci. 11 (1996) 89). With the grid fine enough the number of coefficients does not matter, lambda does.
"""

from typing import NamedTuple

import numpy as np

from thrustd.model.stage import Floats, jit

BEYOND = 0.15  # of the data's span, on both sides


class Grid(NamedTuple):
    """n coefficients on [low, high]."""

    low: float
    high: float
    n: int

    @property
    def step(self) -> float:
        return (self.high - self.low) / (self.n - 3)

    def centres(self) -> Floats:
        """Where a straight line has the coefficients' values (n,): Greville abscissae."""
        centres: Floats = self.low + self.step * (np.arange(self.n, dtype=np.float64) - 1.0)
        return centres

    def values(self, v: Floats) -> Floats:
        """Basis (len(v), n)."""
        out, four = np.zeros((len(v), self.n)), np.empty(8)
        for row, at in zip(out, v, strict=True):
            first = bspline(float(at), self.low, self.step, self.n, four)
            row[first : first + 4] = four[:4]
        return out


def beyond(low: float, high: float, n: int) -> Grid:
    """A grid that reaches past the data on both sides: there the curve goes on as the prior has it, with its bend."""
    more = BEYOND * (high - low)
    return Grid(low - more, high + more, n)


def travel(grid: Grid) -> float:
    """Span of the data that `beyond` made the grid for."""
    return (grid.high - grid.low) / (1.0 + 2.0 * BEYOND)


def roughness(n: int) -> Floats:
    """D'D of the third differences (n, n); rank n - 3."""
    third = np.diff(np.eye(n), 3, axis=0)
    matrix: Floats = third.T @ third
    return matrix


@jit
def bspline(v: float, low: float, step: float, n: int, out: Floats) -> int:
    """The four basis values that are not zero at v into out[:4], slopes times `step` into out[4:]; first index."""
    t = (v - low) / step
    inside = min(max(t, 0.0), n - 3.0)
    first = min(int(inside), n - 4)
    u = inside - first
    w, square, cube = 1.0 - u, u * u, u * u * u
    out[0] = w * w * w * (1 / 6)
    out[1] = 0.5 * cube - square + 2 / 3
    out[2] = 0.5 * (square + u - cube) + 1 / 6
    out[3] = cube * (1 / 6)
    out[4] = -0.5 * w * w
    out[5] = 1.5 * square - 2.0 * u
    out[6] = u - 1.5 * square + 0.5
    out[7] = 0.5 * square
    beyond = t - inside
    if beyond != 0.0:
        for j in range(4):
            out[j] += beyond * out[4 + j]
    return first
