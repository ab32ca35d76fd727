"""Static curves of the Hammerstein-Wiener model: piecewise linear (thesis eqs. 13.75-13.92) and polynomial.

The thesis writes a piecewise-linear curve as a sum of switched slopes; we store the same curve as its knots (x_i, y_i).
Between knots it is linear, beyond the end knots the end segments continue. Two equal x in a row are a jump (play,
contact); at the jump itself the right-hand value holds.
"""

import numpy as np

from thrustd.model.stage import Floats, Stage, jit


@jit
def pwl_step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    """c: n segments, n-1 inner breakpoints, n slopes, n intercepts; y = intercept + slope * v."""
    n = int(c[0])
    low, high = 0, n - 1  # find the number of inner breakpoints <= v by bisection
    while low < high:
        middle = (low + high) // 2
        if v >= c[1 + middle]:
            low = middle + 1
        else:
            high = middle
    return c[2 * n + low] + c[n + low] * v


@jit
def polynomial_step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    """Horner's rule in z = (v - c[0]) / c[1]; c[2:] from the highest power down. Straight on beyond |z| = 1."""
    z = (v - c[0]) / c[1]
    edge = min(max(z, -1.0), 1.0)
    y, slope = 0.0, 0.0
    for i in range(2, c.shape[0]):
        slope = slope * edge + y
        y = y * edge + c[i]
    return y + slope * (z - edge)


def flatten_pwl(x_knots: Floats, y_knots: Floats) -> Floats:
    """Knots (n+1,) -> coefficients of `pwl_step`. Zero-length segments (jumps) become breakpoints without a segment."""
    width = np.diff(x_knots)
    real = width > 0
    slopes = np.diff(y_knots)[real] / width[real]
    left_x, left_y = x_knots[:-1][real], y_knots[:-1][real]
    return np.concatenate(([slopes.size], left_x[1:], slopes, left_y - slopes * left_x))


def pwl(name: str, x_knots: Floats, y_knots: Floats) -> Stage:
    """Piecewise-linear curve through knots (n+1,), x not decreasing."""
    return Stage(name, pwl_step, flatten_pwl(np.asarray(x_knots, float), np.asarray(y_knots, float)))


def polynomial(name: str, centre: float, scale: float, coefficients: Floats) -> Stage:
    """Polynomial in z = (v - centre) / scale, coefficients from the constant up (n+1,)."""
    return Stage(name, polynomial_step, np.concatenate(([centre, scale], np.asarray(coefficients, float)[::-1])))
