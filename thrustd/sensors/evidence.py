"""How likely each hypothesis makes what the sources said, and the thrust that it says: one Gaussian for all rows.

    y = H T + e,  T of every row anything;  e ~ N(0, C) of errors that last, each with its own prior sigma, time and
                                            reach in thrust: mounts' own and common ones, deck, lines of N1 and N2
    hypothesis    y = H T + e + V b,  b ~ N(0, B):  what its sensors say besides, in the rows since its onset

No error is a state that readings are averaged for: a sigma is that of the error however long it is looked at, so
nothing is learnt beyond its prior. With A = C^-1, z = A y, G = V' A V, g = V' z, B = L L' and M = 1 + L' G L

    ln p(y | hypothesis) - ln p(y | all well) = (w' w - ln det M) / 2,     w = M^-1/2 L' g
    T0 = c' (z - A V L M^-1 L' g),   c = cov(T0, y)                        (Woodbury)

summed over onsets (the newest row, the newest two, ... all) and sizes, gradual or sudden. No thrust jumps (see
`jumps`): what mounts jumped by at the onset is one more reading, d = pattern b + noise, of a sudden fault alone, unless
the aircraft was shaken, which is as likely as the fault. Reference: Rasmussen & Williams, Gaussian
Processes for Machine Learning, ch. 2.7 and A.3; Brown & Hwang, ch. 9.3 (multiple model adaptive estimation).
"""

from math import erfc, exp, log, sqrt
from typing import NamedTuple

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.jit import compiled
from thrustd.sensors.errors import AS_ON_THE_BENCH, THRUST_N2, Installed, Parts, covariance
from thrustd.sensors.fault_shape import fault_shape, installed_shape
from thrustd.sensors.jumps import see_jump, shaken
from thrustd.sensors.past import (
    COUNTS,
    FUEL_FLOW,
    JUMPED_N,
    LEVEL_N,
    LOWER,
    N1,
    N2,
    N_SOURCES,
    SAID,
    UPPER,
)
from thrustd.sensors.positive import factor, forward, inverse

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
FAULT_S, LASTING_S = 300.0, 20_000.0  # of a fault since its onset, of one that was always there
# priors of a fault within the rows, and of one that was there before the first; an engine that loses thrust and keeps
# its fuel flow and both its speeds is rarer than one that is shut down, 1e-5 an hour
NEW = (1e-3, 1e-3, 2e-3, 1e-3, 1e-3, 1e-3, 1e-6)
ALWAYS = (1e-3, 1e-3, 5e-2, 1e-3, 1e-3, 1e-3, 1e-3)
INSTALLED = 0.2  # one installation in five is off by what no bench shows
LEAST_N, LEAST_P = -200.0, 1e-12  # ram drag of 10 kg/s at flight idle, less what is left of the gross thrust
STAYS = 0.9  # prior of a fault that has been found
TIED_N = 1.0
# Air that is bled (anti-ice) takes fuel and gives no thrust: 5 and 6 % more fuel of both engines at one N1, recorded.
# One past in twenty has a stretch of it; no sensor is at fault
BLEED, BLEEDS = 0.05, 0.05


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


class Seen(NamedTuple):
    """Of one fault of one newton in the newest m rows."""

    q: Floats  # (m, m): L' G L
    g: Floats  # (m,)
    u: Floats  # (m,): V' A c


class Room(NamedTuple):
    """Written over: the factor of M (n, n), and two columns (n,)."""

    work: Floats
    lg: Floats
    lu: Floats


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
def _grow(shape: Floats, f: Floats, k: int, across: Floats, q: Floats) -> None:
    """L' G L of the newest k rows becomes that of k + 1; of `q` the lower half counts, `across` is written over."""
    for j in range(k + 1):
        across[j] = 0.5 * f[k, k] * shape[k, j]
        for i in range(j, k):
            across[j] += f[k, i] * shape[i, j]
        q[k, j] = 0.0
    for i in range(k + 1):
        for j in range(i + 1):
            q[i, j] += shape[k, i] * across[j] + across[i] * shape[k, j]


@compiled
def _update(shape: Floats, size_n: float, m: int, seen: Seen, room: Room) -> tuple[float, float, float]:
    """-> ln of the likelihood ratio, change of T0 and of its variance, for a fault in the newest m rows.

    `shape` (n, n): lower factor of the fault's correlation.
    """
    q, g, u = seen
    work, lg, lu = room
    for i in range(m):
        for j in range(i + 1):
            work[i, j] = size_n * size_n * q[i, j]
        work[i, i] += 1.0
    half = factor(work, m)
    fit = moved_n = more_n2 = 0.0
    for i in range(m):
        lg[i] = lu[i] = 0.0
        for k in range(i, m):
            lg[i] += size_n * shape[k, i] * g[k]
            lu[i] += size_n * shape[k, i] * u[k]
        for k in range(i):
            lg[i] -= work[i, k] * lg[k]
            lu[i] -= work[i, k] * lu[k]
        lg[i], lu[i] = lg[i] / work[i, i], lu[i] / work[i, i]
        fit += lg[i] * lg[i]
        moved_n -= lu[i] * lg[i]
        more_n2 += lu[i] * lu[i]
    return 0.5 * fit - half, moved_n, more_n2


