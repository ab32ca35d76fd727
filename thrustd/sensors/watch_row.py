"""What is remembered of one sensor, and the noise in it: a row of numbers, stepped by `signal_watch`.

Noise is the median of |second difference| over 2 s, which one jump cannot lift, of what turns back. What keeps its way
is none: a sender slides past our steps, and then one hears a value twice and the next leaves one out.
"""

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.jit import compiled

STEP_S = 0.1
DRIFT_STEPS = 30  # values remembered
TURNS = 0.713  # of white noise, which turns back two times in three: median |second difference| over that of those
HELD_S = 0.3  # a value repeated for so long may be one that comes seldom: what it bent by still holds
KINDS = ("", "dead", "stuck", "noisy", "offset", "drift")
HEALTHY, DEAD, STUCK, NOISY, OFFSET, DRIFT = (float(code) for code in range(len(KINDS)))
# the memory of one sensor, a row of numbers; JUMP is the size of the jump in doubt or confirmed, FROM the value before,
# AWAY how long ago that was, JUMPS how many there were, fading
KIND, SEEN, CALM, MISSING, JUMP, FROM, AWAY, SINCE_JUMP, RESTING, LONGEST, WATCHED, JUMPS, N_VALUES, N_BENDS = range(14)
VALUES, LAST = N_BENDS + 1, N_BENDS + DRIFT_STEPS + 1  # the newest at LAST, N_VALUES of them count
BENDS, LAST_BEND, WIDTH = LAST + 1, LAST + 19, LAST + 20  # |second differences|, the newest at LAST_BEND
NOISE_S = (WIDTH - BENDS) * STEP_S  # they cover


def fresh_rows(n: int) -> Floats:
    """(n, WIDTH), nothing seen yet."""
    rows = np.zeros((n, WIDTH))
    rows[:, SINCE_JUMP] = 1e9
    return rows


def is_sane(rows: Floats) -> bool:
    """Numbers that `watch` may have left."""
    counts = rows[:, (KIND, N_VALUES, N_BENDS)]
    most = len(KINDS) - 1, BENDS - VALUES, WIDTH - BENDS
    whole = bool(np.isfinite(rows).all()) and bool((counts == np.floor(counts)).all())
    return whole and bool((counts >= 0).all()) and bool((counts <= most).all())


@compiled
def _bend(row: Floats, value: float) -> float:
    """|Second difference| where the signal turns back, from its last move to this one; 0 where it goes on, or rests."""
    if value == row[LAST]:
        return row[LAST_BEND] if row[RESTING] < HELD_S else 0.0
    i, first = LAST, LAST + 1 - int(row[N_VALUES])
    while i > first and row[i] == row[i - 1]:
        i -= 1
    move, before = value - row[LAST], row[i] - row[max(i - 1, first)]
    return TURNS * abs(move - before) if move * before < 0.0 else 0.0


@compiled
def append(row: Floats, value: float) -> None:
    """One value more."""
    if row[N_VALUES] >= 2:
        bend = _bend(row, value)
        for i in range(BENDS, LAST_BEND):
            row[i] = row[i + 1]
        row[LAST_BEND] = bend
        row[N_BENDS] = min(row[N_BENDS] + 1, WIDTH - BENDS)
    for i in range(VALUES, LAST):
        row[i] = row[i + 1]
    row[LAST] = value
    row[N_VALUES] = min(row[N_VALUES] + 1, BENDS - VALUES)


@compiled
def is_noisy(row: Floats, limit: float) -> bool:
    """The median of a full 2 s, of which two thirds turn back, is above the limit."""
    above = 0
    for i in range(BENDS, WIDTH):
        above += row[i] > limit
    return row[N_BENDS] == WIDTH - BENDS and 3 * above > WIDTH - BENDS
