"""One hypothesis of who is at fault: how likely it is for every onset and size, and what it changes of the thrust.

    sudden     b since the onset, smooth from then on (see `fault_shape`); what its mounts jumped by is a reading more
    gradual    the same, and none yet at the row before its onset: b = 0 there
    always     since before the first row
    air is bled    a step of the fuel flow between two rows, in proportion to the thrust
    scale      both mounts by a part of the load since before the first row; of the size that the rows favour most
    installation    both mounts by what no bench shows, as large as the aircraft's file says; no sensor is at fault

Equations: see `evidence`.
"""

from math import erfc, exp, log, sqrt
from typing import Any, NamedTuple

import numpy as np

from thrustd.core.aircraft import Installed
from thrustd.core.columns import Floats, Integers
from thrustd.core.jit import compiled
from thrustd.sensors.errors import Parts
from thrustd.sensors.fault_fit import Alone, Seen, Solved, answer, gradual, grow, room_for, solve
from thrustd.sensors.fault_shape import by_mounts_n, installed_shape
from thrustd.sensors.jumps import see_jump, shaken
from thrustd.sensors.past import (
    AIR_MACH,
    ALONG_G,
    FUEL_FLOW,
    JUMPED_N,
    LEVEL_N,
    LOWER,
    N1,
    N2,
    N_ROWS,
    N_SOURCES,
    PRESSURE_PA,
    T_S,
    UPPER,
)  # fmt: skip

WELL, UPPER_OFF, LOWER_OFF, MOUNTS_OFF, FUEL_OFF, N1_OFF, N2_OFF, BROCHURE_OFF, SPOOLS_OFF, BUT_SPOOLS_OFF = range(10)
BLED, SCALE_OFF, INSTALLED_OFF = 10, 11, 12
ACCELERATION_OFF, AIR_OFF = 13, 14  # of all engines: see `shared`
N_ALONE, N_HYPOTHESES = 13, 15
SOMEBODY = 15  # in place of one that was found: a sensor or an engine failed, and nothing tells which
NOBODYS = WELL, BLED, INSTALLED_OFF  # no sensor is at fault
UNFAILED = (*NOBODYS, SCALE_OFF)  # nor has any failed: an installation in twenty-five has a scale that is wrong
LIKE = MOUNTS_OFF, BROCHURE_OFF  # what each of the shared ones is on one engine
ALONE_OFF = (-1, UPPER, LOWER, -1, FUEL_FLOW, N1, N2)  # the source of a hypothesis of one sensor
# faults: what they may be, N of the source
SIZES_N = (
    (250.0, 2000.0),
    (250.0, 2000.0),
    (300.0, 3000.0),
    (500.0, 3000.0),
    (500.0, 3000.0),
    (500.0, 3000.0),
    (400.0, 3000.0),
    (500.0, 3000.0),
    (500.0, 3000.0),
)
# priors of a fault within the rows, and of one that was there before the first. An engine that loses thrust and keeps
# its fuel flow and both its speeds is rarer than one that is shut down, 1e-5 an hour, and so is a box that gets all
# three wrong together. Both spools may share a clock, mounts and fuel flow a supply: a tenth of what one does alone
# (IEC 61508-6, annex D); as likely, because nothing tells one from the other
NEW = (1e-3, 1e-3, 2e-3, 1e-3, 1e-3, 1e-3, 1e-5, 1e-4, 1e-4)
ALWAYS = (1e-3, 1e-3, 2e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-4, 1e-4)
INSTALLED, SCALED = 0.2, 0.04  # one installation in five is off by what no bench shows, one in twenty-five by a scale
FAR = 10.0  # a scale that is wrong, over one that is not sure: as of all faults
STAYS = 0.9  # prior of a fault that has been found
MORE = STAYS / (sum(NEW) + sum(ALWAYS))  # of each, where it was found that there is one
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
    brochure_since: Floats  # of the whole brochure
    always: Floats  # of one that was always there
    installed: Floats  # of what no bench shows
    found: int  # the hypothesis that led so far


HEARD = np.dtype(  # what other engines need of one when it was weighed last; n = 0: it says nothing
    [
        ("n", np.int64),
        ("pressure_pa", np.float64),  # of its newest row
        ("t_s", np.float64, N_ROWS),
        ("level_n", np.float64, (2, N_ROWS)),  # the thrust by those that are well then
        ("own", np.float64, (2, N_ROWS)),  # of both shared faults, where the sensor was: see `shared`
        ("f", np.float64, (2, N_ROWS, N_ROWS)),  # as `Alone`, of both of LIKE
        ("g", np.float64, (2, N_ROWS)),
        ("u", np.float64, (2, N_ROWS)),
        ("log_alone", np.float64),  # ln of its evidence, whatever it has alone, over that of all well
        ("well", np.float64),  # how likely it has nothing alone, nor an installation that errs
        ("logs", np.float64, N_ALONE),  # ln of the evidence of each, prior included
        ("moved", np.float64, N_ALONE),  # the worst that the aircraft's motion has said of each: see `motion`
        ("all_moved", np.float64, 2),  # and of what all mounts share, and all brochures
        ("somebody_s", np.float64),  # a failure was found by then, and nothing tells whose; 0: none was
        ("weighed_s", np.float64),  # the same as its evidence was weighed with
    ]
)


