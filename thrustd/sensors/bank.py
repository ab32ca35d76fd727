"""The bank of hypotheses of every engine: who is at fault, how likely, and what the thrust is then.

    all well | upper LVDT | lower LVDT | both mounts | fuel flow | N1 | N2 | the brochure as a whole | air is bled
    | scale of both mounts | both spools | all but the spools | the installation
    on all engines at once: the accelerometer | air data

Every 0.4 s and engine the sources' past (see `past`) is weighed under each of them (see `evidence`). A fault is
found when its probability is above FOUND, and over when that is below OVER: the prior of a fault that was found is
that it stays, so agreement that says nothing (a throttle that opens every tolerance) does not end it.
"""

from collections.abc import Sequence
from math import isfinite, nan, sqrt
from typing import Any, NamedTuple

import numba
import numpy as np

from thrustd.core.aircraft import AircraftData, Installed
from thrustd.core.columns import MOUNT_STATE, Flags, Floats, Integers
from thrustd.core.jit import compiled, entry, named
from thrustd.fusion.mixture import SHIFT_N, STD_N, P
from thrustd.sensors.engine_force import MountCombiner
from thrustd.sensors.engine_row import Engines, row_of
from thrustd.sensors.errors import installed_n2
from thrustd.sensors.evidence import evidence, uncorrected_n2, weigh
from thrustd.sensors.jumps import JUMPS, follow, forget, no_jumps
from thrustd.sensors.kinematics import ACCELERATION, BALANCE, LEAVES, REFUTED, Bias, air_leaves
from thrustd.sensors.lead import keep_failure, lead_of, likely
from thrustd.sensors.motion import DOUBT, Motion, agree, all_moves, at_odds, motion_of, moves
from thrustd.sensors.onsets import (
    ACCELERATION_OFF,
    BLED,
    BROCHURE_OFF,
    FUEL_OFF,
    HEARD,
    INSTALLED_OFF,
    MOUNTS_OFF,
    N_ALONE,
    N_HYPOTHESES,
    NOBODYS,
    SOMEBODY,
    WELL,
)
from thrustd.sensors.past import (
    AIR_MACH,
    ALONG_G,
    COUNTS,
    JUMPED_N,
    LOWER,
    N1,
    N_SOURCES,
    PAST,
    SAID,
    T_S,
    UPPER,
    WIDTH,
    no_past,
    recalled,
    remember,
    told,
)
from thrustd.sensors.shared import weigh_shared

EVERY_LOOKS, UNCORRECTED_EVERY = 2, 4
DISAGREE = 0.3  # the hypotheses that were not found are as likely together: nothing tells who is right
BOTH, BROCHURE = (0, 1), (2, 3, 4)
SOURCES_OFF: tuple[tuple[int, ...], ...] = (
    (), (0,), (1,), BOTH, (2,), (3,), (4,), BROCHURE, (3, 4), (0, 1, 2), (), BOTH, (), BOTH, BROCHURE,
)  # fmt: skip
OFF = np.array([[float(source in off) for source in range(N_SOURCES)] for off in SOURCES_OFF])
BY_MOUNTS = 1.0 - OFF[:, UPPER] * OFF[:, LOWER]  # see `fusion.mixture.Weighed`
TURNING_N1_PCT, STARTED_S = 20.0, 15.0  # before that an engine starts: no deck says anything of it
UNCORRECTED_N = 2  # beside the thrust that leads and its sigma


class _Memory(NamedTuple):
    """By engine (n,); changed in place."""

    past: Any  # PAST
    jumps: Any  # JUMPS
    turn: Integers  # (1,)
    found: Integers
    anew: Integers  # 1: what it was found by counts no longer
    hypotheses: Floats  # (n, N_HYPOTHESES, 3) P, SHIFT_N, STD_N
    heard: Any  # HEARD
    leading: Floats  # (n, 3) thrust and its sigma by the one that leads; what is uncorrected, N
    air: Floats  # (4,) see `air_leaves`
    bias: Bias
    odds: Floats  # (n,) ln: what all mounts share is the accelerometer