@compiled
def _solve(rows: Floats, n: int, parts: Parts, out: Floats) -> tuple[Floats, Floats, Floats]:
    """All is well: A, z = A y and A c; its thrust and variance go into `out`."""
    a, size = inverse(covariance(rows, n, parts, AS_ON_THE_BENCH)), n * N_SOURCES
    z, ac, to_n2 = np.zeros(size), np.zeros(size), np.zeros(N_SOURCES)
    for s in range(N_SOURCES):
        to_n2[s] = parts[s] * THRUST_N2 if rows[0, COUNTS + s] != 0.0 else 0.0
    for i in range(size):
        for j in range(size):
            z[i] += a[i, j] * rows[j // N_SOURCES, SAID + j % N_SOURCES]
        for s in range(N_SOURCES):
            ac[i] += a[i, s] * to_n2[s]
    thrust_n, explained_n2 = 0.0, 0.0
    for s in range(N_SOURCES):
        thrust_n += to_n2[s] * z[s]
        explained_n2 += to_n2[s] * ac[s]
    out[WELL] = 0.0, thrust_n, max(THRUST_N2 - explained_n2, 1.0)
    return a, z, ac


@compiled
def _log_pushes(thrust_n: float, variance_n2: float) -> float:
    """ln of the probability that this is a thrust: an engine that turns does not pull by more than its ram drag."""
    return log(max(0.5 * erfc((LEAST_N - thrust_n) / sqrt(2.0 * variance_n2)), LEAST_P))


@compiled
def _prior(which: int, m: int, size: int, n: int, found: int) -> float:
    """Of a fault in the newest m of n rows and one size."""
    if which == found:
        return STAYS / (2 * n)
    if which == MOUNTS_OFF and m == n:
        return INSTALLED if size == 0 else 0.5 * ALWAYS[which - 1]
    if which == BROCHURE_OFF and size == 1:  # an engine is not that much unlike its deck
        return 0.5 * NEW[which - 1] / n
    return 0.5 * ALWAYS[which - 1] if m == n else 0.5 * NEW[which - 1] / (n - 1)


@compiled
def _sum_up(logs: Floats, said: Floats, row: Floats) -> None:
    """Onsets and sizes (k,) of one hypothesis, what they say (k, 2): ln of its evidence, thrust, variance."""
    most, total, mean_n, mean_n2 = logs.max(), 0.0, 0.0, 0.0
    for i in range(len(logs)):
        p = exp(logs[i] - most)
        total += p
        mean_n += p * said[i, 0]
        mean_n2 += p * (said[i, 1] + said[i, 0] ** 2)
    mean_n, mean_n2 = mean_n / total, mean_n2 / total
    row[0], row[1], row[2] = most + log(total), mean_n, max(mean_n2 - mean_n**2, 1.0)


@compiled
def uncorrected_n2(rows: Floats, n: int, share: float, off: Floats, installed: Installed, said: Floats) -> float:
    """What the thrust that leads may be wrong by because nobody corrected the installation: a variance more.

        (v + (m - thrust)^2) - variance      m, v: thrust and variance when the installation errs as its prior says

    `off` (N_SOURCES,): 1 of a source that is not believed; `said`: thrust and variance as installed on the bench.
    The prior is not weighed against the bench's: agreement within the deck's own error proves no nacelle without
    drag. Reference: JCGM 100:2008 (GUM), F.2.4.5, uncorrected systematic effects.
    """
    seen, parts, size = rows[:n].copy(), (share, 1.0 - share, 1.0, 1.0, 1.0), n * N_SOURCES
    for s in range(N_SOURCES):
        if off[s] != 0.0:
            seen[:, COUNTS + s] = 0.0
    low, y, c = covariance(seen, n, parts, installed), np.zeros(size), np.zeros(size)
    factor(low, size)
    for i in range(size):
        y[i] = seen[i // N_SOURCES, SAID + i % N_SOURCES]
    for s in range(N_SOURCES):
        c[s] = parts[s] * THRUST_N2 if seen[0, COUNTS + s] != 0.0 else 0.0
    forward(low, y, size)
    forward(low, c, size)
    return max(THRUST_N2 - np.sum(c * c) + (np.sum(c * y) - said[0]) ** 2 - said[1], 0.0)


@compiled
def _tied(shape: Floats, m: int, q: Floats) -> Floats:
    """L' G L (m, m) of a fault that is none yet in the oldest of m rows: a reading of 0 +- TIED_N there."""
    tied = q[:m, :m].copy()
    for j in range(m):
        for k in range(j + 1):
            tied[j, k] += shape[m - 1, j] * shape[m - 1, k] / TIED_N**2
    return tied


@compiled
def _of_onsets(which: int, scene: Scene, logs: Floats, said: Floats) -> int:
    """Of one hypothesis, by onset and size: ln of its evidence (k,), change of thrust and variance (k, 2); -> k."""
    rows, n, parts = scene.rows, scene.n, scene.parts
    f, g, u, q, across = np.empty((n, n)), np.empty(n), np.zeros(n), np.empty((n, n)), np.empty(n)
    room = Room(np.empty((n, n)), np.empty(n), np.empty(n))
    pattern, shape, k = _pattern(which, parts), scene.since, 0
    _project(scene.a, scene.z, n, pattern, f, g)
    for i in range(n):
        u[i] = np.sum(pattern * scene.ac[i * N_SOURCES : (i + 1) * N_SOURCES])
    for m in range(1, n + 1):
        _grow(shape, f, m - 1, across, q)
        row, leapt = rows[m - 1], False
        if m < n:
            leapt = pattern[UPPER] * row[JUMPED_N] + pattern[LOWER] * row[JUMPED_N + 1] != 0.0
        for size in range(2):
            size_n, prior = SIZES_N[which - 1][size], log(0.5 * _prior(which, 1, size, n, scene.found))
            if m < n:  # sudden
                ratio, said[k, 0], said[k, 1] = _update(shape, size_n, m, Seen(q, g, u), room)
                logs[k], k = prior + ratio, k + 1
            if leapt:
                seen_q, seen_g = see_jump(rows, parts, pattern, shape, m, q, g)
                ratio, said[k, 0], said[k, 1] = _update(shape, size_n, m, Seen(seen_q, seen_g, u), room)
                less = shaken(rows, m, parts, SIZES_N[MOUNTS_OFF - 1], NEW[MOUNTS_OFF - 1] / (n - 1))
                logs[k], k = prior + ratio - less, k + 1
            if m > 1:  # gradual, from the row before on
                ratio, said[k, 0], said[k, 1] = _update(shape, size_n, m, Seen(_tied(shape, m, q), g, u), room)
                logs[k], k = prior + ratio + 0.5 * log(1.0 + (size_n / TIED_N) ** 2), k + 1
    for size in range(2):
        shape, size_n = scene.always, SIZES_N[which - 1][size]
        if which == MOUNTS_OFF and size == 0:
            shape, size_n = scene.installed, 1.0
        if size == 0 or which == MOUNTS_OFF:  # another shape begins anew
            for i in range(n):
                _grow(shape, f, i, across, q)
        ratio, said[k, 0], said[k, 1] = _update(shape, size_n, n, Seen(q, g, u), room)
        logs[k], k = log(_prior(which, n, size, n, scene.found)) + ratio, k + 1
    return k


@compiled
def _of_stretches(scene: Scene, logs: Floats, said: Floats) -> int:
    """As `_of_onsets`, of air that was bled in any stretch of rows: so much more fuel, by a part of the thrust."""
    rows, n, k, sigma2 = scene.rows, scene.n, 0, BLEED**2
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
            logs[k] = prior + 0.5 * (sigma2 * g * g / wide - log(wide))
            said[k, 0], said[k, 1] = -sigma2 * u * g / wide, sigma2 * u * u / wide
            k += 1
    return k


@compiled
def weigh(rows: Floats, n: int, share: float, found: int, installed_as: Installed, out: Floats) -> None:
    """By hypothesis its probability, the thrust of the newest row and its variance: `out` (N_HYPOTHESES, 3).

    `found`: the hypothesis that led so far; a fault stays unless it is refuted.
    """
    parts = share, 1.0 - share, 1.0, 1.0, 1.0
    a, z, ac = _solve(rows, n, parts, out)
    out[WELL, 0] = 0.0 if found == WELL else log(1.0 - STAYS)  # a fault that was found leaves all others less
    well = _log_pushes(out[WELL, 1], out[WELL, 2])
    since, always = fault_shape(rows, n, FAULT_S), fault_shape(rows, n, LASTING_S)
    scene = Scene(rows, n, parts, a, z, ac, since, always, installed_shape(rows, n, installed_as), found)
    most = max(6 * n, n * (n + 1) // 2)
    logs, said = np.empty(most), np.empty((most, 2))
    for which in range(1, N_HYPOTHESES):
        k = _of_stretches(scene, logs, said) if which == BLED else _of_onsets(which, scene, logs, said)
        for i in range(k):
            logs[i] += 0.0 if which == found else out[WELL, 0]
            said[i, 0], said[i, 1] = out[WELL, 1] + said[i, 0], out[WELL, 2] + said[i, 1]
            logs[i] += _log_pushes(said[i, 0], said[i, 1])
        _sum_up(logs[:k], said[:k], out[which])
    out[WELL, 0] += well
    out[:, 0] = np.exp(out[:, 0] - out[:, 0].max())
    out[:, 0] /= out[:, 0].sum()
