"""A quantity over service hours: does it change, since when, how fast.

Three hypotheses of a series y over hours h: nothing (a constant), a trend a + b h, a step after flight k. The two that
change something are judged by their F-test against nothing, k by as many tests as places it was looked for
(Bonferroni). A series is looked at after every flight, so ODDS, of a false alarm in one look, is small.
"""

from math import inf, nan
from typing import NamedTuple

import msgspec
import numpy as np
from scipy.special import fdtrc, stdtrit

from thrustd.core.columns import Floats

ODDS = 2e-4
FEWEST = 6  # flights before anything is said
EDGE = 3  # flights on either side of a step
TRIED = 2  # kinds of change


class Trend(msgspec.Struct, frozen=True):
    """95 % intervals; hours as given."""

    flights: int
    slope: float  # per hour
    slope_low: float
    slope_high: float
    change: float  # over all hours: of the trend, or of the step where that fits better
    kind: str  # steady, trend, step
    since_flight: int  # of a step: its first flight, counted from 1; else 0
    odds: float  # of so large a change by chance

    @property
    def changed(self) -> bool:
        return self.kind != "steady"


class Fit(NamedTuple):
    odds: float
    change: float
    since: int


def judge(hours: Floats, values: Floats, least: float = 0.0, odds: float = ODDS) -> Trend:
    """Of series (n,) over service hours; `least`: smaller changes are not named; `odds` of a
    false alarm in this look. NaN values are left out."""
    known = np.isfinite(values)
    hours, values = hours[known], values[known]
    n = len(values)
    if n < FEWEST or np.ptp(hours) <= 0.0:
        return Trend(n, nan, nan, nan, nan, "steady", 0, 1.0)
    slope, half = _line(hours, values)
    found = min(_trend(hours, values), _step(values), key=lambda fit: fit.odds)
    kind = "steady"
    if found.odds < odds and abs(found.change) >= least:
        kind = "step" if found.since else "trend"
    since = int(np.flatnonzero(known)[found.since]) + 1 if kind == "step" else 0
    change = found.change if kind != "steady" else slope * float(np.ptp(hours))
    return Trend(n, slope, slope - half, slope + half, change, kind, since, min(found.odds, 1.0))


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


def _trend(hours: Floats, values: Floats) -> Fit:
    slope, _ = _line(hours, values)
    off = values - values.mean()
    rest = off - slope * (hours - hours.mean())
    return Fit(TRIED * _odds(float(off @ off), float(rest @ rest), len(values)), slope * float(np.ptp(hours)), 0)


def _step(values: Floats) -> Fit:
    """The best place for a step."""
    n = len(values)
    places = range(EDGE, n - EDGE + 1)
    off = values - values.mean()
    sums = [(float(values[k:].mean() - values[:k].mean()), k) for k in places]
    explained = [change**2 * k * (n - k) / n for change, k in sums]
    best = int(np.argmax(explained))
    change, k = sums[best]
    whole = float(off @ off)
    return Fit(TRIED * len(sums) * _odds(whole, whole - explained[best], n), change, k)


def _odds(before: float, after: float, n: int) -> float:
    """Of an F as large as this, one number more among n values."""
    if after <= 1e-12 * max(before, 1e-300):
        return 0.0 if before > 0.0 else 1.0
    return float(fdtrc(1, n - 2, (before - after) / after * (n - 2)))