class Bank:
    """Mutable; `snapshot` / `restore` for the checkpoint."""

    def __init__(
        self, combiner: MountCombiner, spools: Integers, air: Integers, aircraft: AircraftData, bias: Bias
    ) -> None:
        """By engine: places of N1 and N2 (n, 2); `air`: `Engines`.

        Of an engine with one mount nothing tells that mount from both: neither is found, and the band holds them.
        """
        mounts, shares = combiner.mounts, combiner.shares
        n = len(mounts)
        self._past, self.found, self._anew = no_past(n), np.zeros(n, np.int64), np.zeros(n, np.int64)
        self.rows = np.zeros((n, N_HYPOTHESES, 3))
        self.rows[:, WELL, P] = 1.0
        self.leading = np.full((n, 3), np.nan)
        self.leading[:, UNCORRECTED_N] = 0.0
        self._turn, self._air = np.zeros(1, np.int64), np.array((0.0, np.nan, np.nan, 0.0))
        own, self._odds = np.ascontiguousarray(mounts[:, :2]), np.zeros(n)
        self._jumps = no_jumps(n)
        springs, self._along = np.array((aircraft.spring_n_mm * 2)[:2]), int(air[LEAVES.index(ACCELERATION)])
        self._follow = self._jumps, own, shares, springs
        self._memory = _Memory(
            self._past, self._jumps, self._turn, self.found, self._anew, self.rows, np.zeros(n, HEARD), self.leading,
            self._air, bias, self._odds,
        )  # fmt: skip
        self._engines = Engines(own, spools, air, shares, OFF, aircraft.installed(), motion_of(aircraft))

    def follow(self, states: Any, dt_s: float, readings: Floats) -> None:
        """Call it at every fused step: what mounts and aircraft were moved by since the last one, `dt_s` ago."""
        follow(*self._follow, states, dt_s, readings.item(self._along))

    def look(self, t_ns: int, readings: Floats, states: Any, deck_n: Floats, trusted: Flags) -> int:
        """Weigh the engine whose turn it is. -> which one's leading hypothesis changed, or -1.

        `states`: MOUNT_STATE by mount; `deck_n` (n, 6): see `MonitorInputs`; `trusted` (n, 6): by the sensors' own
        watches, the accelerometer last.
        """
        return int(_look(self._memory, self._engines, t_ns * 1e-9, readings, states, deck_n, trusted))

    def disagree(self, engine: int) -> bool:
        """Nothing tells who is right; bled air and the installation are nobody's fault."""
        p, found = self.rows[engine, :, P].tolist(), self.found.item(engine)
        told = sum(p[which] for which in NOBODYS) if found in NOBODYS else likely.py_func(found, p)
        return bool(told < 1.0 - DISAGREE)

    def accelerometer(self) -> bool:
        """What all mounts share was found, and no motion of the aircraft refutes that it is the accelerometer."""
        return bool((self.found == ACCELERATION_OFF).any() and (self._odds > REFUTED).all())

    def apart_n(self) -> Floats:
        """(n, 2) by engine: the thrust by mounts alone minus that by all if these are only not installed as benched."""
        mounts, brochure = self.rows[:, BROCHURE_OFF], self.rows[:, INSTALLED_OFF]
        return np.stack([mounts[:, SHIFT_N] - brochure[:, SHIFT_N], np.hypot(mounts[:, STD_N], brochure[:, STD_N])], 1)

    def disbelieve(self, engine: int, sources: Sequence[int], since_s: float) -> None:
        """What these have said since then counts no longer: whoever was found by it is weighed anew."""
        rows = self._past["rows"][engine, : self._past["n"][engine]]
        self._anew[engine] |= not len(rows)  # what it was found by is gone
        for source in sources:
            said = [COUNTS + source, SAID + source, *([JUMPED_N + source] if source in BOTH else [])]
            lies = (rows[:, T_S] >= since_s) & rows[:, said].any(axis=1)
            rows[np.ix_(lies, said)] = 0.0
            self._anew[engine] |= lies.any()
            if source in BOTH:
                self._jumps["jumped_n"][engine, source] = 0.0

    def snapshot(self) -> list[dict[str, Any]]:
        """By engine, plain numbers."""
        engines = zip(self._past, self.found, self._memory.heard["somebody_s"].tolist(), strict=True)
        return [{"found": int(found), "somebody_s": since_s, **told(past)} for past, found, since_s in engines]

    def restore(self, engines: Sequence[Any], shift_ns: int) -> bool:
        """Take over a snapshot; False, and nothing changed, when it is none. Raises on what is no numbers."""
        shift_s = shift_ns * 1e-9
        read = [(int(one["found"]), float(one["somebody_s"]), recalled(one, shift_s)) for one in engines]
        sane = len(read) == len(self.found) and all(0 <= found < N_HYPOTHESES for found, *_ in read)
        if sane:
            self._turn[0] = -1  # what nobody corrects is asked for at once
            for e, (found, since_s, past) in enumerate(read):
                self.found[e], self._past[e] = found, past[0]
                self._memory.heard["somebody_s"][e] = since_s + shift_s if since_s else 0.0
                if past["n"][0]:
                    newest = past["rows"][0, 0]
                    self.rows[e, WELL, P], self.rows[e, found, P] = 0.0, 1.0
                    self._air[:] = max(self._air[0], newest[AIR_MACH]), newest[T_S], np.nan, newest[ALONG_G]
        return sane


