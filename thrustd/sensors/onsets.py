"""One hypothesis of who is at fault: how likely it is for every onset and size, and what it changes of the thrust.

    sudden     b since the onset, smooth from then on (see `fault_shape`); what its mounts jumped by is a reading more
    gradual    the same, and none yet at the row before its onset: b = 0 there
    always     since before the first row
    air is bled    a step of the fuel flow between two rows, in proportion to the thrust

Equations: see `evidence`.
"""

from math import erfc, log, sqrt
from typing import NamedTuple

import numpy as np

from thrustd.core.columns import Floats, Integers
from thrustd.core.jit import compiled
from thrustd.sensors.errors import Parts
from thrustd.sensors.jumps import see_jump, shaken
from thrustd.sensors.past import FUEL_FLOW, JUMPED_N, LEVEL_N, LOWER, N1, N2, N_SOURCES, UPPER
from thrustd.sensors.positive import factor

WELL, UPPER_OFF, LOWER_OFF, MOUNTS_OFF, FUEL_OFF, N1_OFF, N2_OFF, BROCHURE_OFF, BLED = range(9)
N_HYPOTHESES = 9
ALONE_OFF = (-1, UPPER, LOWER, -1, FUEL_FLOW, N1, N2, -1, -1)  # the source of a hypothesis of one sensor
# faults: what they may be, N of the source
SIZES_N = (
    (250.0, 2000.0),
    (250.0, 2000.0),
    (300.0, 3000.0),
    (500.0, 3000.0),
    (500.0, 3000.0),
    (500.0, 3000.0),
    (400.0, 2000.0),
)
# priors of a fault within the rows, and of one that was there before the first; an engine that loses thrust and keeps
# its fuel flow and both its speeds is rarer than one that is shut down, 1e-5 an hour
NEW = (1e-3, 1e-3, 2e-3, 1e-3, 1e-3, 1e-3, 1e-6)
ALWAYS = (1e-3, 1e-3, 5e-2, 1e-3, 1e-3, 1e-3, 1e-3)
INSTALLED = 0.2  # one installation in five is off by what no bench shows
AIR = 2e-3  # air data at fault: every engine's brochure is wrong at once
STAYS = 0.9  # prior of a fault that has been found
TIED_N = 1.0  # of a fault that has not begun yet, one sigma
# Air that is bled (anti-ice) takes fuel and gives no thrust: 5 and 6 % more fuel of both engines at one N1, recorded.
# One past in twenty has a stretch of it; no sensor is at fault
BLEED, BLEEDS = 0.05, 0.05
LEAST_P = 1e-12


class Scene(NamedTuple):
    """What all hypotheses share: n rows, parts of the load, A, z and A c of all well, and factors of what lasts."""

    rows: Floats
    n: int
    parts: Parts
    a: Floats  # (n * N_SOURCES,) squared
    z: Floats
    ac: Floats
    since: Floats  # (n, n), of a fault since its onset
    always: Floats  # of one that was always there
    installed: Floats  # of what no bench shows
    found: int  # the hypothesis that led so far
    elsewhere: float  # how likely it is that the other engines' brochures are wrong too, where any engine's is


class Seen(NamedTuple):
    """Of one fault of one newton in the newest m rows."""

    q: Floats  # (m, m): L' G L
    g: Floats  # (m,): L' g
    u: Floats  # (m,): L' V' A c
    pattern: Floats  # (N_SOURCES,)


class Room(NamedTuple):
    """Written over: the factor of M (n, n), and two columns (n,)."""

    work: Floats
    g: Floats
    u: Floats


class Alone(NamedTuple):
    """Of a fault of one newton in each row alone."""

    f: Floats  # (n, n): V' A V
    g: Floats  # (n,): V' z
    u: Floats  # (n,): V' A c


class Told(NamedTuple):
    """Of one hypothesis, as far as it was weighed."""

    logs: Floats  # (most,): ln of its evidence, by onset and size
    said: Floats  # (most, 2): change of thrust and of its variance
    n: Integers  # (1,): so many


