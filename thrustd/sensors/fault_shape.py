"""How what a fault does to one row of the past goes with what it does to another: lower factors (n, n).

fault           Matern 3/2 in time and in thrust: what drifts, sticks or is scaled has a slope; the thrust is that
                of those who are well then
installation    see `errors`
"""

from math import exp

import numpy as np

from thrustd.core.aircraft import Installed
from thrustd.core.columns import Floats
from thrustd.core.jit import compiled
from thrustd.sensors.errors import installed_n2
from thrustd.sensors.past import COUNTS, LEVEL_N, LOWER, SAID, T_S, UPPER
from thrustd.sensors.positive import factor

FAULT_REACH_N = 4000.0
FAULT_S, LASTING_S = 300.0, 20_000.0  # of a fault since its onset, of one that was always there
ROUGH = 0.01  # of a fault goes with nothing: a mount that lags is shaken by loads that it does not show
ROOT_3 = 3.0**0.5


@compiled
def smooth(far: float) -> float:
    """Matern's correlation of order 3/2."""
    return (1.0 + ROOT_3 * far) * exp(-ROOT_3 * far)


@compiled
def by_mounts_n(rows: Floats, n: int) -> Floats:
    """(n,) thrust where all that is known by engine data is wrong."""
    level_n = rows[:n, LEVEL_N].copy()
    for i in range(n):
        if rows[i, COUNTS + UPPER] * rows[i, COUNTS + LOWER] != 0.0:
            level_n[i] = rows[i, SAID + UPPER] + rows[i, SAID + LOWER]
    return level_n


@compiled
def fault_shape(rows: Floats, level_n: Floats, lasts_s: float) -> Floats:
    """Lower factor (n, n) of how what a fault does to one row goes with what it does to another."""
    n = len(level_n)
    shape = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            apart_s, moved_n = abs(rows[i, T_S] - rows[j, T_S]), abs(level_n[i] - level_n[j])
            shape[i, j] = smooth(apart_s / lasts_s) * smooth(moved_n / FAULT_REACH_N)
        shape[i, i] += ROUGH**2
    factor(shape, n)
    return shape


@compiled
def installed_shape(rows: Floats, n: int, installed: Installed) -> Floats:
    """Lower factor (n, n) of what an installation may do to both mounts that no bench has shown."""
    shape = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            shape[i, j] = installed_n2(rows, i, j, installed)
        shape[i, i] += 1.0
    factor(shape, n)
    return shape