@compiled
def _runs(memory: _Memory, engines: Engines, e: int, t_s: float, readings: Floats, trusted: Any, row: Floats) -> bool:
    """Long enough that its deck says something; else what is uncorrected of the mounts' thrust is said here.

    Three sigmas hold there what upper and lower mount say each for both: one may be at fault, and nobody weighs.
    """
    past, spools_pct = memory.past[e], readings[engines.spools[e]]
    turns = np.nanmax(spools_pct) > TURNING_N1_PCT  # NaN: nobody says
    # one that nobody hears for a while, or nobody whom one can trust, has not stopped: what is known stays
    if np.nanmax(np.where(trusted[N1:N_SOURCES], spools_pct, nan)) <= TURNING_N1_PCT:
        past.n, past.since_s, past.rate_n_s[:] = 0, nan, 0.0
    elif turns and not isfinite(past.since_s):
        past.since_s = t_s
    if turns and t_s - past.since_s >= STARTED_S:
        return True
    memory.heard[e].n, more_n2 = 0, installed_n2(row.reshape((1, WIDTH)), 0, 0, engines.installed)
    if row[COUNTS + UPPER] > 0.0 and row[COUNTS + LOWER] > 0.0:
        apart_n = row[SAID + UPPER] / engines.shares[e] - row[SAID + LOWER] / (1.0 - engines.shares[e])
        more_n2 = max(more_n2, (apart_n / 3.0) ** 2)
    memory.leading[e, 0], memory.leading[e, UNCORRECTED_N] = nan, sqrt(more_n2)
    forget(memory.jumps[e])
    return False


@compiled
def _say(memory: _Memory, e: int, lead: int, out: Floats) -> None:
    """What was weighed, `out` (N_HYPOTHESES, 3), as the bank's rows."""
    memory.leading[e, 0], memory.leading[e, 1] = out[lead, 1], sqrt(out[lead, 2])
    for which in range(N_HYPOTHESES):
        memory.hypotheses[e, which, P] = out[which, 0]
        memory.hypotheses[e, which, SHIFT_N] = out[which, 1] - out[lead, 1]
        memory.hypotheses[e, which, STD_N] = sqrt(out[which, 2])


@compiled
def _weigh(memory: _Memory, engines: Engines, e: int, rows: Floats, before: int, out: Floats) -> float:
    """Of one engine, by what it has alone, what all share, and how the aircraft moves. -> see `weigh_shared`."""
    n, share, heard = memory.past[e].n, engines.shares[e], memory.heard[e]
    weigh(rows, n, share, before, engines.installed, heard, out)
    odds = weigh_shared(memory.heard, e, before, memory.bias, out)
    if engines.motion.weight_n > 0.0 and at_odds(out) > DOUBT:
        again = np.empty((N_ALONE, 3))
        evidence(rows, n, share, before, engines.installed, engines.motion, again)
        together = all_moves(rows, n, share, engines.installed, len(memory.heard), engines.motion)
        agree(again[:, 0], together, heard, odds, out)
    else:
        heard.moved[:], heard.all_moved[:] = 0.0, 0.0
    return odds


