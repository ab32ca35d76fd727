"""What is wrong on every engine at once: what all mounts share, or what all brochures do.

    y_e = H T_e + e_e + V_e b     of engine e, the same b [N] on each; the errors e of one are independent of another's

So V' A V and V' z are those of every engine over its own rows, and b is smooth (see `fault_shape`), in time, in time
and thrust (by those that are well then), or in what its sensor does:

    accelerometer        sudden or gradual over minutes; or as it goes, by an engine's weight; kinematics knows its bias
    all transducers      sudden or gradual over minutes; or over minutes and thrust, as a scale
    air data             gradual over minutes; or as the Mach number changes, or stands while the aircraft accelerates;
                         those that jump are known by their own watch
    all engine data      over minutes and thrust: they stand still

Every engine leaves what the others need of it (`HEARD`). Weighed while an engine may not be well: a shared fault of
which no engine shows anything is none. One that was found, though nothing told whose it is, may be older than all rows:
rows that thin forget how it began. Equations: see `evidence`.
"""

from math import exp, log
from typing import Any

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.jit import compiled
from thrustd.sensors.errors import REACH_MACH
from thrustd.sensors.evidence import log_pushes, sum_up
from thrustd.sensors.fault_fit import Alone, Seen, answer, gradual, grow, room_for, solve
from thrustd.sensors.fault_shape import FAULT_REACH_N, FAULT_S, ROUGH, smooth
from thrustd.sensors.kinematics import Bias, shown
from thrustd.sensors.onsets import (
    ACCELERATION_OFF,
    AIR_OFF,
    BROCHURE_OFF,
    LIKE,
    MORE,
    NEW,
    SIZES_N,
    SOMEBODY,
    STAYS,
    WELL,
)
from thrustd.sensors.positive import factor

REACH_G = 1.4  # 3000 N of a fault go as an engine's weight, 3.7 kN for 1 g
SHARED = 2e-3  # prior of each of the two within the rows, as of both mounts of an engine
DATA = NEW[BROCHURE_OFF - 1]  # of all engines' data that are wrong together, as of one engine's
ACCELEROMETER, TRANSDUCERS, AIR_DATA, ENGINE_DATA = range(4)  # causes: two of each of LIKE
DOUBT = 0.05  # an engine that is less likely to have something is well


@compiled
def _listen(bias: Bias, t_s: Floats, alone: Alone) -> None:
    """One more measurement of b: kinematics' estimate, in g, is a mean of b that the rows' own times weigh.

    b_kin W = sum w_i b_i + v      w_i: part of a bias since row i that the estimate shows, less one since i - 1
                                   v: its sigma, or all of it: pitch and airspeed may be what is wrong
    """
    m, n = bias.balance[0], len(t_s)
    if m.variance_g2 <= 0.0:
        return
    weights, before = np.empty(n), 0.0
    for i in range(n):
        since = shown(m, t_s[0] - t_s[i])
        weights[i], before = since - before, since
    per_n2 = 1.0 / (m.variance_g2 * bias.weight_n**2)
    for i in range(n):
        alone.g[i] += weights[i] * m.b * bias.weight_n * per_n2
        for j in range(n):
            alone.f[i, j] += weights[i] * weights[j] * per_n2


@compiled
def _together(heard: Any, e: int, k: int) -> tuple[Floats, Floats, Floats, Alone]:
    """Times of all engines' rows, the newest first, the thrust by those that are well, where the sensor was, a fault.

    u of the fault is that of engine e.
    """
    size = 0
    for o in range(len(heard)):
        size += heard[o].n
    t_s, level_n, own, at = np.empty(size), np.empty(size), np.empty(size), np.zeros(len(heard), np.int64)
    engine, row = np.empty(size, np.int64), np.empty(size, np.int64)
    alone = Alone(np.zeros((size, size)), np.empty(size), np.zeros(size))
    for i in range(size):
        newest = -1
        for o in range(len(heard)):
            if at[o] < heard[o].n and (newest < 0 or heard[o].t_s[at[o]] > heard[newest].t_s[at[newest]]):
                newest = o
        engine[i], row[i] = newest, at[newest]
        at[newest] += 1
        said = heard[newest]
        t_s[i], level_n[i] = said.t_s[row[i]], said.level_n[k, row[i]]
        own[i], alone.g[i] = said.own[k, row[i]], said.g[k, row[i]]
        if newest == e:
            alone.u[i] = said.u[k, row[i]]
        for j in range(i + 1):
            if engine[j] == newest:
                alone.f[i, j] = alone.f[j, i] = said.f[k, row[i], row[j]]
    return t_s, level_n, own, alone


@compiled
def _lasting(at: Floats, reach: float, level_n: Floats) -> Floats:
    """Lower factor (n, n) of how a fault goes with itself from one time, or place of its sensor, to another.

    `level_n` (n,): and from one thrust; (0,): it has nothing to do with it.
    """
    n = len(at)
    shape = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            shape[i, j] = smooth(abs(at[j] - at[i]) / reach)
            if len(level_n):
                shape[i, j] *= smooth(abs(level_n[j] - level_n[i]) / FAULT_REACH_N)
        shape[i, i] += ROUGH**2 if len(level_n) else 1e-6
    factor(shape, n)
    return shape


