"""A quantity over hours of flight: does it change, since when, how fast.

Three hypotheses of a series y of n flights: nothing (a constant), a trend a + b h, a step after flight k. A change is
weighed by its Bayes factor against nothing, level and noise unknown, of a size d in sigmas with prior N(0, g):

    BF = (1 + g s)^((n - 2) / 2) / (1 + g s (1 - R^2))^((n - 1) / 2),      s = c'c,  R^2 = (c'y)^2 / (s y'y)

c: the change's shape, its mean taken out (Liang et al. 2008). Averaged over sizes and over k, prior 1 / (k (k + 1)),
it is an e-process: level and noise have their Haar priors, so the odds that a series without a change EVER shows
1 / ODDS, however often and long one looks, are ODDS at most (Ville's inequality; Perez-Ortiz et al. 2024).
"""

from math import inf, nan
from typing import NamedTuple

import msgspec
import numpy as np
from scipy.special import logsumexp, stdtrit

from thrustd.core.columns import Floats

ODDS = 0.01  # of a false alarm in the whole life of a series, at most
FEWEST = 6  # flights before anything is said
EDGE = 3  # flights on either side of a step
SLOPES = 0.03, 0.1, 0.3  # sigmas a flight, equally likely
STEP = 2.0  # sigmas


PER_H = {"slope": "slope_per_h", "slope_low": "slope_low_per_h", "slope_high": "slope_high_per_h"}


class Trend(msgspec.Struct, frozen=True, rename=PER_H):
    """95 % intervals; hours as given."""

    flights: int
    slope: float  # per hour
    slope_low: float
    slope_high: float
    change: float  # over all hours: of the trend, or of the step where that fits better
    kind: str  # steady, trend, step
    since_flight: int  # of a step: its first flight, counted from 1; else 0
    odds: float  # that a series without a change would ever show so much, at most

    @property
    def changed(self) -> bool:
        return self.kind != "steady"


class Change(NamedTuple):
    log_evidence: float  # of the Bayes factor
    size: float  # over all hours, or of the step
    since: int


class Told(NamedTuple):
    """A trend as the data behind a series tell it."""

    log_evidence: float
    slope: float  # per hour
    half: float  # of its 95 % interval


def judge(hours: Floats, values: Floats, least: float = 0.0, told: Told | None = None) -> Trend:
    """Of series (n,) over hours of flight; `least`: smaller changes are not named. NaN values are left out."""
    known = np.isfinite(values)
    hours, values = hours[known], values[known]
    n = len(values)
    if n < FEWEST or np.ptp(hours) <= 0.0:
        return Trend(n, nan, nan, nan, nan, "steady", 0, 1.0)
    slope, half = _line(hours, values) if told is None else told[1:]
    trend, step = _trend(hours, values, slope), _step(values)
    if told is not None:
        trend = trend._replace(log_evidence=told.log_evidence)
    odds = float(np.exp(-np.logaddexp(trend.log_evidence, step.log_evidence) + np.log(2.0)))
    found = max(trend, step)
    kind = "steady"
    if odds < ODDS and abs(found.size) >= least:
        kind = "step" if found.since else "trend"
    since = int(np.flatnonzero(known)[found.since]) + 1 if kind == "step" else 0
    change = found.size if kind != "steady" else trend.size
    return Trend(n, slope, slope - half, slope + half, change, kind, since, min(odds, 1.0))


def hours_to(limit: float, trend: Trend) -> float:
    """Hours from the first flight until the worse end of the slope's interval has moved by `limit`; inf: not known."""
    worst = max(abs(trend.slope_low), abs(trend.slope_high)) if np.isfinite(trend.slope_low) else 0.0
    return limit / worst if worst > 0.0 else inf


def _line(hours: Floats, values: Floats) -> tuple[float, float]:
    """Slope and half its 95 % interval."""
    n = len(values)
    off = hours - hours.mean()
    slope = float(off @ values / (off @ off))
    rest = values - values.mean() - slope * off
    std = float(np.sqrt(rest @ rest / (n - 2) / (off @ off)))
    return slope, float(stdtrit(n - 2, 0.975)) * std


def _trend(hours: Floats, values: Floats, slope: float) -> Change:
    flights = hours / float(np.mean(np.diff(hours)))
    sizes = [_log_bayes(flights, values, size) for size in SLOPES]
    return Change(float(logsumexp(sizes)) - np.log(len(sizes)), slope * float(np.ptp(hours)), 0)


def _step(values: Floats) -> Change:
    n = len(values)
    places = np.arange(EDGE, n - EDGE + 1)
    each = [_log_bayes((np.arange(n) >= k).astype(float), values, STEP) for k in places.tolist()]
    best = int(places[np.argmax(each)])
    size = float(values[best:].mean() - values[:best].mean())
    return Change(float(logsumexp(each - np.log(places * (places + 1.0)))), size, best)


def _log_bayes(shape: Floats, values: Floats, size: float) -> float:
    """Of a change of this shape with prior sigma `size`, in units of the noise."""
    n = len(values)
    shape, values = shape - shape.mean(), values - values.mean()
    power, whole = float(shape @ shape), float(values @ values)
    if whole <= 0.0:
        return 0.0
    left = max(1.0 - float(shape @ values) ** 2 / (power * whole), 1e-12)
    gain = size * size * power
    return float(0.5 * (n - 2) * np.log1p(gain) - 0.5 * (n - 1) * np.log1p(gain * left))