class Told(NamedTuple):
    """Of one hypothesis, as far as it was weighed."""

    logs: Floats  # (most,): ln of its evidence, by onset and size
    said: Floats  # (most, 2): change of thrust and of its variance
    n: Integers  # (1,): so many


@compiled
def pattern_of(which: int, parts: Parts) -> Floats:
    """What a fault of one newton does to the sources."""
    pattern = np.zeros(N_SOURCES)
    if which == MOUNTS_OFF:
        pattern[UPPER], pattern[LOWER] = parts[UPPER], parts[LOWER]
    elif which == BROCHURE_OFF:
        pattern[FUEL_FLOW:] = 1.0
    elif which == SPOOLS_OFF:
        pattern[N1:] = 1.0
    elif which == BUT_SPOOLS_OFF:
        pattern[UPPER], pattern[LOWER], pattern[FUEL_FLOW] = parts[UPPER], parts[LOWER], 1.0
    else:
        pattern[ALONE_OFF[which]] = 1.0
    return pattern


@compiled
def alone_of(scene: Scene, pattern: Floats) -> Alone:
    """V' A V (n, n), V' z and V' A c (n,) of a fault of one newton in any of the rows."""
    n, ours = scene.n, np.flatnonzero(pattern)
    f, g, u = np.empty((n, n)), np.zeros(n), np.zeros(n)
    for i in range(n):
        for s in ours:
            g[i] += pattern[s] * scene.z[i * N_SOURCES + s]
            u[i] += pattern[s] * scene.ac[i * N_SOURCES + s]
        for j in range(i + 1):
            dot = 0.0
            for s in ours:
                for r in ours:
                    dot += pattern[s] * pattern[r] * scene.a[i * N_SOURCES + s, j * N_SOURCES + r]
            f[i, j] = f[j, i] = dot
    return Alone(f, g, u)


@compiled
def _prior(which: int, lasting: bool, size: int, scene: Scene) -> float:
    """Of a fault of one size since one of the rows' onsets, or `lasting`: since before the first."""
    n = scene.n
    if which == scene.found:
        return STAYS / (2 * n)
    new = NEW[which - 1]
    if which == BROCHURE_OFF and size == 1:  # an engine is not that much unlike its deck
        return 0.5 * new / n
    return 0.5 * ALWAYS[which - 1] if lasting else 0.5 * new / (n - 1)


@compiled
def _tell(told: Told, log_p: float, moved_n: float, more_n2: float) -> None:
    k = told.n[0]
    told.logs[k], told.said[k, 0], told.said[k, 1] = log_p, moved_n, more_n2
    told.n[0] = k + 1


@compiled
def _sudden(prior: float, scene: Scene, m: int, seen: Seen, solved: Solved, told: Told) -> None:
    """In the newest m rows, and once more with what the mounts jumped by then; `prior`: ln of it."""
    rows, n, pattern = scene.rows, scene.n, seen.pattern
    ratio, moved_n, more_n2 = answer(solved, 0.0, 0.0)
    _tell(told, prior + ratio, moved_n, more_n2)
    if pattern[UPPER] * rows[m - 1, JUMPED_N] + pattern[LOWER] * rows[m - 1, JUMPED_N + 1] != 0.0:
        more, more_g = see_jump(rows, scene.parts, pattern, m)
        ratio, moved_n, more_n2 = answer(solved, more, more_g)
        less = shaken(rows, m, scene.parts, SIZES_N[MOUNTS_OFF - 1], NEW[MOUNTS_OFF - 1] / (n - 1))
        _tell(told, prior + ratio - less, moved_n, more_n2)


@compiled
def of_onsets(which: int, scene: Scene, told: Told) -> None:
    """Of one hypothesis, by onset and size."""
    n, sizes, pattern = scene.n, SIZES_N[which - 1], pattern_of(which, scene.parts)
    since = scene.brochure_since if which == BROCHURE_OFF else scene.since
    alone, across = alone_of(scene, pattern), np.empty(n)
    seen = Seen(np.empty((n, n)), np.empty(n), np.empty(n), pattern)
    room = room_for(n)
    priors = log(0.5 * _prior(which, False, 0, scene)), log(0.5 * _prior(which, False, 1, scene))
    for m in range(1, n + 1):
        grow(since, alone, m - 1, across, seen)
        for size in range(2):
            solved = solve(sizes[size], m, seen, since, room)
            if m < n and which < SPOOLS_OFF:  # what two kinds of sources share is a supply or a clock, which drifts
                _sudden(priors[size], scene, m, seen, solved, told)
            if m > 1:
                ratio, moved_n, more_n2 = gradual(sizes[size], solved)
                _tell(told, ratio + priors[size], moved_n, more_n2)
    for i in range(n):  # another shape begins anew
        grow(scene.always, alone, i, across, seen)
    for size in range(2):
        ratio, moved_n, more_n2 = answer(solve(sizes[size], n, seen, scene.always, room), 0.0, 0.0)
        _tell(told, log(_prior(which, True, size, scene)) + ratio, moved_n, more_n2)


