"""One sensor on its own: dead, stuck, noisy, a jump that stays, a rate that the aircraft cannot have.

Stepped at 10 Hz, all sensors at once. Fuel flow, N1 and N2 of one engine go together: who rests alone lies; who jumps
alone is weighed in `bank`, for a fuel flow leads its spools. A larger jump is doubted at once (the sensor is left out)
and judged CONFIRM_S later: if the signal stays where it jumped to, it is an offset; if it came back it was a spike, or
if the aircraft may have gone there meanwhile. What was dead, stuck or noisy is trusted where it comes to rest.
A sensor that is read once a second rests in between: three jumps within some seconds are its noise, and a jump of it is
judged later.
"""

from math import isfinite
from typing import Any

import numpy as np
from msgspec.structs import astuple

from thrustd.core.aircraft import SensorLimits
from thrustd.core.columns import Floats
from thrustd.core.jit import compiled
from thrustd.sensors.limits import ALONE_STUCK_S, FLYING_MACH, TURNING_N1_PCT
from thrustd.sensors.monitor_inputs import ENGINE_SIGNALS
from thrustd.sensors.watch_row import (
    AWAY,
    CALM,
    DEAD,
    DRIFT,
    DRIFT_STEPS,
    FROM,
    HEALTHY,
    JUMP,
    JUMPS,
    KIND,
    KINDS,
    LAST,
    LONGEST,
    MISSING,
    N_BENDS,
    N_VALUES,
    NOISY,
    OFFSET,
    RESTING,
    SEEN,
    SINCE_JUMP,
    STEP_S,
    STUCK,
    WATCHED,
    append,
    is_noisy,
)

DEAD_S = 1.0
CONFIRM_S, SELDOM_CONFIRM_S = 1.0, 2.5
JUMP_FADES_S, NOISY_JUMPS = 3.0, 2.0  # the third in a row, or of four readings
CALM_S = 5.0  # free of the symptom this long: trusted again
BACK_S = 0.5  # a sensor that was silent did not lie
LEARN_REST_S = 60.0  # watched for this long, a sensor has shown how long it may rest
REST_FACTOR = 4.0
SHORTEST_STUCK_S = 6.0
JUMP_LIMIT, NOISE_LIMIT, STUCK_LIMIT, RATE_LIMIT, LOW, HIGH, _, MOVES = range(8)  # the fields of SensorLimits
WITNESS_STEPS = 10
N1, N2, PER_ENGINE = ENGINE_SIGNALS.index("n1_pct"), ENGINE_SIGNALS.index("n2_pct"), len(ENGINE_SIGNALS)


class SignalWatch:
    """What one sensor's row says; the row is stepped by `watch`."""

    __slots__ = ("_row",)

    def __init__(self, row: Floats) -> None:
        self._row = row

    @property
    def kind(self) -> str:
        """The fault that is present, or ""."""
        return KINDS[int(self._row[KIND])]

    @property
    def doubted(self) -> bool:
        """A jump waits for its verdict."""
        return bool(self._row[JUMP] != 0.0 and self._row[KIND] != OFFSET)

    @property
    def jumped_lately(self) -> bool:
        """Most of the last seconds' change came at once: within two steps."""
        return bool(_jumped_lately(self._row))

    @property
    def resting_s(self) -> float:
        """How long the same value has been repeated."""
        return self._row.item(RESTING)

    def change(self, steps: int) -> float:
        """Change over the last `steps` steps; 0 when unknown."""
        row = self._row
        return row.item(LAST) - row.item(LAST - steps) if row.item(N_VALUES) > steps else 0.0

    def step_to(self, value: float) -> float:
        """From the newest value seen to this one; 0 when there is none (NaN stays NaN)."""
        return value - self._row.item(LAST) if self._row.item(N_VALUES) > 0 else 0.0

    def acquit(self) -> None:
        """The jump in doubt was no fault: others made it too. One that was judged already stays judged."""
        if self._row[KIND] != OFFSET:
            self._row[JUMP] = 0.0


def limit_rows(limits: list[SensorLimits]) -> Floats:
    """(n, 8), one row per sensor."""
    return np.array([astuple(each) for each in limits], dtype=np.float64)


