"""Five opinions on one engine's thrust check each other: two mounts, fuel flow, N1 and N2.

    consensus  c   = median of (o_i - b_i s),          s = max(|c|, 2500 N)
    deviation  d_i = (o_i - c) / s - b_i               b_i = what opinion i usually deviates by (slow average)

One opinion that stands alone outside its tolerance for a second, twice as far out as any other, is the faulty one:
the median of the others cannot be pulled by it. Tolerances open with the throttle, because fuel flow leads and spools
lag the thrust. When several opinions deviate at once the cause is something they share (air data, accelerations): see
`common_mode`.
"""

from math import isfinite, nan
from typing import Any

import numpy as np
import numpy.typing as npt

from thrustd.core.jit import compiled
from thrustd.sensors.limits import TURNING_N1_PCT
from thrustd.sensors.signal_watch import STEP_S

N_OPINIONS = 5
UPPER, LOWER, FUEL_FLOW, N1, N2 = range(N_OPINIONS)
TOLERANCE = (0.14, 0.14, 0.15, 0.14, 0.16)  # of the scale, steady: usual deviations change by 8 % with the throttle
LAG_S = (0.4, 0.4, 8.0, 1.5, 2.5)  # tolerance per relative thrust rate
SCALE_FLOOR_N = 2500.0
RATE_MEMORY_S = 8.0
C_PART = 0.2  # per step, of the consensus' low pass
ALONE_S = 1.0
ALONE_FACTOR = 2.0
AGREE_S = 10.0
LEARN_S = 20.0  # quick averages first
SLOW_S = 120.0
CALM_RATE = 0.02  # relative thrust rate below which the usual deviations are learnt, 1/s
GROUPS_DIFFER = 0.05  # mounts against brochure, relative: more is not usual
# the memory of one engine, a row of five for each; TRACK holds the low-passed consensus and the recent largest
# |dc/dt| / s
USUAL, AGE, DEVIATION, FAULTY, OUTSIDE, AGREE, TRACK = range(7)
LAST_C, RATE = range(2)
Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
Integers = npt.NDArray[np.int64]


class Opinions:
    """Mutable memory of every engine."""

    def __init__(self, mounts: Integers, spools: Integers) -> None:
        """By engine (n, 2): its mounts, the upper one first, -1 for none; and where N1 and N2 are among the readings.

        An engine that has not two mounts is not judged.
        """
        self._spools, self._judged = spools, (mounts >= 0).sum(axis=1) == 2
        self._rows = np.zeros((len(mounts), TRACK + 1, N_OPINIONS))
        # by engine, mounts minus brochure and its tolerance, relative; NaN when one group is silent
        self.differences = np.zeros((len(mounts), 2))
        # not excluded by the sensor's own watch
        self.believed = np.ones((len(mounts), N_OPINIONS), np.bool_)
        self.work = self._rows, self.differences, np.ascontiguousarray(mounts[:, :2]), spools, self._judged
        self.forget()

    def turning(self, engine: int, readings: Floats) -> bool:
        """It is judged: it has two mounts, and turns."""
        return bool(self._judged[engine] and (readings[self._spools[engine]] > TURNING_N1_PCT).any())

    def faulty(self, engine: int, i: int) -> bool:
        """It stood alone, and does not agree again yet."""
        return bool(self._rows[engine, FAULTY, i])

    def forget(self) -> None:
        """Nobody listened for a while."""
        self._rows[:, DEVIATION] = self._rows[:, TRACK, LAST_C] = nan

    def snapshot(self) -> list[list[list[float | None]]]:
        """By engine, rows of numbers; None for NaN, which JSON has not."""
        return [[[value if isfinite(value) else None for value in row] for row in rows] for rows in self._rows.tolist()]

    def restore(self, rows: Any) -> bool:
        """Take over a snapshot; False, and nothing changed, when it is none."""
        found = np.array(rows, dtype=np.float64)  # raises ValueError or TypeError on anything but rows of numbers
        if found.shape != self._rows.shape or np.isinf(found).any():
            return False
        self._rows[:] = found
        self.forget()
        return True