@compiled
def of_installation(scene: Scene, told: Told) -> None:
    """As `of_onsets`, of both mounts by what no bench has shown of their installation."""
    n, pattern = scene.n, pattern_of(MOUNTS_OFF, scene.parts)
    alone, across = alone_of(scene, pattern), np.empty(n)
    seen = Seen(np.empty((n, n)), np.empty(n), np.empty(n), pattern)
    for i in range(n):
        grow(scene.installed, alone, i, across, seen)
    ratio, moved_n, more_n2 = answer(solve(1.0, n, seen, scene.installed, room_for(n)), 0.0, 0.0)
    _tell(told, log(INSTALLED) + ratio, moved_n, more_n2)


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


@compiled
def of_scale(scene: Scene, installed: Installed, told: Told) -> None:
    """As `of_onsets`, of a part of the load that both mounts show too much or too little since before the first row.

    Nobody knows of what size such an error is, so agreement is no evidence against it: it counts as much as with the
    sigma that the rows favour most, max over s of p(y | s) / p(y | 0) = exp((z^2 - 1) / 2) / |z| where |z| > 1, else 1.
    Who doubts the scale takes no zero for granted, nor anything else that no bench shows: a scale would be known from
    how little mounts and brochure differ at idle, where a zero hides it.
    One installation in twenty-five is off by a scale; behind a tethered run, which measured it, that is a fault.
    Reference: Berger & Sellke, Testing a point null hypothesis, J. Am. Stat. Assoc. 82 (1987) 112.
    """
    rows, n, pattern = scene.rows, scene.n, pattern_of(MOUNTS_OFF, scene.parts)
    far = Installed(
        installed.zero_n, FAR * max(installed.scale, installed.told_scale), installed.drag_m2, installed.rest_n,
        installed.cant_n_g, installed.inertia_n_g, installed.share, installed.couple_n_g, 0.0, 0.0, 0.0,
    )  # fmt: skip
    alone, shape, across, sigma2 = alone_of(scene, pattern), installed_shape(rows, n, far), np.empty(n), far.scale**2
    seen = Seen(np.empty((n, n)), np.empty(n), np.empty(n), pattern)
    q = g = 0.0
    for i in range(n):
        grow(shape, alone, i, across, seen)
        g += rows[i, LEVEL_N] * alone.g[i]
        for j in range(n):
            q += rows[i, LEVEL_N] * rows[j, LEVEL_N] * alone.f[i, j]
    z2 = sigma2 * g * g / (1.0 + sigma2 * q)
    ratio = 0.5 * (z2 - 1.0 - log(z2)) if z2 > 1.0 else 0.0
    prior = STAYS if scene.found == SCALE_OFF else SCALED if installed.scale > 0.0 else ALWAYS[MOUNTS_OFF - 1]
    _, moved_n, more_n2 = answer(solve(1.0, n, seen, shape, room_for(n)), 0.0, 0.0)
    _tell(told, log(prior) + ratio, moved_n, more_n2)


@compiled
def leave(scene: Scene, out: Floats, heard: Any) -> None:
    """For other engines; `out` (N_HYPOTHESES, 3): ln of the evidence of each that it has alone."""
    rows, n = scene.rows, scene.n
    heard.n, heard.pressure_pa = n, rows[0, PRESSURE_PA]
    heard.weighed_s = heard.somebody_s if scene.found == SOMEBODY else 0.0
    heard.t_s[:n], heard.own[0, :n], heard.own[1, :n] = rows[:n, T_S], rows[:n, ALONG_G], rows[:n, AIR_MACH]
    heard.level_n[0, :n], heard.level_n[1, :n] = rows[:n, LEVEL_N], by_mounts_n(rows, n)
    for k in range(2):
        alone = alone_of(scene, pattern_of(LIKE[k], scene.parts))
        heard.f[k, :n, :n], heard.g[k, :n], heard.u[k, :n] = alone.f, alone.g, alone.u
    heard.logs[:] = out[:N_ALONE, 0]
    most = out[:N_ALONE, 0].max()
    heard.log_alone = most + log(np.sum(np.exp(out[:N_ALONE, 0] - most)))
    heard.well = exp(out[WELL, 0] - heard.log_alone) + exp(out[BLED, 0] - heard.log_alone)
