"""Where data ring: the pair of complex poles that explains most of what a regression leaves.

Score test: columns of a candidate, Re(w - P w) and Im(P w), less what the present parameters' columns can absorb, and
the fall of the sum of squares that they would bring. Candidates on a log-spaced grid of frequency and damping; the
winner then moves freely in Gauss-Newton.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from thrustd.identify.regression.kernel import Numbers
from thrustd.identify.regression.record import Record, head_of
from thrustd.identify.regression.shape import Point, Shape, core_of
from thrustd.identify.regression.solve import Solution
from thrustd.identify.regression.sweep import columns
from thrustd.model.linear import discretise_mode
from thrustd.model.stage import Floats, jit

FREQUENCIES = 40
DAMPINGS = (0.01, 0.03, 0.1, 0.3, 0.7)  # damping ratios
PERIODS = 2.0  # in the longest record, at least
HIGHEST = 0.8  # of the Nyquist frequency
ROWS = 30_000  # samples looked at, at the beginning of every record
RIDGE = 1e-9


def candidates(dt_s: float, longest_s: float) -> Floats:
    """Decay and frequency (n, 2), 1/s."""
    rates = np.geomspace(2 * np.pi * PERIODS / longest_s, HIGHEST * np.pi / dt_s, FREQUENCIES)
    return np.array([(z * rate, rate * np.sqrt(1 - z * z)) for rate in rates for z in DAMPINGS])


def with_best_pair(found: Solution, records: Sequence[Record]) -> tuple[Shape, Point]:
    """The solution with one more pair, whose gain is still zero; all poles may move from here on."""
    shape, point = found.shape, found.point
    parts = [head_of(record, ROWS) for record in records]
    grid = candidates(records[0].dt_s, max(len(r) * r.dt_s for r in parts))
    best = grid[int(np.argmax(_explained(found, parts, grid)))]
    poles = np.vstack([point.log_pole, np.log(best)])
    new = replace(shape, poles=poles, taus_s=np.exp(point.log_tau), move=True)
    m, p = len(point.gain), len(point.pair_gain)
    begin = point.begin.reshape(max(shape.begun, 1), -1) if shape.begun else np.zeros((0, m + 2 * p))
    zero = np.zeros((len(begin), 1))
    wider = np.hstack((begin[:, : m + p], zero, begin[:, m + p :], zero))
    gains = np.vstack([point.pair_gain, np.zeros((1, 2))])
    return new, replace(point, log_pole=poles.copy(), pair_gain=gains, begin=wider.ravel())


def _explained(found: Solution, records: Sequence[Record], grid: Floats) -> Floats:
    """Fall of the sum of squares (n,) for each candidate alone."""
    shape, k = found.shape, 2 * len(grid)
    matrix, across = np.zeros((shape.n, shape.n)), np.zeros((shape.n, k))
    own, right, right_of = np.zeros((len(grid), 2, 2)), np.zeros(shape.n), np.zeros(k)
    for record in records:
        rows, bank, missed = _tables(found, record, grid)
        matrix += rows.T @ rows
        across += rows.T @ bank
        right += rows.T @ missed
        right_of += bank.T @ missed
        pairs = bank.reshape(len(bank), len(grid), 2)
        own += np.einsum("nka,nkb->kab", pairs, pairs)
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    factor = cho_factor(matrix / np.outer(size, size) + RIDGE * np.eye(shape.n))
    absorbed = cho_solve(factor, across / size[:, None])
    left = right_of - absorbed.T @ (right / size)
    falls = np.zeros(len(grid))
    for i in range(len(grid)):
        at = slice(2 * i, 2 * i + 2)
        rest = own[i] - (across[:, at] / size[:, None]).T @ absorbed[:, at] + 1e-6 * np.diag(np.diag(own[i]))
        falls[i] = left[at] @ np.linalg.solve(rest, left[at])
    return falls


def _tables(found: Solution, record: Record, grid: Floats) -> tuple[Floats, Floats, Floats]:
    """Columns of the present parameters, of the candidates, and the residual, where there is a reference."""
    shape, point = found.shape, found.point
    parts = [(known, rows.copy(), missed) for known, rows, missed in columns(shape, point, record)]
    known, rows, missed = (np.concatenate(column) for column in zip(*parts, strict=True))
    core = core_of(shape, point, record.dt_s)
    before, *w = (shape.f_grid.values(np.concatenate(([record.before], record.d))) - core.f_zero) @ point.f
    poles = np.array([discretise_mode(complex(-a, b), record.dt_s, shape.hold) for a, b in grid], complex)
    bank = np.empty((len(record), 2 * len(grid)))
    _bank(np.array(w), float(before), poles, bank)
    return rows, bank[known], missed


@jit
def _bank(w: Floats, before: float, poles: Numbers, out: Floats) -> None:
    """Re(w - P w), Im(P w) of every pole (n, 2 k)."""
    z = np.full(poles.shape[0], complex(before, 0.0))
    last = before
    for k in range(w.size):
        for i in range(poles.shape[0]):
            z[i] = poles[i, 0] * z[i] + poles[i, 1] * last + poles[i, 2] * w[k]
            out[k, 2 * i] = w[k] - z[i].real
            out[k, 2 * i + 1] = z[i].imag
        last = w[k]