@compiled
def _pattern(which: int, parts: Parts) -> Floats:
    """What a fault of one newton does to the sources."""
    pattern = np.zeros(N_SOURCES)
    if which == MOUNTS_OFF:
        pattern[UPPER], pattern[LOWER] = parts[UPPER], parts[LOWER]
    elif which == BROCHURE_OFF:
        pattern[FUEL_FLOW:] = 1.0
    else:
        pattern[ALONE_OFF[which]] = 1.0
    return pattern


@compiled
def _project(a: Floats, z: Floats, n: int, pattern: Floats, f: Floats, g: Floats) -> None:
    """G = V' A V (n, n) and g = V' z (n,) of a fault in any of the rows."""
    ours = np.flatnonzero(pattern)
    for i in range(n):
        g[i] = 0.0
        for s in ours:
            g[i] += pattern[s] * z[i * N_SOURCES + s]
        for j in range(i + 1):
            dot = 0.0
            for s in ours:
                for r in ours:
                    dot += pattern[s] * pattern[r] * a[i * N_SOURCES + s, j * N_SOURCES + r]
            f[i, j] = f[j, i] = dot


@compiled
def _grow(shape: Floats, alone: Alone, k: int, across: Floats, seen: Seen) -> None:
    """Of the newest k rows becomes that of k + 1; of q the lower half counts, `across` is written over.

    `shape` (n, n): lower factor of the fault's correlation.
    """
    f, q = alone.f, seen.q
    seen.g[k] = seen.u[k] = 0.0
    for j in range(k + 1):
        seen.g[j] += shape[k, j] * alone.g[k]
        seen.u[j] += shape[k, j] * alone.u[k]
        across[j] = 0.5 * f[k, k] * shape[k, j]
        for i in range(j, k):
            across[j] += f[k, i] * shape[i, j]
        q[k, j] = 0.0
    for i in range(k + 1):
        for j in range(i + 1):
            q[i, j] += shape[k, i] * across[j] + across[i] * shape[k, j]


@compiled
def _update(size_n: float, m: int, seen: Seen, room: Room) -> tuple[float, float, float]:
    """-> ln of the likelihood ratio, change of T0 and of its variance, for a fault in the newest m rows."""
    q, work = seen.q, room.work
    for i in range(m):
        for j in range(i + 1):
            work[i, j] = size_n * size_n * q[i, j]
        work[i, i] += 1.0
    half = factor(work, m)
    fit = moved_n = more_n2 = 0.0
    for i in range(m):
        g, u = size_n * seen.g[i], size_n * seen.u[i]
        for k in range(i):
            g -= work[i, k] * room.g[k]
            u -= work[i, k] * room.u[k]
        over = 1.0 / work[i, i]
        g, u = g * over, u * over
        room.g[i], room.u[i] = g, u
        fit += g * g
        moved_n -= u * g
        more_n2 += u * u
    return 0.5 * fit - half, moved_n, more_n2


@compiled
def _prior(which: int, m: int, size: int, scene: Scene) -> float:
    """Of a fault in the newest m rows and one size."""
    n = scene.n
    if which == scene.found:
        return STAYS / (2 * n)
    if which == MOUNTS_OFF and m == n:
        return INSTALLED if size == 0 else 0.5 * ALWAYS[which - 1]
    new = NEW[which - 1] + (AIR * scene.elsewhere if which == BROCHURE_OFF else 0.0)
    if which == BROCHURE_OFF and size == 1:  # an engine is not that much unlike its deck
        return 0.5 * new / n
    return 0.5 * ALWAYS[which - 1] if m == n else 0.5 * new / (n - 1)


@compiled
def _tied(shape: Floats, m: int, q: Floats) -> Floats:
    """L' G L (m, m) of a fault that is none yet in the oldest of m rows: a reading of 0 +- TIED_N there."""
    tied = q[:m, :m].copy()
    for j in range(m):
        for k in range(j + 1):
            tied[j, k] += shape[m - 1, j] * shape[m - 1, k] / TIED_N**2
    return tied


@compiled
def _tell(told: Told, log_p: float, moved_n: float, more_n2: float) -> None:
    k = told.n[0]
    told.logs[k], told.said[k, 0], told.said[k, 1] = log_p, moved_n, more_n2
    told.n[0] = k + 1


