"""By when to calibrate again: the zeros that a file holds, look by look, and how fast they walk.

    z_i = a + b day_i + e_i,    e_i ~ N(0, s^2 std_i^2),    s^2 = (TRUSTED + chi^2) / nu,    nu = TRUSTED + n - 2
    by = day_n + left / (|b| + t_95(nu) sigma_b),           left = min(DRIFTED_MM - w, LARGEST_ZERO_MM - |z_n|)

where |b| > t(nu) sigma_b at CHANCE, of three looks or more; else nothing walks that one could see. The sigmas of the
looks are trusted as far as TRUSTED more of them would be (a prior of s^2; Gelman et al., Bayesian Data Analysis,
14.8): what friction holds at rest scatters, too. w: what it has walked since it was last taken off. A look at rest
takes it off; a zero that a tethered run found under load is hardly moved by one, so w is counted from that run, in
what was seen at rest. A transducer that was rigged anew begins a new series: its old zeros have to go.
"""

from datetime import date, timedelta
from math import sqrt
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from thrustd.core.calibration import DRIFTED_MM, LARGEST_ZERO_MM, Calibration, MountCalibration

LEAST_LOOKS = 3
CHANCE = 0.001  # that a zero which stays shows so much at one look; of four mounts in twenty looks 1 in 100
TRUSTED = 4.0
FARTHEST_DAYS = 36500


class Walk(NamedTuple):
    """How one mount's zero walks."""

    mount: str
    mm_day: float
    half_mm_day: float  # of its 95 % interval
    by: date
    again: str  # what takes it off: a look at rest, or the run that found it under load


def walks(calibration: Calibration) -> list[Walk]:
    """Of the mounts whose zero does, the soonest first."""
    found = [_walk(name, mount, calibration.tethered) for name, mount in calibration.mount.items()]
    return sorted((walk for walk in found if walk is not None), key=lambda walk: walk.by)


def recalibrate_by(calibration: Calibration) -> str | None:
    """The soonest date; None: no trend shows."""
    found = walks(calibration)
    return str(found[0].by) if found else None


def _walk(name: str, mount: MountCalibration, tethered: str | None) -> Walk | None:
    looks = mount.zeros
    if len(looks) < LEAST_LOOKS or looks[-1].on == looks[0].on:
        return None
    dates = [date.fromisoformat(look.on) for look in looks]
    days = np.array([(day - dates[0]).days for day in dates], float)
    mm, std_mm = np.array([(look.at_rest_mm, look.at_rest_std_mm) for look in looks]).T
    line, covariance = np.polyfit(days, mm, 1, w=1.0 / std_mm, cov="unscaled")
    freedom = TRUSTED + len(looks) - 2
    scatter2 = (TRUSTED + float(np.sum(((mm - np.polyval(line, days)) / std_mm) ** 2))) / freedom
    rate, std = abs(float(line[0])), sqrt(covariance[0, 0] * scatter2)
    if rate < stdtrit(freedom, 1.0 - 0.5 * CHANCE) * std:
        return None
    fastest = rate + float(stdtrit(freedom, 0.975)) * std
    under_load = mount.gain_std is not None and tethered is not None
    since_mm = next((look.at_rest_mm for look in looks if look.on >= str(tethered)), mm[-1]) if under_load else mm[-1]
    left_mm = max(min(DRIFTED_MM - abs(float(mm[-1] - since_mm)), LARGEST_ZERO_MM - abs(float(mm[-1]))), 0.0)
    days_left = min(int(left_mm / fastest), FARTHEST_DAYS)
    again = "tethered run" if under_load else "zero"
    return Walk(name, float(line[0]), fastest - rate, dates[-1] + timedelta(days=days_left), again)
