"""What the aircraft's own acceleration says of an engine's thrust: W f_x less the other engines' is one source more.

    y = W f_x - T_others = T + e,     W: mean weight of the aircraft's file

It is asked where an engine's own sources contradict each other: a thrust that is lost moves the aircraft, a sensor that
fails does not. Its errors, each a Gaussian of the flight or of some time, as parts of W and of the wing:

    mass      m W f_x                       as likely anywhere in what the file allows
    drag      d S q                         of the wing, without any polar
    lift      l W n_z, in flight            it points forward by the angle of attack
    wheels    r W                           and a runway that slopes
    others    half of what the mounts and the brochure of other engines differ by
    slow      s W over 100 s                flaps, gear, turns, wind: recorded changes of 175 to 264 N within 2 s and
                                            605 to 1410 N within 100 s (docs/accuracy.md)
    shaking   from row to row, as seen beside the source that goes with it best; a row is the mean of its steps

Brakes are not known: on the ground it counts only while the aircraft accelerates by more than they could let it, and no
wing could bear it. It may
lie (a gust, an air brake, its own sensor): then at best as well as the hypothesis that fits it best, so that it never
makes one likelier than another by more than 1 / LIES.

    ln p(y, f_x | h) - ln p(y | h) >= max over all - ln(1 / LIES)
Reference: Huber, A robust version of the probability ratio test, Ann. Math. Stat. 36 (1965) 1753.
"""

from math import exp, log, sqrt
from typing import Any, NamedTuple

import numpy as np

from thrustd.core.aircraft import ANY_MASS_KG, AircraftData, Installed
from thrustd.core.columns import Floats
from thrustd.core.jit import compiled
from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.sensors.errors import SILENT_N2, THRUST_N2, Parts, as_on_the_bench, covariance
from thrustd.sensors.onsets import ACCELERATION_OFF, AIR_OFF, BROCHURE_OFF, MOUNTS_OFF, N_ALONE, UNFAILED
from thrustd.sensors.past import (
    ALONG_G,
    BY_MOTION_N,
    COUNTS,
    FUEL_FLOW,
    LEVEL_N,
    LOWER,
    MACH,
    MORE_G,
    MOVES,
    N_SOURCES,
    OTHERS_STD_N,
    PRESSURE_PA,
    RATE_N_S,
    SAID,
    SHAKES_N,
    T_S,
    UPPER,
)  # fmt: skip
from thrustd.sensors.positive import factor_large, forward

DRAG, LIFT, ROLLS, SLOW, SLOW_S = 0.04, 0.1, 0.02, 0.026, 100.0  # of S q or of the weight
SHAKES, LEAST_SHAKES, NEW, RARE = 0.01, 0.002, 0.1, 3.0  # of the weight at first; from row to row; sigmas
LATE_S, LATE_LASTS_S = 0.8, 4.0  # another engine's row is as old
FLIES_MACH, ROLLS_G, MOST_LIFT = 0.2, 0.1, 2.0  # in between it may rotate, and lift points forward at once
LIES = 1e-3
DOUBT = 0.05


class Motion(NamedTuple):
    """Of the aircraft."""

    weight_n: float  # 0: nobody knows it
    mass: float  # sigma, relative
    wing_m2: float


SILENT = Motion(0.0, 0.0, 0.0)


def motion_of(aircraft: AircraftData) -> Motion:
    """SILENT where its file does not say how heavy it may be."""
    wing = aircraft.wing
    if wing is None or wing.mass_kg == ANY_MASS_KG:
        return SILENT
    least, most = wing.mass_kg
    return Motion(
        0.5 * (least + most) * STANDARD_GRAVITY_M_S2, (most - least) / (least + most) / sqrt(3.0), wing.area_m2
    )


