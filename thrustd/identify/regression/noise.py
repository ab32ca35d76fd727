"""Noise that lasts beside white noise, and rows made white: generalised least squares.

    e_k = v_k + l_k,   v_k ~ N(0, s2),   l of variance ratio s2, forgotten as exp(-t / tau)

a first-order Gauss-Markov process: what a load cell's zero wanders by, and what no law says of a mount for seconds or
minutes. Its Kalman filter, run along every column of a regression, leaves innovations that are white and of variance s2
(Harvey, Forecasting, Structural Time Series Models and the Kalman Filter, 1989, 3.4): there least squares are the
likelihood, and samples that are not known are none.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from thrustd.core.columns import Floats
from thrustd.model.stage import jit

COUNTED = 24_000  # residuals that tell a noise, pairs of neighbours all over the records
RATIOS, TIMES = (0.01, 0.1, 1.0), 5  # where it is looked for first: variances, and times from five samples to a record
CLOSE = {"xatol": 0.05, "fatol": 0.1, "maxiter": 80}  # logarithms, and twice that of the likelihood

Indices = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Lasting:
    """What lasts, beside white noise."""

    ratio: float  # of its variance to that of the white noise
    tau_s: float


@dataclass(slots=True)
class Whitener:
    """Runs along the columns of one record, block by block."""

    lasting: Lasting
    dt_s: float
    _known: Floats | None = None  # (n,) what lasts, as the samples before tell it, of every column
    _doubt: Floats = field(default_factory=lambda: np.array([0.0, -np.inf]))  # its variance, and where it was told

    def whiten(self, rows: Floats, places: Indices) -> None:
        """Rows (m, n) of the samples at these places (m,), in order, in place."""
        if self._known is None:
            self._known = np.zeros(rows.shape[1])
        _whiten(rows, places, self._known, self._doubt, self.lasting.ratio, self.dt_s / self.lasting.tau_s)


@jit
def _whiten(rows: Floats, places: Indices, known: Floats, doubt: Floats, ratio: float, forgets: float) -> None:
    for k in range(rows.shape[0]):
        keeps = np.exp(-forgets * (places[k] - doubt[1]))
        ahead = ratio + keeps * keeps * (doubt[0] - ratio)
        gain, size = ahead / (ahead + 1.0), 1.0 / np.sqrt(ahead + 1.0)
        for j in range(rows.shape[1]):
            foretold = keeps * known[j]
            new = rows[k, j] - foretold
            known[j] = foretold + gain * new
            rows[k, j] = size * new
        doubt[0], doubt[1] = ahead / (ahead + 1.0), places[k]


def whitened(residual: Floats, lasting: Lasting, dt_s: float) -> Floats:
    """A residual (n,), NaN where it is not known, made white."""
    places = np.flatnonzero(~np.isnan(residual))
    rows = residual[places][:, None]
    Whitener(lasting, dt_s).whiten(rows, places)
    white = np.full(len(residual), np.nan)
    white[places] = rows[:, 0]
    return white


def likeliest(residuals: Sequence[Floats], periods_s: Sequence[float]) -> Lasting:
    """The likeliest of residuals (n,) each, NaN where they are not known, with these sample periods."""
    every = -(-sum(map(len, residuals)) // COUNTED)
    data = []
    for residual, dt_s in zip(residuals, periods_s, strict=True):
        counts = np.isfinite(residual) & (np.arange(len(residual)) // 2 % every == 0)
        data.append((residual[counts], np.flatnonzero(counts), dt_s))
    long_s = max(len(residual) * dt_s for residual, dt_s in zip(residuals, periods_s, strict=True))

    def unlikely(logs: Floats) -> float:
        ratio, tau_s = np.exp(logs)
        sums = np.zeros(3)
        for residual, places, dt_s in data:
            _add_unlikely(residual, places, ratio, dt_s / tau_s, sums)
        return float(sums[0] + sums[2] * np.log(sums[1] / sums[2]))

    times_s = np.geomspace(5.0 * min(periods_s), long_s, TIMES)
    starts = [np.log([ratio, tau_s]) for ratio in RATIOS for tau_s in times_s]
    bounds = [(np.log(1e-8), np.log(1e4)), (np.log(min(periods_s)), np.log(10.0 * long_s))]
    found = minimize(unlikely, min(starts, key=unlikely), method="Nelder-Mead", bounds=bounds, options=CLOSE)
    ratio, tau_s = np.exp(found.x)
    return Lasting(float(ratio), float(tau_s))


@jit
def _add_unlikely(residual: Floats, places: Indices, ratio: float, forgets: float, sums: Floats) -> None:
    """Sum of ln S, of e^2 / S, and how many: innovations e of variance S, in units of the white noise."""
    known, doubt, last = 0.0, ratio, -np.inf
    for k in range(residual.size):
        keeps = np.exp(-forgets * (places[k] - last))
        ahead = ratio + keeps * keeps * (doubt - ratio)
        new = residual[k] - keeps * known
        sums[0] += np.log(ahead + 1.0)
        sums[1] += new * new / (ahead + 1.0)
        sums[2] += 1.0
        known = keeps * known + ahead / (ahead + 1.0) * new
        doubt, last = ahead / (ahead + 1.0), places[k]