def _look_at(
    memory: _Memory, engines: Engines, t_s: float, readings: Floats, states: Any, deck_n: Floats, trusted: Flags
) -> int:
    past, found, turn, n = memory.past, memory.found, memory.turn, len(memory.found)
    turn[0] = (turn[0] + 1) % (EVERY_LOOKS * n * UNCORRECTED_EVERY)
    e = turn[0] // EVERY_LOOKS % n
    if turn[0] % EVERY_LOOKS:
        return -1
    air_leaves(memory.air, readings, engines.air, t_s)
    row = row_of(engines, memory.jumps[e], e, readings, states, deck_n, trusted)
    row[T_S], row[AIR_MACH] = t_s, memory.air[0]
    row[ALONG_G] = memory.jumps[e].along_g / memory.jumps[e].steps if memory.jumps[e].steps > 0.0 else memory.air[3]
    moves(past, e, row, engines.motion, trusted[e, N_SOURCES])
    if not _runs(memory, engines, e, t_s, readings, trusted[e], row):
        return -1
    share, installed, out = engines.shares[e], engines.installed, np.empty((N_HYPOTHESES, 3))
    if not remember(past, e, row, share):
        return -1
    forget(memory.jumps[e])
    if past[e].n < 2:
        return -1
    rows = past[e].rows[:]  # an array, as the copies of it: one machine code for both
    before = found[e]
    if memory.anew[e] != 0:
        before, memory.anew[e], memory.heard[e].somebody_s = WELL, 0, 0.0
    odds = _weigh(memory, engines, e, rows, SOMEBODY if memory.heard[e].somebody_s != 0.0 else before, out)
    lead = lead_of(before, out)
    keep_failure(memory.heard[e], lead, out)
    memory.odds[e] = min(odds, memory.odds[e] if lead == ACCELERATION_OFF else 0.0)  # refuted while it lasts
    changed, found[e] = lead != found[e], lead
    if changed or past[e].n == 2 or turn[0] < EVERY_LOOKS * n:
        best = np.argmax(out[:, 0])  # though it was not found
        off = engines.off[FUEL_OFF if best == BLED else best]
        more_n2 = uncorrected_n2(rows, past[e].n, share, off, installed, out[best, 1:])
        memory.leading[e, UNCORRECTED_N] = sqrt(more_n2)
    _say(memory, e, lead, out)
    return e if changed else -1


_F, _ROW, _TABLE, _FLAGS = numba.float64, numba.float64[::1], numba.float64[:, ::1], numba.boolean[:, ::1]
_I, _PLACES = numba.int64[::1], numba.int64[:, ::1]
_RECORDS = numba.from_dtype(PAST)[::1], numba.from_dtype(JUMPS)[::1]
_HEARD = numba.from_dtype(HEARD)[::1]
_BIAS = named(Bias, numba.from_dtype(BALANCE)[::1], _F)
_MEMORY = named(_Memory, *_RECORDS, _I, _I, _I, numba.float64[:, :, ::1], _HEARD, _TABLE, _ROW, _BIAS, _ROW)
_INSTALLED = named(Installed, *[_F] * len(Installed._fields))
_ENGINES = named(Engines, _PLACES, _PLACES, _I, _ROW, _TABLE, _INSTALLED, named(Motion, *[_F] * len(Motion._fields)))
_SIGNATURE = numba.int64(_MEMORY, _ENGINES, _F, _ROW, numba.from_dtype(MOUNT_STATE)[::1], _TABLE, _FLAGS)
_look: Any = entry(compiled(_look_at, _SIGNATURE))
assert len(SOURCES_OFF) == N_HYPOTHESES and SOURCES_OFF[BROCHURE_OFF] and SOURCES_OFF[MOUNTS_OFF]
