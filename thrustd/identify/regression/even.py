"""What lies in front of an even output curve, y = h(x), h(-x) = h(x): a speed without its sign, a power, a distance.

No linear model sees the linear block in front of such a curve: with a random input y does not correlate with it. What
is lost is a sign: x = phi c with a bank phi of lags and one swing, signs s = sign(phi c), c by least squares of s y on
phi, and so on from random beginnings, for every frequency and damping of a grid (Gerchberg & Saxton, Optik 35 (1972)
237; Netrapalli, Jain & Sanghavi, IEEE Trans. Signal Process. 63 (2015) 4814).
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from thrustd.core.columns import Floats
from thrustd.identify.regression.curve import Grid, roughness
from thrustd.identify.regression.pairs import candidates
from thrustd.identify.regression.regress import KNOTS
from thrustd.identify.regression.shape import Point, Shape
from thrustd.identify.regression.solve import Solution
from thrustd.identify.segments import Segment

BEYOND = 0.15  # of the output's range: so far beyond it does h reach on either side
ROWS = 2_000  # samples, the first ones, by which signs are found
LAGS = (1 / 8, 1.0, 8.0)  # periods of the swing: time constants beside it
POWERS = (1.0, 0.5)  # of y: it grows as |x|, or as its square
BEGINNINGS, TURNS = 20, 30  # at every swing, and how often signs are drawn anew
RIDGE = 1e-4  # of the size of every column
EACH = 10  # known samples for every column, at least


def before_even_curve(u: Floats, y: Floats, dt_s: float) -> Iterator[Floats]:
    """x (n,) of unit spread for u (n,), one for each power of y (n,), which is NaN where it is not known.

    Yields nothing where too little of y is known.
    """
    seen = slice(0, ROWS)
    good = np.isfinite(y[seen])
    swings = candidates(dt_s, len(good) * dt_s)
    tables = [_bank(u[seen] - u.mean(), swing, dt_s)[good] for swing in swings]
    if good.sum() < EACH * tables[0].shape[1]:
        return
    for power in POWERS:
        size = (y[seen][good] - np.nanmin(y)) ** power
        ends = [_signed(table, size) for table in tables]
        best = int(np.argmin([error for error, _ in ends]))
        x: Floats = _bank(u - u.mean(), swings[best], dt_s) @ ends[best][1]
        yield x / max(float(x.std()), 1e-300)


def _bank(u: Floats, swing: Floats, dt_s: float) -> Floats:
    """A constant, what lags and the swing make of u (n,), and how they fade from where they begin: (n, 9)."""
    times_s = dt_s * np.arange(len(u))
    period_s = 2 * np.pi / swing[1]
    lagged = [lfilter([0.0, 1 - a], [1.0, -a], u) for a in np.exp(-dt_s / (period_s * np.array(LAGS)))]
    pole = np.exp(complex(-swing[0], swing[1]) * dt_s)
    swung, fading = lfilter([0.0, 1 - pole], [1.0, -pole], u.astype(complex)), pole ** np.arange(len(u))
    slow = np.exp(-times_s / period_s)
    return np.column_stack((np.ones(len(u)), *lagged, swung.real, swung.imag, fading.real, fading.imag, slow))


def _signed(table: Floats, size: Floats) -> tuple[float, Floats]:
    """Mean square of size - |table c|, and the best c of all beginnings."""
    scale = np.linalg.norm(table, axis=0) + 1e-300
    unit = table / scale
    inverse = np.linalg.solve(unit.T @ unit + RIDGE * np.eye(unit.shape[1]), unit.T)
    c = np.random.default_rng(0).standard_normal((unit.shape[1], BEGINNINGS))
    for _ in range(TURNS):
        c = inverse @ (np.sign(unit @ c) * size[:, None])
    errors = np.mean((size[:, None] - np.abs(unit @ c)) ** 2, axis=0)
    best = int(np.argmin(errors))
    return float(errors[best]), c[:, best] / scale


def behind_even(inner: Solution, seen: Segment, hidden: Floats) -> tuple[Shape, Point]:
    """The straight model of what is hidden, scaled to the output's range, and the curve that this needs behind it."""
    scale = float(np.nanstd(seen.force_n))
    y = seen.force_n / scale
    reach = float(np.nanmax(y) - np.nanmin(y))
    size = reach / float(np.abs(hidden).max())
    edge = (1.0 + BEYOND) * reach
    h_grid = Grid(-edge, edge, 2 * KNOTS)
    good = np.isfinite(y)
    basis, x = h_grid.values(size * hidden[good]), size * hidden[good]
    matrix = basis.T @ basis + 1e-3 * roughness(h_grid.n) * len(x) / h_grid.n + 1e-6 * np.eye(h_grid.n)
    h: Floats = np.linalg.solve(matrix, basis.T @ (y[good] - x)).astype(np.float64)
    shape = replace(inner.shape, h_grid=h_grid, output_scale=scale, h_straight_from=0.0)
    factor = size * inner.shape.output_scale
    point = replace(inner.point, f=factor * inner.point.f, begin=factor * inner.point.begin, h=h, offset=0.0)
    return shape, point
