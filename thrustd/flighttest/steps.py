"""Throttle steps: the thrust's change against what the aircraft's motion asks for, with no model of an engine.

    X = (D + m g f_t) / cos a,   D = q S (C_D0 + k C_L^2)       thrust of all engines that the motion asks for
    error of a step = change of T - change of X,   X by the accelerometer, and by the energy height of air data

Of a step only the change is looked at: what is the same before and after it (zeros, most of the drag, the mass) falls
out. Ray 1994 (NASA TM-4591) judges thrust calculations in this way.
"""

from collections.abc import Iterator, Sequence

import msgspec
import numpy as np
from scipy.special import stdtrit

from thrustd.core.columns import Floats
from thrustd.flighttest.aerodynamics import RATE_S, coefficients
from thrustd.flighttest.flown import Flown
from thrustd.flighttest.polar import Polar
from thrustd.flighttest.transients import LEAST_PCT, movements
from thrustd.flighttest.uncertainty import mean_of

QUIET_S = RATE_S // 2  # beside the movement: rates of air data still hold a part of it
MEAN_S = 10
TURN_G = 0.1  # load factor within 1 +- this on both sides


class ThrottleStep(msgspec.Struct, frozen=True):
    """One movement of the throttles; thrusts are changes of all engines together, N."""

    flight: str
    start_s: float
    n1_from_pct: float  # mean of the engines
    n1_to_pct: float
    thrust_n: float
    accel_n: float  # by the accelerometer
    air_n: float  # by the energy height
    accel_error_n: float  # thrust minus accelerometer, and its random 95 % uncertainty
    accel_error_n_u95: float
    air_error_n: float
    air_error_n_u95: float
    outside: tuple[str, ...]  # accel, air: whose error is larger than its uncertainty


class Gain(msgspec.Struct, frozen=True):
    """Slope of the thrust's changes over those of the motion, minus 1, with its 95 % half interval; steps."""

    error: float
    u95: float
    steps: int


def throttle_steps(one: Flown, polar: Polar) -> list[ThrottleStep]:
    """Of a flight; those with steady throttles and straight flight on both sides."""
    (record, engines), motion = one.flight[:2], one.motion
    thrust_n = np.asarray(np.sum([record[f"thrust_N_{engine}"] for engine in engines], axis=0))
    n1_pct = np.mean([record[f"n1_pct_{engine}"] for engine in engines], axis=0)
    asked_n = {
        "accel": _asked_n(one, thrust_n, motion.excess_g - one.zero.mean_g, polar),
        "air": _asked_n(one, thrust_n, motion.energy_g, polar),
    }
    found = []
    for before, after in _sides(record.time_s, n1_pct, motion.load_g):
        levels = float(n1_pct[before].mean()), float(n1_pct[after].mean())
        change_n = _change(thrust_n, before, after)[0]
        by = {way: _change(thrust_n - column, before, after) for way, column in asked_n.items()}
        if abs(levels[1] - levels[0]) >= LEAST_PCT and np.isfinite([*by["accel"], *by["air"]]).all():
            found.append(
                ThrottleStep(
                    one.name, float(record.time_s[before.stop]) + QUIET_S, *levels, change_n,
                    change_n - by["accel"][0], change_n - by["air"][0], *by["accel"], *by["air"],
                    tuple(way for way, (error_n, u95) in by.items() if abs(error_n) > u95),
                )
            )  # fmt: skip
    return found


def gain_of(steps: Sequence[ThrottleStep], way: str) -> Gain:
    """`way`: accel or air. Weighed with the random uncertainty of each; fewer than two tell no interval: NaN."""
    if len(steps) < 2:
        return Gain(np.nan, np.nan, len(steps))
    weight = np.array([1.0 / getattr(step, f"{way}_error_n_u95") for step in steps])
    ours = weight * [step.thrust_n for step in steps]
    asked = weight * [getattr(step, f"{way}_n") for step in steps]
    slope = float(asked @ ours / (asked @ asked))
    rest = ours - slope * asked
    std = float(np.sqrt(rest @ rest / (len(steps) - 1) / (asked @ asked)))
    return Gain(slope - 1.0, float(stdtrit(len(steps) - 1, 0.975)) * std, len(steps))


def _asked_n(one: Flown, thrust_n: Floats, excess_g: Floats, polar: Polar) -> Floats:
    found = coefficients(one.motion, thrust_n, one.mass_kg, excess_g)
    off_n = (found.drag - polar.drag(found.lift**2)) * one.motion.area_pa_m2 / np.cos(one.motion.alpha_rad)
    return np.asarray(thrust_n - off_n)


def _sides(time_s: Floats, n1_pct: Floats, load_g: Floats) -> Iterator[tuple[slice, slice]]:
    """Rows before and after every movement, if nothing else moves there."""
    moves = movements(time_s, n1_pct)
    ends = [-1, *(last for _, last in moves)], [*(first for first, _ in moves), len(time_s)]
    for place, (first, last) in enumerate(moves):
        before = slice(first - QUIET_S - MEAN_S, first - QUIET_S)
        after = slice(last + QUIET_S + 1, last + QUIET_S + 1 + MEAN_S)
        alone = before.start > ends[0][place] and after.stop <= ends[1][place + 1]
        if alone and all((abs(load_g[side] - 1.0) < TURN_G).all() for side in (before, after)):
            yield before, after


def _change(values: Floats, before: slice, after: slice) -> tuple[float, float]:
    """Of the means, with its random 95 % uncertainty."""
    one, other = mean_of(values[before]), mean_of(values[after])
    return other.mean - one.mean, float(np.hypot(one.random_u95, other.random_u95))
