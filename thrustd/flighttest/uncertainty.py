"""How well the mean of a window is known: random and systematic part, kept apart (GUM, JCGM 100, 4.2 and 5.2).

    random      t(n_eff - 1) s / sqrt(n_eff),   n_eff = n / tau,   tau = 1 + 2 sum rho_k
    systematic  1.96 sigma, of what is the same in the whole window and does not average out

rho_k: autocorrelation of the window, summed over Geyer's initial positive pairs (Geyer 1992), so that samples which
repeat one another do not count as news.
"""

from math import hypot, nan, sqrt
from typing import NamedTuple

import msgspec
import numpy as np
from scipy.special import stdtrit

from thrustd.core.columns import Floats
from thrustd.core.measures import SIGMAS_95

FEWEST = 3.0  # independent samples that any window is taken to hold
ROUNDS = 4  # of a fixed point that is near after two
FEWEST_VALUES = 4


class Mean(msgspec.Struct, frozen=True):
    """A mean with its 95 % uncertainty, in the quantity's own unit."""

    mean: float
    u95: float
    random_u95: float
    systematic_u95: float = 0.0  # of the thrust; that of other sensors is not known to thrustd


class Spread(NamedTuple):
    std: float
    independent: float  # samples


def mean_of(values: Floats, systematic_std: float = 0.0) -> Mean:
    """Of evenly spaced values (n,); NaN ones are left out."""
    known = values[np.isfinite(values)]
    if len(known) < FEWEST_VALUES:
        return Mean(nan, nan, nan, nan)
    spread = spread_of(known)
    students = float(stdtrit(spread.independent - 1.0, 0.975))
    random = students * spread.std / sqrt(spread.independent)
    systematic = SIGMAS_95 * systematic_std
    return Mean(float(known.mean()), hypot(random, systematic), random, systematic)


def spread_of(values: Floats) -> Spread:
    """Standard deviation and the number of independent samples of a series (n,)."""
    n = len(values)
    off = values - values.mean()
    power = np.fft.rfft(off, 2 * n)
    covariance = np.fft.irfft(power * power.conj())[:n] / n
    if covariance[0] <= 0.0:
        return Spread(0.0, float(n))
    followed = 0.0  # variance of the mean, which the mean of the window took out of every covariance
    for _ in range(ROUNDS):
        whole = covariance + followed * np.linspace(1.0, 0.0, n)
        tau = _correlation_samples(whole / whole[0])
        followed = float(whole[0]) * min(tau / n, 1.0 / FEWEST)
    return Spread(sqrt(covariance[0] + followed), max(n / tau, FEWEST))


def _correlation_samples(rho: Floats) -> float:
    """tau of the autocorrelation rho (n,), rho_0 = 1: summed while neighbours together are positive."""
    n = len(rho)
    pairs = rho[1 : n - 1 : 2] + rho[2:n:2]
    stop = int(np.argmax(pairs <= 0.0)) if (pairs <= 0.0).any() else len(pairs)
    return max(1.0 + 2.0 * float(pairs[:stop].sum()), 1.0)