@compiled
def _jumped_lately(row: Floats) -> bool:
    n = int(row[N_VALUES])
    if n < 2:
        return False
    recent = row[LAST + 1 - n : LAST + 1]
    largest = 0.0
    for i in range(1, n):  # a jump between the samples of one step shows as two half jumps
        largest = max(largest, abs(recent[i] - recent[i - 1]), abs(recent[i] - recent[max(i - 2, 0)]))
    return largest >= 0.5 * (recent.max() - recent.min())


@compiled
def _set(row: Floats, symptom: float) -> None:
    if symptom != HEALTHY:
        row[KIND], row[CALM] = symptom, 0.0
    elif row[KIND] != HEALTHY:
        row[CALM] += STEP_S
        if row[CALM] >= (BACK_S if row[KIND] == DEAD else CALM_S):
            row[KIND] = HEALTHY


@compiled
def _forget_where(row: Floats) -> None:
    """One that comes back to life, or to rest, is where the others are, not where it was."""
    if row[KIND] == DEAD or row[KIND] == STUCK or row[KIND] == NOISY:
        row[JUMP] = 0.0


@compiled
def _miss(row: Floats) -> None:
    row[MISSING] += STEP_S
    row[N_VALUES] = 0.0
    if row[MISSING] >= DEAD_S:  # one that scatters beyond its range is heard now and then
        row[N_BENDS] = 0.0
    _set(row, DEAD if row[SEEN] != 0.0 and row[MISSING] >= DEAD_S else row[KIND])
    _forget_where(row)


@compiled
def _watch_rest(row: Floats, value: float, active: bool) -> None:
    if row[N_VALUES] > 0 and value == row[LAST]:
        row[RESTING] += STEP_S
        return
    if active and row[KIND] != STUCK:
        row[WATCHED] += STEP_S + row[RESTING]
        row[LONGEST] = max(row[LONGEST], row[RESTING])
    row[RESTING] = 0.0


@compiled
def _watch_jump(row: Floats, value: float, limit: float, confirm_s: float) -> None:
    row[SINCE_JUMP] += STEP_S
    row[AWAY] += STEP_S
    row[JUMPS] = max(row[JUMPS] - STEP_S / JUMP_FADES_S, 0.0)
    if row[N_VALUES] == 0 and row[JUMP] == 0.0:
        return
    if abs(value - row[LAST]) <= limit:
        return
    rested = row[SINCE_JUMP] > 1.5 * STEP_S  # one that scatters comes by its old place, too
    was_back = rested and row[JUMP] == 0.0 and abs(row[LAST] - row[FROM]) <= limit
    if was_back or row[SINCE_JUMP] >= confirm_s:
        row[FROM], row[AWAY] = row[LAST] - row[JUMP], STEP_S
    row[SINCE_JUMP] = 0.0
    row[JUMPS] = min(row[JUMPS], NOISY_JUMPS) + 1.0  # what is noisy gets no noisier
    left = value - row[FROM]  # of all jumps together: the way back may be several, or go too far first
    row[JUMP] = 0.0 if abs(left) <= max(0.4 * abs(row[JUMP]), limit) else left


@compiled
def _confirm_s(limits: Floats) -> float:
    return CONFIRM_S if isfinite(limits[NOISE_LIMIT]) else SELDOM_CONFIRM_S


@compiled
def _offset(row: Floats, value: float, limit: float, confirm_s: float) -> bool:
    if row[JUMP] == 0.0 or row[KIND] == OFFSET:
        return row[JUMP] != 0.0
    if row[SINCE_JUMP] < confirm_s:
        return False
    could = limit * (row[AWAY] - row[SINCE_JUMP]) / STEP_S  # what the aircraft may have done meanwhile
    if abs(value - row[FROM]) > 0.5 * abs(row[JUMP]) and abs(row[JUMP]) > could:
        return True
    row[JUMP] = 0.0
    return False


@compiled
def _stuck_s(row: Floats, longest_s: float) -> float:
    """How long this sensor may repeat one value."""
    if row[WATCHED] < LEARN_REST_S:
        return longest_s
    return min(longest_s, max(REST_FACTOR * row[LONGEST], SHORTEST_STUCK_S))