@compiled
def _sudden(which: int, scene: Scene, m: int, size: int, seen: Seen, room: Room, told: Told) -> None:
    """In the newest m rows, and once more with what the mounts jumped by then."""
    rows, n, shape, size_n = scene.rows, scene.n, scene.since, SIZES_N[which - 1][size]
    prior = log(0.5 * _prior(which, m, size, scene))
    ratio, moved_n, more_n2 = _update(size_n, m, seen, room)
    _tell(told, prior + ratio, moved_n, more_n2)
    pattern = seen.pattern
    if pattern[UPPER] * rows[m - 1, JUMPED_N] + pattern[LOWER] * rows[m - 1, JUMPED_N + 1] != 0.0:
        q, g = see_jump(rows, scene.parts, pattern, shape, m, seen.q, seen.g)
        ratio, moved_n, more_n2 = _update(size_n, m, Seen(q, g, seen.u, pattern), room)
        less = shaken(rows, m, scene.parts, SIZES_N[MOUNTS_OFF - 1], NEW[MOUNTS_OFF - 1] / (n - 1))
        _tell(told, prior + ratio - less, moved_n, more_n2)


@compiled
def of_onsets(which: int, scene: Scene, told: Told) -> None:
    """Of one hypothesis, by onset and size."""
    n, sizes = scene.n, SIZES_N[which - 1]
    across, pattern = np.empty(n), _pattern(which, scene.parts)
    alone = Alone(np.empty((n, n)), np.empty(n), np.zeros(n))
    seen = Seen(np.empty((n, n)), np.empty(n), np.empty(n), pattern)
    room = Room(np.empty((n, n)), np.empty(n), np.empty(n))
    _project(scene.a, scene.z, n, pattern, alone.f, alone.g)
    for i in range(n):
        for s in range(N_SOURCES):
            alone.u[i] += pattern[s] * scene.ac[i * N_SOURCES + s]
    for m in range(1, n + 1):
        _grow(scene.since, alone, m - 1, across, seen)
        tied = Seen(_tied(scene.since, m, seen.q), seen.g, seen.u, pattern)
        for size in range(2):
            if m < n:
                _sudden(which, scene, m, size, seen, room, told)
            if m > 1:
                ratio, moved_n, more_n2 = _update(sizes[size], m, tied, room)
                ratio += log(0.5 * _prior(which, m - 1, size, scene)) + 0.5 * log(1.0 + (sizes[size] / TIED_N) ** 2)
                _tell(told, ratio, moved_n, more_n2)
    for size in range(2):
        installed = which == MOUNTS_OFF and size == 0
        shape, size_n = (scene.installed, 1.0) if installed else (scene.always, sizes[size])
        for i in range(n if size == 0 or which == MOUNTS_OFF else 0):  # another shape begins anew
            _grow(shape, alone, i, across, seen)
        ratio, moved_n, more_n2 = _update(size_n, n, seen, room)
        _tell(told, log(_prior(which, n, size, scene)) + ratio, moved_n, more_n2)


@compiled
def of_stretches(scene: Scene, told: Told) -> None:
    """As `of_onsets`, of air that was bled in any stretch of rows: more fuel, never less, by a part of the thrust.

    b > 0: twice the evidence, times the part of b's posterior N(sigma2 g / wide, sigma2 / wide) that is positive.
    """
    rows, n, sigma2 = scene.rows, scene.n, BLEED**2
    prior = log((STAYS if scene.found == BLED else BLEEDS) / (n * (n + 1) / 2))
    for a in range(n):
        q = g = u = 0.0
        for b in range(a, n):
            at, level_n = b * N_SOURCES + FUEL_FLOW, rows[b, LEVEL_N]
            for i in range(a, b + 1):
                both = level_n * rows[i, LEVEL_N] * scene.a[at, i * N_SOURCES + FUEL_FLOW]
                q += both if i == b else 2.0 * both
            g += level_n * scene.z[at]
            u += level_n * scene.ac[at]
            wide = 1.0 + sigma2 * q
            more = max(erfc(-g * sqrt(0.5 * sigma2 / wide)), LEAST_P)
            log_p = prior + 0.5 * (sigma2 * g * g / wide - log(wide)) + log(more)
            _tell(told, log_p, -sigma2 * u * g / wide, sigma2 * u * u / wide)