@compiled
def moves(others: Any, e: int, row: Floats, motion: Motion, trusted: bool) -> None:
    """Puts into `row` (WIDTH,) of engine e what the motion says of its thrust; `others`: PAST by engine."""
    row[BY_MOTION_N], row[OTHERS_STD_N], row[MOVES] = motion.weight_n * row[ALONG_G], 0.0, 0.0
    for o in range(len(others)):
        if o != e and others[o].n > 0:
            newest = others[o].rows[0]
            both = newest[COUNTS + UPPER] != 0.0 and newest[COUNTS + LOWER] != 0.0
            apart_n = newest[SAID + UPPER] + newest[SAID + LOWER] - newest[SAID + FUEL_FLOW]
            if not both or newest[COUNTS + FUEL_FLOW] == 0.0:
                row[BY_MOTION_N] -= newest[LEVEL_N]
            else:
                row[BY_MOTION_N] -= newest[SAID + FUEL_FLOW] + 0.5 * apart_n
                row[OTHERS_STD_N] += 0.5 * apart_n
    wheels_bear = row[PRESSURE_PA] * motion.wing_m2 * MOST_LIFT < motion.weight_n
    if trusted and motion.weight_n > 0.0 and (row[MACH] > FLIES_MACH or (row[ALONG_G] > ROLLS_G and wheels_bear)):
        row[MOVES] = 1.0
    before, shakes_n = others[e].rows[0], motion.weight_n * SHAKES
    if others[e].n > 0 and before[MOVES] * row[MOVES] != 0.0:
        far_n, moved_n = RARE * before[SHAKES_N], row[BY_MOTION_N] - before[BY_MOTION_N]
        far_n = min(far_n, abs(moved_n - row[SAID] - row[SAID + 1] + before[SAID] + before[SAID + 1]))  # NaN is not
        for s in range(FUEL_FLOW, N_SOURCES):
            far_n = min(far_n, abs(moved_n - row[SAID + s] + before[SAID + s]))
        shakes_n = sqrt((1.0 - NEW) * before[SHAKES_N] ** 2 + NEW * 0.5 * far_n**2)
    row[SHAKES_N] = max(shakes_n, motion.weight_n * LEAST_SHAKES)


@compiled
def _errors_n2(rows: Floats, a: int, b: int, motion: Motion) -> float:
    """Covariance of what it is wrong by in two rows."""
    one, other, weight_n2 = rows[a], rows[b], motion.weight_n**2
    apart_s = abs(one[T_S] - other[T_S])
    n2 = weight_n2 * motion.mass**2 * one[ALONG_G] * other[ALONG_G]
    n2 += (DRAG * motion.wing_m2) ** 2 * one[PRESSURE_PA] * other[PRESSURE_PA]
    n2 += weight_n2 * ROLLS**2
    if one[MACH] > FLIES_MACH and other[MACH] > FLIES_MACH:
        n2 += weight_n2 * LIFT**2 * (1.0 + one[MORE_G] * other[MORE_G])
    n2 += one[OTHERS_STD_N] * other[OTHERS_STD_N]
    n2 += weight_n2 * SLOW**2 * exp(-apart_s / SLOW_S)
    n2 += LATE_S**2 * one[RATE_N_S] * other[RATE_N_S] * exp(-apart_s / LATE_LASTS_S)
    return float(n2 + (one[SHAKES_N] ** 2 if a == b else 0.0))


@compiled
def beside(
    c: Floats, y: Floats, to_n2: Floats, rows: Floats, n: int, parts: Parts, motion: Motion
) -> tuple[Floats, Floats, Floats]:
    """Covariance (6 n, 6 n) of what all sources said and then the motion, that (6 n,), its covariance with the thrust.

    `c`, `y`, `to_n2`: the same of all sources (5 n).
    """
    own = len(y)
    wide, said, to = np.zeros((own + n, own + n)), np.zeros(own + n), np.zeros(own + n)
    wide[:own, :own], said[:own], to[:own] = c, y, to_n2
    for a in range(n):
        if rows[a, MOVES] == 0.0:
            wide[own + a, own + a] = SILENT_N2
            continue
        said[own + a], to[own + a] = rows[a, BY_MOTION_N], THRUST_N2 if a == 0 else 0.0
        for b in range(a + 1):
            if rows[b, MOVES] != 0.0:
                wide[own + a, own + b] = wide[own + b, own + a] = _errors_n2(rows, a, b, motion)
        wide[own + a, own + a] += THRUST_N2
        for s in range(N_SOURCES):
            if rows[a, COUNTS + s] != 0.0:
                at = a * N_SOURCES + s
                wide[own + a, at] = wide[at, own + a] = parts[s] * THRUST_N2
    return wide, said, to


