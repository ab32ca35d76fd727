"""What the sources of one engine say at one instant, as a row of the past."""

from math import exp, isfinite, nan, sqrt
from typing import Any, NamedTuple

import numpy as np

from thrustd.core.aircraft import NO_MOUNT, Installed
from thrustd.core.columns import Flags, Floats, Integers
from thrustd.core.jit import compiled
from thrustd.sensors.motion import Motion
from thrustd.sensors.past import (
    COMMON_N,
    COUNTS,
    DECK_N,
    JUMPED_N,
    LEVEL_N,
    LOG_FLOW,
    MACH,
    MORE_G,
    MOUNT_RATE_N_S,
    N_SOURCES,
    OWN_N,
    PER_FUEL_N,
    PRESSURE_PA,
    SAID,
    STEP_N,
    WIDTH,
)

SCALE_HEIGHT_M = 8500.0  # of the pressure, near enough for what a drag may be


class Engines(NamedTuple):
    """Where an engine's readings are, and what holds for a whole flight."""

    mounts: Integers  # (n, 2)
    spools: Integers  # (n, 2)
    air: Integers  # places of Mach number, altitude, what else `air_leaves` reads, load factor: LEAVES
    shares: Floats  # (n,)
    off: Floats  # (N_HYPOTHESES, N_SOURCES) 1: excluded
    installed: Installed
    motion: Motion


@compiled
def row_of(
    engines: Engines, jump: Any, e: int, readings: Floats, states: Any, deck_n: Floats, trusted: Flags
) -> Floats:
    """What an engine's sources say now: (WIDTH,), see `past`; the time is left out."""
    row, mounts = np.zeros(WIDTH), engines.mounts
    mach, altitude_m = readings[engines.air[0]], readings[engines.air[1]]
    row[MACH], row[DECK_N] = mach if isfinite(mach) else 0.0, deck_n[e, 3]
    row[PRESSURE_PA] = 70_927.5 * row[MACH] ** 2 * exp(-(altitude_m if isfinite(altitude_m) else 0.0) / SCALE_HEIGHT_M)
    row[MORE_G] = readings[engines.air[4]] - 1.0 if isfinite(readings[engines.air[4]]) else 0.0
    row[PER_FUEL_N], row[LOG_FLOW] = deck_n[e, 4], deck_n[e, 5]
    if not isfinite(row[DECK_N] + row[LOG_FLOW]):  # nobody asks the deck
        row[DECK_N], row[PER_FUEL_N], row[LOG_FLOW] = 200.0, 5000.0, -2.5
    for i in range(N_SOURCES):
        there = i >= 2 or mounts[e, i] != NO_MOUNT
        said_n = deck_n[e, i - 2] if i >= 2 else states[mounts[e, i]].force_n if there else nan
        row[SAID + i], row[COUNTS + i] = said_n, 1.0 if trusted[e, i] and there else 0.0
    row[MOUNT_RATE_N_S], row[STEP_N] = jump.could_n, jump.step_n
    for i in range(2):
        row[LEVEL_N] += row[SAID + i] if isfinite(row[SAID + i]) else 0.0  # until there is a past: see `remember`
        state, row[JUMPED_N + i] = states[mounts[e, i]], jump.jumped_n[i]
        row[COMMON_N + i] = state.common_n if isfinite(state.common_n) else 0.0
        row[OWN_N + i] = sqrt(max(state.std_n**2 - state.common_n**2, 1.0)) if isfinite(state.std_n) else 100.0
    return row