@compiled
def _median(values: Floats, n: int) -> float:
    """Of the first n; they are sorted in place."""
    for i in range(1, n):
        for j in range(i, 0, -1):
            if values[j] < values[j - 1]:
                values[j], values[j - 1] = values[j - 1], values[j]
    return values[n // 2] if n % 2 else (values[n // 2 - 1] + values[n // 2]) / 2


@compiled
def _tolerance(rows: Floats, i: int) -> float:
    young = 0.25 if rows[AGE, i] < LEARN_S else 0.0
    return TOLERANCE[i] + young + LAG_S[i] * rows[TRACK, RATE]


@compiled
def _track_rate(track: Floats, c: float, scale: float) -> None:
    if not isfinite(track[LAST_C]):
        track[LAST_C] = c
    moved_n = C_PART * (c - track[LAST_C])  # low-passed: sensor noise is no throttle movement
    track[LAST_C] += moved_n
    rate = abs(moved_n) / STEP_S / scale
    # one step of noise is not a throttle movement: rise over a few steps, fall slowly
    if rate > track[RATE]:
        track[RATE] += 0.3 * (rate - track[RATE])
    else:
        track[RATE] -= track[RATE] * STEP_S / RATE_MEMORY_S


@compiled
def _alone(rows: Floats, outside: Flags) -> int:
    """The only one outside, if it is twice as far out as any other; else -1."""
    alone, suspects, others = -1, 0, 0.0
    for i in range(N_OPINIONS):
        if outside[i] and rows[FAULTY, i] == 0.0:
            alone, suspects = i, suspects + 1
    for i in range(N_OPINIONS):
        if i != alone and rows[FAULTY, i] == 0.0 and isfinite(rows[DEVIATION, i]):
            others = max(others, abs(rows[DEVIATION, i]))
    return alone if suspects == 1 and abs(rows[DEVIATION, alone]) > ALONE_FACTOR * others else -1


@compiled
def _judge(rows: Floats, outside: Flags) -> None:
    alone = _alone(rows, outside)
    for i in range(N_OPINIONS):
        rows[OUTSIDE, i] = rows[OUTSIDE, i] + STEP_S if i == alone else 0.0
        if rows[FAULTY, i] != 0.0:
            agrees = isfinite(rows[DEVIATION, i]) and not outside[i]
            rows[AGREE, i] = rows[AGREE, i] + STEP_S if agrees else 0.0
            if rows[AGREE, i] >= AGREE_S:
                rows[FAULTY, i] = rows[AGREE, i] = 0.0
        elif rows[OUTSIDE, i] >= ALONE_S - 1e-9:
            rows[FAULTY, i], rows[AGREE, i] = 1.0, 0.0


@compiled
def _learn(rows: Floats, usable: Flags) -> None:
    # at idle the deviations are zeros of transducers and the foot of the deck: they say little of other powers
    step_s = STEP_S * min(abs(rows[TRACK, LAST_C]) / SCALE_FLOOR_N, 1.0) ** 2
    for i in range(N_OPINIONS):
        if usable[i]:
            rows[AGE, i] += step_s
            tau_s = min(max(rows[AGE, i], 2.0), SLOW_S)
            rows[USUAL, i] += step_s / tau_s * rows[DEVIATION, i]


@compiled
def _deviate(rows: Floats, opinions_n: Floats, usable: Flags) -> bool:
    """Consensus and deviations; False when fewer than three speak."""
    values, n = np.empty(N_OPINIONS), 0
    for i in range(N_OPINIONS):
        if usable[i]:
            values[n], n = opinions_n[i], n + 1
    if n < 3:
        rows[TRACK, LAST_C], rows[DEVIATION] = nan, nan
        return False
    scale, k = max(abs(_median(values, n)), SCALE_FLOOR_N), 0
    for i in range(N_OPINIONS):
        if usable[i]:
            values[k], k = opinions_n[i] - rows[USUAL, i] * scale, k + 1
    c = _median(values, n)
    _track_rate(rows[TRACK], c, scale)
    for i in range(N_OPINIONS):
        rows[DEVIATION, i] = (opinions_n[i] - c) / scale - rows[USUAL, i]
    return True


@compiled
def _step_one(rows: Floats, opinions_n: Floats, believed: Flags, frozen: bool) -> None:
    usable, outside = np.zeros(N_OPINIONS, np.bool_), np.zeros(N_OPINIONS, np.bool_)
    for i in range(N_OPINIONS):
        usable[i] = believed[i] and rows[FAULTY, i] == 0.0 and isfinite(opinions_n[i])
    if _deviate(rows, opinions_n, usable):
        if frozen:
            rows[OUTSIDE] = 0.0
        else:
            for i in range(N_OPINIONS):
                deviation = abs(rows[DEVIATION, i])
                outside[i] = believed[i] and isfinite(deviation) and deviation > _tolerance(rows, i)
            _judge(rows, outside)
            if not outside.any() and rows[TRACK, RATE] < CALM_RATE:
                _learn(rows, usable)


@compiled
def _difference(rows: Floats) -> tuple[float, float]:
    mounts = brochure = widest = 0.0
    n_mounts = n_routes = 0
    for i in range(N_OPINIONS):
        if rows[FAULTY, i] != 0.0 or not isfinite(rows[DEVIATION, i]):
            continue
        if i <= LOWER:
            mounts, n_mounts = mounts + rows[DEVIATION, i], n_mounts + 1
        else:
            brochure, n_routes = brochure + rows[DEVIATION, i], n_routes + 1
            widest = max(widest, _tolerance(rows, i))
    if n_mounts == 0 or n_routes == 0:
        return nan, 0.0
    return mounts / n_mounts - brochure / n_routes, GROUPS_DIFFER + widest - TOLERANCE[FUEL_FLOW]


@compiled
def weigh(
    rows: Floats, differences: Floats, layout: Any, readings: Floats, states: Any, shares: Floats, routes_n: Floats,
    believed: Flags, frozen: bool,
) -> bool:  # fmt: skip
    """One opinion on some engine is faulty. An engine that does not turn has none.

    `layout`: mounts, spools and engines judged; `states`: MOUNT_STATE by mount; `shares` (n,) of the upper mounts,
    `routes_n` (n, 3), `believed` (n, 5); `frozen`: shared inputs are in doubt, judge nothing.
    """
    mounts, spools, judged = layout
    faulty, opinions_n = False, np.empty(N_OPINIONS)
    for e in range(len(rows)):
        turns = readings[spools[e, 0]] > TURNING_N1_PCT or readings[spools[e, 1]] > TURNING_N1_PCT
        if judged[e] and turns:
            opinions_n[UPPER] = states[mounts[e, 0]].force_n / shares[e]
            opinions_n[LOWER] = states[mounts[e, 1]].force_n / (1.0 - shares[e])
            opinions_n[FUEL_FLOW:] = routes_n[e]
            _step_one(rows[e], opinions_n, believed[e], frozen)
        faulty |= rows[e, FAULTY].any()
        differences[e] = _difference(rows[e])
    return faulty
