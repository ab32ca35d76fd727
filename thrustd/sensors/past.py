"""What the five sources of one engine's thrust said lately: a few rows, closer together the younger they are.

The sources are forces of the upper and the lower mount, and thrust by fuel flow, by N1 and by N2. A row is one
fused step's. When there is no room the row goes that is missed least: the one whose neighbours are nearest to
each other, as a part of their age. So N_ROWS rows reach from now to the engine's start, each some
two or three times as old as the one before it.
"""

from collections.abc import Mapping
from math import exp, hypot, isfinite, nan
from typing import Any

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.jit import compiled

UPPER, LOWER, FUEL_FLOW, N1, N2 = range(5)
N_SOURCES = 5
LONG_AGO_S = -1e12
N_ROWS = 10
LAG_FADES_S, FUEL_LAG_FADES_S = 8.0, 0.5  # fuel flow and spools find together after a throttle moved
UNKNOWN_RATE_N_S = 300.0  # nobody saw what the throttle did before
ABSURD_N = 15_000.0  # 11 kN at take-off: no thrust of this engine
MOUNT_LEAD_FADES_S = 1.0
LEVEL_PART = 0.2  # low pass of the level whose rate is taken
RATE_PART = 0.3  # sensor noise is no throttle movement: the rate rises over a few rows
SEEN_S = 1.0  # at most from row to row: what moved in a longer pause may have moved as late as that, nobody saw it
# one row: time, thrust level, its recent rate, those of fuel flow and mounts, Mach, dynamic pressure;
# then by source what it said and whether it counts; sigmas of the mounts and the deck; since the row before, how far
# each mount jumped, what a thrust moves within a step, what the fuel flow moved by that no mount showed (see `jumps`),
# and that of the rows about it when they were the newest;
# what the deck makes of the corrected fuel flow w: dF/d ln w, ln w;
# what the accelerometer shows; how far the Mach number changed, or stood while it accelerated, all added up;
# load factor beyond 1 g; thrust by the aircraft's motion, whether it counts, sigma of the other engines',
# and by how much it trembles from row to row (see `motion`)
T_S, LEVEL_N, RATE_N_S, FUEL_RATE_N_S, MOUNT_RATE_N_S, MACH, PRESSURE_PA = range(7)
SAID, COUNTS = 7, 7 + N_SOURCES
OWN_N, COMMON_N, DECK_N = COUNTS + N_SOURCES, COUNTS + N_SOURCES + 2, COUNTS + N_SOURCES + 4
JUMPED_N, STEP_N, FUELLED_N, FOLLOWED_N = DECK_N + 1, DECK_N + 3, DECK_N + 4, DECK_N + 5
PER_FUEL_N, LOG_FLOW = FOLLOWED_N + 1, FOLLOWED_N + 2
ALONG_G, AIR_MACH = LOG_FLOW + 1, LOG_FLOW + 2
MORE_G = AIR_MACH + 1
BY_MOTION_N, MOVES, OTHERS_STD_N, SHAKES_N = range(MORE_G + 1, MORE_G + 5)
WIDTH = SHAKES_N + 1

PAST = np.dtype(
    [
        ("n", np.int64),
        ("rows", np.float64, (N_ROWS + 1, WIDTH)),  # the newest first; the last one is room for the next
        ("lagged_n", np.float64, N_SOURCES + 1),  # thrust by each source, low-passed; by fuel flow, as it came
        ("rate_n_s", np.float64, 3),  # and of the mounts
        ("since_s", np.float64),  # the engine was seen to start then; NaN: it does not turn
    ]
)


def no_past(n_engines: int) -> Any:
    """(n_engines,) of PAST."""
    past = np.zeros(n_engines, PAST)
    past["lagged_n"], past["rate_n_s"][:, :2] = nan, UNKNOWN_RATE_N_S
    past["since_s"] = LONG_AGO_S  # one that is found turning
    return past


def told(memory: Any) -> dict[str, Any]:
    """All of one engine's, JSON-able: NaN is null. Whoever goes on from it has been away, and forgot nothing."""
    numbers = {name: memory[name].tolist() for name in ("lagged_n", "rate_n_s")} | {
        "since_s": [memory["since_s"].item()]
    }
    plain = {name: [x if isfinite(x) else None for x in row] for name, row in numbers.items()}
    return {"rows": memory["rows"][: memory["n"]].tolist(), **plain}