@compiled
def all_moves(rows: Floats, n: int, share: float, installed: Installed, engines: int, motion: Motion) -> float:
    """ln of the odds that the mounts of all engines are wrong, and not all brochures, by the motion alone.

    Either gives all thrusts at once, so nothing of it is taken from who is in doubt himself; other engines err as this
    one does. Both are judged by the errors of both: who fails slowly still shows what changes.
    """
    c = covariance(rows, n, (share, 1.0 - share, 1.0, 1.0, 1.0), as_on_the_bench(installed))
    seen, wide, by_mounts, by_brochure = rows[:n].copy(), np.zeros((n, n)), np.zeros(n), np.zeros(n)
    seen[:, OTHERS_STD_N] = 0.0
    for a in range(n):
        for s in range(N_SOURCES):
            seen[a, MOVES] *= rows[a, COUNTS + s]
        wide[a, a] = SILENT_N2
        if seen[a, MOVES] == 0.0:
            continue
        said, half_n = rows[a, SAID : SAID + N_SOURCES], rows[a, OTHERS_STD_N]
        by_mounts[a] = rows[a, BY_MOTION_N] - half_n - said[UPPER] - said[LOWER]
        by_brochure[a] = rows[a, BY_MOTION_N] + half_n - np.mean(said[FUEL_FLOW:])
        for b in range(a + 1):
            if seen[b, MOVES] != 0.0:
                block = c[a * N_SOURCES : (a + 1) * N_SOURCES, b * N_SOURCES : (b + 1) * N_SOURCES]
                errors_n2 = np.sum(block[:FUEL_FLOW, :FUEL_FLOW]) + np.mean(block[FUEL_FLOW:, FUEL_FLOW:])
                errors_n2 -= 2.0 * THRUST_N2 if a == b else 0.0
                wide[a, b] = wide[b, a] = engines**2 * errors_n2 + _errors_n2(seen, a, b, motion)
    factor_large(wide)
    forward(wide, by_mounts)
    forward(wide, by_brochure)
    return float(0.5 * (np.sum(by_mounts**2) - np.sum(by_brochure**2)))


@compiled
def at_odds(out: Floats) -> float:
    """How likely it is that a sensor or the engine failed; a scale or an installation moves no aircraft, either."""
    odds = 1.0
    for which in UNFAILED:
        odds -= out[which, 0]
    return float(odds)


@compiled
def agree(logs: Floats, together: float, heard: Any, odds: float, out: Floats) -> None:
    """Changes the probabilities of `out` (N_HYPOTHESES, 3) by what the motion says of each.

    `logs` (N_ALONE,): ln of the evidence with it; `together`: see `all_moves`; `odds`: see `weigh_shared`. An
    accelerometer at fault may show anything. The worst that it said of each holds while the doubt lasts, because rows
    that thin forget it; of all it says nothing, if it contradicts itself, as where the aircraft rotates.
    """
    now, least = logs - heard.logs, log(LIES)
    heard.moved[:] = np.minimum(heard.moved, np.maximum(now - now.max(), least))
    heard.all_moved[0] = min(heard.all_moved[0], max(together, least))
    heard.all_moved[1] = min(heard.all_moved[1], max(-together, least))
    told, of_all = np.exp(heard.moved - heard.moved.max()), np.exp(heard.all_moved - heard.all_moved.max())
    is_one, better = 1.0 / (1.0 + exp(-odds)), max(told[MOUNTS_OFF], told[BROCHURE_OFF])
    out[:N_ALONE, 0] *= told
    out[ACCELERATION_OFF, 0] *= is_one + (1.0 - is_one) * better * of_all[0]
    out[AIR_OFF, 0] *= better * of_all[1]
    out[:, 0] /= np.sum(out[:, 0])