@compiled
def _drifts(row: Floats, rate_limit: float) -> bool:
    if row[N_VALUES] <= DRIFT_STEPS:
        return False
    return abs(row[LAST] - row[LAST - DRIFT_STEPS]) > rate_limit * DRIFT_STEPS * STEP_S and not _jumped_lately(row)


@compiled
def _symptom(row: Floats, limits: Floats, value: float, active: bool, longest_rest_s: float) -> float:
    if active and row[RESTING] >= _stuck_s(row, longest_rest_s):
        return STUCK
    if is_noisy(row, limits[NOISE_LIMIT]) if isfinite(limits[NOISE_LIMIT]) else row[JUMPS] >= NOISY_JUMPS:
        return NOISY
    if _offset(row, value, limits[JUMP_LIMIT], _confirm_s(limits)):
        return OFFSET
    judging = row[JUMP] != 0.0 or row[JUMPS] > 1.0  # an offset or noise: not known yet which
    if not judging and (_drifts(row, limits[RATE_LIMIT]) or not limits[LOW] <= value <= limits[HIGH]):
        return OFFSET if _jumped_lately(row) else DRIFT
    return HEALTHY


@compiled
def _moved(rows: Floats, limits: Floats, own: int, first: int, n_engines: int) -> int:
    """How many of the two other signals of the engine changed within the last second."""
    moved = 0
    for other in range(first + (own - first) % n_engines, first + PER_ENGINE * n_engines, n_engines):
        if other != own and rows[other, N_VALUES] > WITNESS_STEPS:
            moved += abs(rows[other, LAST] - rows[other, LAST - WITNESS_STEPS]) > limits[other, MOVES]
    return moved


@compiled
def _limit(rows: Floats, limits: Floats, values: Floats, n_mounts: int, n_engines: int) -> tuple[Floats, Any]:
    """Longest rest of each sensor now, and whether it is alive: flying, engine turning."""
    rest_s, active = limits[:, STUCK_LIMIT].copy(), np.ones(len(rows), np.bool_)
    after = n_mounts + PER_ENGINE * n_engines
    for i in range(n_mounts, after):
        if _moved(rows, limits, i, n_mounts, n_engines) == PER_ENGINE - 1:
            rest_s[i] = ALONE_STUCK_S
        n1 = n_mounts + (i - n_mounts) % n_engines + N1 * n_engines
        active[i] = values[n1] > TURNING_N1_PCT or values[n1 + (N2 - N1) * n_engines] > TURNING_N1_PCT
    active[after:] = values[after] > FLYING_MACH
    return rest_s, active


def _watch(rows: Floats, limits: Floats, values: Floats, n_mounts: int, n_engines: int) -> bool:
    """One step of every sensor, in place, in the order of `Layout.sensors`. -> some sensor is suspect."""
    suspect = False
    rest_s, active = _limit(rows, limits, values, n_mounts, n_engines)
    for i in range(len(rows)):
        row, value = rows[i], values[i]
        if isfinite(value):
            row[SEEN], row[MISSING] = 1.0, 0.0
            _watch_jump(row, value, limits[i, JUMP_LIMIT], _confirm_s(limits[i]))
            _watch_rest(row, value, active[i])
            append(row, value)
            _set(row, _symptom(row, limits[i], value, active[i], rest_s[i]))
            _forget_where(row)
        else:
            _miss(row)
        suspect |= row[KIND] != HEALTHY or row[JUMP] != 0.0
    return suspect


def _find_leap(rows: Floats, limits: Floats, values: Floats) -> bool:
    """Some sensor is further from its newest value than it may jump."""
    for i in range(len(rows)):
        if rows[i, N_VALUES] > 0 and abs(values[i] - rows[i, LAST]) > limits[i, JUMP_LIMIT]:
            return True
    return False


watch: Any = compiled(_watch, "b1(f8[:, ::1], f8[:, ::1], f8[::1], i8, i8)")
leapt: Any = compiled(_find_leap, "b1(f8[:, ::1], f8[:, ::1], f8[::1])")