def recalled(said: Mapping[str, Any], shift_s: float) -> Any:
    """(1,) of PAST, as `told`, its times moved by so much. KeyError, TypeError or ValueError when it is none."""
    past, rows = no_past(1), np.array(said["rows"], np.float64).reshape(-1, WIDTH)
    if len(rows) > N_ROWS or not np.isfinite(rows).all():
        raise ValueError("no rows of a past")
    rows[:, T_S] += shift_s
    past["n"], past["rows"][0, : len(rows)] = len(rows), rows
    for name in ("lagged_n", "rate_n_s"):
        past[name][0] = np.array(said[name], np.float64).reshape(past[name].shape[1])
    past["since_s"] = np.array(said["since_s"], np.float64).reshape(1) + shift_s
    if not np.isfinite(past["rate_n_s"]).all():
        raise ValueError("no rates of a past")
    return past


@compiled
def _least_missed(rows: Floats, n: int) -> int:
    """Neither the newest nor the oldest of n rows."""
    best, least = n - 1, 1e300
    for i in range(1, n - 1):
        apart = (rows[i - 1, T_S] - rows[i + 1, T_S]) / (rows[0, T_S] - rows[i + 1, T_S])
        if apart < least:
            best, least = i, apart
    return best


@compiled
def median(values: Floats, n: int) -> float:
    """Of the first n; they are sorted in place."""
    for i in range(1, n):
        for j in range(i, 0, -1):
            if values[j] < values[j - 1]:
                values[j], values[j - 1] = values[j - 1], values[j]
    return values[n // 2] if n % 2 else (values[n // 2 - 1] + values[n // 2]) / 2


@compiled
def _rate_n_s(memory: Any, thrusts_n: Floats, dt_s: float) -> float:
    """The largest lately of a low-passed thrust: what the sources (N_SOURCES,) rise by, in the median; NaN is silent.

    Of one that jumps alone no engine moves.
    """
    moved_n, n = np.empty(N_SOURCES), 0
    for i in range(N_SOURCES):
        if isfinite(thrusts_n[i] - memory.lagged_n[i]):
            moved_n[n], n = LEVEL_PART * (thrusts_n[i] - memory.lagged_n[i]), n + 1
            memory.lagged_n[i] += moved_n[n - 1]
        else:
            memory.lagged_n[i] = thrusts_n[i]
    if n > 0 and dt_s > 0.0:
        rate_n_s = abs(median(moved_n, n)) / dt_s
        if rate_n_s > memory.rate_n_s[0]:
            memory.rate_n_s[0] += RATE_PART * (rate_n_s - memory.rate_n_s[0])
        else:
            memory.rate_n_s[0] -= memory.rate_n_s[0] * min(dt_s / LAG_FADES_S, 1.0)
    return float(memory.rate_n_s[0])


@compiled
def _mount_rate_n_s(memory: Any, moved_n: float, dt_s: float) -> float:
    """Of both mounts, which see a throttle that is cut before anybody else."""
    if dt_s > 0.0:
        fading_n_s = memory.rate_n_s[2] * exp(-dt_s / MOUNT_LEAD_FADES_S)
        memory.rate_n_s[2] = max(moved_n / dt_s, fading_n_s)
    return float(memory.rate_n_s[2])


@compiled
def fuelled_n(rows: Floats, m: int) -> float:
    """What the fuel flow moved by about row m - 1 that no mount showed; one that rises lets no thrust fall."""
    newest, oldest, fuel = max(m - 2, 0), m, SAID + FUEL_FLOW
    moved_n = float(np.sum(rows[newest : m + 1, FUELLED_N]))
    if m + 1 < len(rows) and rows[m + 1, COUNTS + FUEL_FLOW] != 0.0 and rows[m + 1, T_S] < rows[m, T_S]:
        oldest = m + 1  # a row that is there
    return 0.0 if moved_n * (rows[newest, fuel] - rows[oldest, fuel]) < 0.0 else moved_n


@compiled
def _keep(memory: Any, row: Floats) -> None:
    """In front of all; without room the row goes that is missed least, and leaves its jumps to the next newer one.

    A throttle that is cut and opened again leaves no trace of its fuel flow between rows that are minutes apart.
    """
    rows = memory.rows
    for i in range(memory.n, 0, -1):
        rows[i] = rows[i - 1]
    rows[0] = row
    memory.n += 1
    for m in range(1, min(memory.n, 3)):
        rows[m - 1, FOLLOWED_N] = fuelled_n(rows, m)
    if memory.n > N_ROWS:
        memory.n -= 1
        missed = _least_missed(rows, N_ROWS + 1)
        one_n, other_n = rows[missed - 1, STEP_N], rows[missed, STEP_N]
        one, other = rows[missed - 1, JUMPED_N:STEP_N].any(), rows[missed, JUMPED_N:STEP_N].any()
        rows[missed - 1, STEP_N] = hypot(one_n, other_n) if one and other else max(one_n, other_n)
        one_n, other_n = rows[missed - 1, FOLLOWED_N], rows[missed, FOLLOWED_N]
        rows[missed - 1, FOLLOWED_N] = (one_n if one else 0.0) + (other_n if other else 0.0)
        rows[missed - 1, JUMPED_N:STEP_N] += rows[missed, JUMPED_N:STEP_N]
        rows[missed - 1, FUELLED_N] += rows[missed, FUELLED_N]
        for i in range(missed, N_ROWS):
            rows[i] = rows[i + 1]


@compiled
def _smoothly_n(row: Floats, before: Floats) -> float:
    """What both mounts moved by from one row to the next, their jumps left out."""
    moved_n = 0.0
    for i in range(2):
        if row[COUNTS + i] != 0.0 and before[COUNTS + i] != 0.0:
            moved_n += row[SAID + i] - before[SAID + i] - row[JUMPED_N + i]
    return moved_n


@compiled
def remember(past: Any, e: int, row: Floats, share: float) -> bool:
    """Put a row (WIDTH,) in front; its level and rates are found here. False: fewer than two sources speak.

    For the mounts' rate stands what the thrust may have moved by since the row before, N.
    """
    memory, values, thrusts_n, n = past[e], np.empty(N_SOURCES), np.full(N_SOURCES, nan), 0
    parts = share, 1.0 - share, 1.0, 1.0, 1.0
    for i in range(N_SOURCES):
        if row[COUNTS + i] != 0.0 and abs(row[SAID + i]) < parts[i] * ABSURD_N:  # NaN is not
            thrusts_n[i] = row[SAID + i] / parts[i]
            values[n], n = thrusts_n[i], n + 1
        else:
            row[SAID + i] = row[COUNTS + i] = 0.0
    if n < 2:
        return False
    level_n = median(values, n)
    rows, dt_s = memory.rows, min(row[T_S] - memory.rows[0, T_S], SEEN_S) if memory.n > 0 else 0.0
    fuel_n = row[SAID + FUEL_FLOW] if row[COUNTS + FUEL_FLOW] != 0.0 else level_n
    row[LEVEL_N], row[RATE_N_S] = level_n, _rate_n_s(memory, thrusts_n, dt_s)
    fuelled_n = fuel_n - memory.lagged_n[N_SOURCES]
    if dt_s > 0.0 and isfinite(fuelled_n):
        row[FUELLED_N] = fuelled_n - _smoothly_n(row, rows[0])
        jumped_n = abs(np.sum(row[JUMPED_N:STEP_N]) + np.sum(rows[0, JUMPED_N:STEP_N]))
        row[MOUNT_RATE_N_S] = abs(row[MOUNT_RATE_N_S]) + min(jumped_n, abs(fuelled_n))
    row[MOUNT_RATE_N_S] = _mount_rate_n_s(memory, row[MOUNT_RATE_N_S], dt_s)
    fuel_rate_n_s = abs(fuelled_n) / dt_s if dt_s > 0.0 else 0.0
    memory.rate_n_s[1] *= exp(-dt_s / FUEL_LAG_FADES_S)
    if isfinite(fuel_rate_n_s):
        memory.rate_n_s[1] = max(memory.rate_n_s[1], fuel_rate_n_s)  # a fuel flow steps before anything follows
    memory.lagged_n[N_SOURCES], row[FUEL_RATE_N_S] = fuel_n, memory.rate_n_s[1]
    _keep(memory, row)
    return True