@compiled
def _shape(cause: int, way: int, t_s: Floats, level_n: Floats, own: Floats) -> Floats:
    if way == 0:
        return _lasting(t_s, FAULT_S, level_n[:0])
    if cause == ACCELEROMETER:
        return _lasting(own, REACH_G, level_n[:0])
    return _lasting(own, REACH_MACH, level_n[:0]) if cause == AIR_DATA else _lasting(t_s, FAULT_S, level_n)


@compiled
def _may_be(k: int, way: int, m: int, slowly: bool, t_s: Floats, found_s: float) -> bool:
    """Whether such a fault may have begun at the m-th row; `found_s`: 0, or the time when it was there already."""
    before = m - 1 if slowly else m  # the newest row without it
    if before == len(t_s):
        return found_s != 0.0  # older than all rows
    begins = before > 0 if slowly else k == 0 and way == 0
    return begins and (found_s == 0.0 or t_s[before] <= found_s)


@compiled
def _weigh_one(heard: Any, e: int, cause: int, bias: Bias, well: Floats, found_s: float, row: Floats) -> None:
    """One cause, by onset, size and way, prior included; see `sum_up`. `well`: what engine e says if it is.

    `found_s`: since when somebody has failed on an engine, or 0.
    """
    k, prior = cause // 2, DATA if cause == ENGINE_DATA else SHARED if cause == AIR_DATA else 0.5 * SHARED
    t_s, level_n, own, alone = _together(heard, e, k)
    if cause == ACCELEROMETER:
        _listen(bias, t_s, alone)
    n, sizes = len(t_s), SIZES_N[LIKE[k] - 1]
    across, seen = np.empty(n), Seen(np.empty((n, n)), np.empty(n), np.empty(n), t_s)
    room, logs, said, told = room_for(n), np.empty(6 * n), np.empty((6 * n, 2)), 0
    for way in range(1 if cause == ENGINE_DATA else 0, 2):
        shape = _shape(cause, way, t_s, level_n, own)
        for m in range(1, n + 1):
            grow(shape, alone, m - 1, across, seen)
            for size in range(2):
                solved = solve(sizes[size], m, seen, shape, room)
                for slowly in range(2):
                    if not _may_be(k, way, m, bool(slowly), t_s, found_s):
                        continue
                    ratio, moved_n, more_n2 = gradual(sizes[size], solved) if slowly else answer(solved, 0.0, 0.0)
                    said[told, 0], said[told, 1] = well[1] + moved_n, well[2] + more_n2
                    pushes = log_pushes(said[told, 0], said[told, 1], heard[e].pressure_pa)
                    logs[told] = ratio + pushes
                    told += 1
    sum_up(logs[:told], said[:told], row)
    row[0] += log(prior / told)  # ways, sizes, onsets


@compiled
def _weigh_both(heard: Any, e: int, k: int, bias: Bias, well: Floats, found_s: float, row: Floats) -> float:
    """Both causes of one of LIKE. -> ln of the odds that it is the first."""
    logs, said = np.empty(2), np.empty((2, 2))
    for one in range(2):
        _weigh_one(heard, e, 2 * k + one, bias, well, found_s, row)
        logs[one], said[one, 0], said[one, 1] = row[0], row[1], row[2]
    sum_up(logs, said, row)
    return float(logs[0] - logs[1])


@compiled
def _tell(logs: Floats, out: Floats) -> None:
    """Of both and of neither, `logs` (3,), the probabilities into `out`."""
    most = logs.max()
    total = exp(logs[0] - most) + exp(logs[1] - most) + exp(logs[2] - most)
    out[:ACCELERATION_OFF, 0] *= exp(logs[2] - most) / total
    for k in range(2):
        out[ACCELERATION_OFF + k, 0] = exp(logs[k] - most) / total


@compiled
def weigh_shared(heard: Any, e: int, found: int, bias: Bias, out: Floats) -> float:
    """Puts both among what engine e may have alone, `out` (N_HYPOTHESES, 3) of `weigh`; `found`: see there.

    -> ln of the odds that what all mounts share is the accelerometer.
    """
    one, others, doubt, alone = ACCELERATION_OFF <= found < SOMEBODY, 0, 1.0 - heard[e].well, 0.0
    found_s = 0.0  # whoever has failed on one engine may have on all: what it has alone is as much likelier
    for o in range(len(heard)):
        if heard[o].n > 0:
            alone += heard[o].log_alone
            others += 1 if o != e else 0
            doubt = max(doubt, 1.0 - heard[o].well)
            since_s = heard[o].weighed_s
            found_s = since_s if found_s == 0.0 or 0.0 < since_s < found_s else found_s
    if others == 0 or not (one or found_s != 0.0 or doubt >= DOUBT):
        return 0.0
    logs, odds = np.zeros(3), _weigh_both(heard, e, 0, bias, out[WELL], found_s, out[ACCELERATION_OFF])
    _weigh_both(heard, e, 1, bias, out[WELL], found_s, out[AIR_OFF])
    for k in range(2):
        which = ACCELERATION_OFF + k
        more = STAYS / SHARED if which == found else MORE if found_s != 0.0 else 1.0
        logs[k] = out[which, 0] - alone + log(more)
    if one:
        logs[2] = log(1.0 - STAYS)
        logs[AIR_OFF - found] += logs[2]
    _tell(logs, out)
    return odds
