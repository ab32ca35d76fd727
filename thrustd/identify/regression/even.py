"""What lies in front of an even output curve, y = h(x), h(-x) = h(x): a speed without its sign, a power, a distance.

No linear model sees the linear block in front of such a curve: with a random input y does not correlate with it. The
products do: y by least squares on the products of u through a Laguerre bank, y = phi' C phi + b' phi + a, has a matrix
C that is mostly c c', and x = c' phi (principal Hessian directions, Li, JASA 87, 1992).
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.signal import lfilter

from thrustd.identify.regression.curve import Grid, roughness
from thrustd.identify.regression.regress import KNOTS
from thrustd.identify.regression.shape import Point, Shape
from thrustd.identify.regression.solve import Solution
from thrustd.identify.segments import Segment
from thrustd.model.stage import Floats

BEYOND = 0.15  # of the output's range: so far beyond it does h reach on either side
BANK = 5  # Laguerre functions
MEMORIES = (2, 4, 8, 16, 32, 64, 128)  # samples: time constants of the bank that compete
ROWS = 20_000
RIDGE = 0.01  # of the size of every column: few rows and products that are much alike
BLOCKS = 10  # every other one judges what was fitted to the rest


def before_even_curve(u: Floats, y: Floats, chosen: NDArray[np.int64]) -> Floats | None:
    """x (n,) of unit spread for u (n,) and y at the chosen samples; None where these are too few."""
    rows = chosen[:: max(1, len(chosen) // ROWS)]
    if len(rows) < 2 * _count(BANK + 1):
        return None
    trials = [_hidden(bank, rows, y[rows]) for bank in (laguerre(u - u.mean(), memory) for memory in MEMORIES)]
    return min(trials, key=lambda trial: trial[0])[1]


def laguerre(u: Floats, memory: float) -> Floats:
    """u (n,) and what a bank of discrete Laguerre functions makes of it, (n, BANK + 1), each of unit spread."""
    a = np.exp(-1.0 / memory)
    columns = [u, lfilter([0.0, 1.0], [1.0, -a], u)]
    while len(columns) <= BANK:
        columns.append(lfilter([-a, 1.0], [1.0, -a], columns[-1]))
    table = np.column_stack(columns)
    scaled: Floats = table / np.maximum(table.std(axis=0), 1e-12 * table.std())
    return scaled


def _hidden(bank: Floats, rows: NDArray[np.int64], y: Floats) -> tuple[float, Floats]:
    """Mean square left in blocks not fitted to, and x."""
    phi = bank[rows]
    first, second = np.triu_indices(phi.shape[1])
    table = np.column_stack((phi[:, first] * phi[:, second], phi, np.ones(len(phi))))
    judge = np.arange(len(phi)) * BLOCKS // len(phi) % 2 == 1
    left = float(np.mean((y - table @ _solved(table[~judge], y[~judge]))[judge] ** 2))
    upper = np.zeros((phi.shape[1], phi.shape[1]))
    upper[first, second] = _solved(table, y)[: len(first)]
    root = np.linalg.cholesky(phi.T @ phi / len(phi) + 1e-9 * np.eye(phi.shape[1]))  # of what the bank puts out
    sizes, ways = np.linalg.eigh(root.T @ (upper + upper.T) @ root)
    x = bank @ np.linalg.solve(root.T, ways[:, np.argmax(np.abs(sizes))])
    return left, x / max(float(x.std()), 1e-300)


def _solved(table: Floats, y: Floats) -> Floats:
    size = np.linalg.norm(table, axis=0) + 1e-300
    matrix = (table / size).T @ (table / size) + RIDGE * np.eye(table.shape[1])
    found: Floats = cho_solve(cho_factor(matrix), (table / size).T @ y) / size
    return found


def _count(n: int) -> int:
    """Numbers in the least squares."""
    return n * (n + 1) // 2 + n + 1


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
