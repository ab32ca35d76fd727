"""Where the poles of a linear block may lie: starting points for the search.

Real modes spread evenly on a logarithmic scale serve every overdamped system. For data that oscillate, poles come from
the best linear model: a long ARX model by least squares (consistent whatever the noise), its impulse response, and the
eigensystem realisation of it (Juang & Pappa, J. Guidance 8(5), 1985): the shift of the Hankel matrix's leading singular
vectors.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from thrustd.model.stage import Floats

ARX_LAGS = 40
ARX_ROWS = 60_000
RESPONSE = 400  # samples of impulse response
RIDGE = 1e-9
DAMPED = 0.95  # a pair with a higher damping ratio is as good as real


class Poles(NamedTuple):
    """tau_s (n_real,) and pairs (n_complex, 2) of decay and frequency in 1/s and rad/s."""

    tau_s: Floats
    pairs: Floats


def spread(order: int, shortest_s: float, longest_s: float) -> Poles:
    """`order` real modes, evenly spaced logarithms."""
    return Poles(np.geomspace(shortest_s, longest_s, order), np.empty((0, 2)))


def realised(u: Floats, y: Floats, dt_s: float, order: int) -> Poles:
    """Poles of the best linear model of one segment, u and y (n,) centred; fewer than `order` may come out."""
    response = _impulse_response(u, y)
    half = RESPONSE // 2
    hankel = response[1 + np.arange(half)[:, None] + np.arange(half)]
    if not np.isfinite(hankel).all():
        return Poles(np.empty(0), np.empty((0, 2)))
    left, size, _ = np.linalg.svd(hankel)
    rank = min(order, int(np.sum(size > 1e-8 * size[0])))
    basis = left[:, :rank] * np.sqrt(size[:rank])
    values = np.linalg.eigvals(np.linalg.lstsq(basis[:-1], basis[1:], rcond=None)[0])
    return _continuous(values.astype(complex), dt_s)


def _impulse_response(u: Floats, y: Floats) -> Floats:
    lags = min(ARX_LAGS, len(u) // 8)
    n = min(len(u), ARX_ROWS)
    past = [np.roll(-y[:n], k)[lags:] for k in range(1, lags + 1)] + [np.roll(u[:n], k)[lags:] for k in range(lags + 1)]
    table = np.column_stack(past)
    matrix = table.T @ table
    matrix[np.diag_indices_from(matrix)] *= 1 + RIDGE
    matrix[np.diag_indices_from(matrix)] += RIDGE * float(np.max(np.diag(matrix)))
    weights = np.linalg.solve(matrix, table.T @ y[lags:n])
    response = np.zeros(RESPONSE)
    for k in range(RESPONSE):
        value = weights[lags + k] if k <= lags else 0.0
        response[k] = value - sum(weights[i] * response[k - 1 - i] for i in range(min(lags, k)))
        if abs(response[k]) > 1e6:
            return np.full(RESPONSE, np.nan)
    return response


def _continuous(values: NDArray[np.complex128], dt_s: float) -> Poles:
    """Discrete poles to time constants and pairs; unstable and alternating ones are left out."""
    stable = values[(np.abs(values) < 1) & (np.abs(values) > 1e-3)]
    real = stable[(np.abs(stable.imag) < 1e-9) & (stable.real > 0)].real
    upper = np.log(stable[stable.imag > 1e-9]) / dt_s
    ratio = -upper.real / np.abs(upper)
    tau_s = np.concatenate((-dt_s / np.log(real), np.repeat(1 / np.abs(upper[ratio > DAMPED]), 2)))
    kept = upper[ratio <= DAMPED]
    return Poles(np.sort(tau_s) * (1 + 0.01 * np.arange(len(tau_s))), np.column_stack((-kept.real, kept.imag)))


def filled(poles: Poles, order: int, spare: Floats) -> Poles:
    """Exactly `order`: pairs with the least damping first, then real modes, then some of `spare` (sorted tau_s)."""
    pairs = poles.pairs[np.argsort(poles.pairs[:, 0] / np.hypot(*poles.pairs.T))][: order // 2]
    tau_s = poles.tau_s[: order - 2 * len(pairs)]
    missing = order - 2 * len(pairs) - len(tau_s)
    extra = spare[np.linspace(0, len(spare) - 1, missing).astype(int)] if missing else np.empty(0)
    return Poles(np.sort(np.concatenate((tau_s, extra))), pairs)
