"""Drag polar of one or more flights: C_D0, e and L/D with intervals, and what each doubt costs.

Three answers side by side: the thrust of the log with the accelerometer's excess thrust, the same with the excess
thrust of air data (energy height), and brochure thrust alone. Random errors are in the fit; every systematic source is
then shifted by one sigma and the polar fitted again, so the budget shows where the interval comes from. The fused
thrust of an engine is off by a constant of its own in each flight, a deck by the same for all.
"""

from collections.abc import Iterator, Sequence
from math import hypot, sqrt
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from thrustd.core.aircraft import Wing
from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError, UsageError
from thrustd.core.measures import SIGMAS_95
from thrustd.core.steady import SteadyLimits
from thrustd.core.types import Progress
from thrustd.flighttest.flight import Flight, absent, read_flight
from thrustd.flighttest.flown import LEFT_OUT, Flown, flown
from thrustd.flighttest.mass_sheet import MassSheet
from thrustd.flighttest.performance_result import BesideKnown, Interval, Performance, PerformancePoint, PolarResult
from thrustd.flighttest.polar import Polar, PolarPoints, fit_polar
from thrustd.flighttest.steps import gain_of, throttle_steps
from thrustd.flighttest.windows import watched
from thrustd.installation.shipped import AIRCRAFT, aircraft_data
from thrustd.records.once import check_once, columns_sha256


class Way(NamedTuple):
    """Which thrust and which excess thrust."""

    name: str
    thrust: str
    energy: bool
    together: bool  # errors of the engines are one error, of all flights too


class Shift(NamedTuple):
    """One systematic source, by one sigma; None = all flights together."""

    source: str
    flight: int | None
    engine: int | None


def read_wing(where: Path | None = None) -> Wing:
    """Of an aircraft's file, None: the shipped one; UsageError when it has none."""
    wing = aircraft_data(where).wing
    if wing is None:
        raise UsageError(f"{where or AIRCRAFT}: no [wing]; expected area_m2, span_m and accel_x_std_g")
    return wing


def performance_of(
    logs: Sequence[Path], aircraft: Path | None, sheets: Sequence[MassSheet], limits: SteadyLimits,
    marks: str | None = None, deck: Path | None = None, advance: Progress = lambda share, what: None,
) -> Performance:  # fmt: skip
    """Of logs or recordings, with a mass sheet each, or one for all, or none; UsageError, RecordingError: one line."""
    wing = read_wing(aircraft)
    if len(sheets) not in (0, 1, len(logs)):
        raise UsageError(f"--mass-sheet: {len(sheets)} given for {len(logs)} logs; expected one per log, or one")
    flights, notes, fused, seen = [], [], True, dict[str, str]()
    for number, path in enumerate(logs):
        flight = read_flight(path, deck, aircraft)
        check_once(seen, str(path), columns_sha256(flight.record))
        _check_engines(flight, aircraft_data(aircraft).engines)
        flights.append(flown(flight, wing, sheets[number % len(sheets)] if sheets else None, limits, marks))
        notes += [f"{flight.name}: {note}" for note in flight.record.notes if "derived" in note]
        fuel = [name for name in flight.record.channels if name.startswith("fuel_flow_kg_s_")]
        missing = flight.missing_s([*watched(flight, limits), *fuel])
        notes += [f"{flight.name}: {absent(missing)}"] if missing else []
        fused = fused and flight.fused
        advance((number + 1) / len(logs), flight.name)
    return performance(flights, wing, fused, notes)


def _check_engines(flight: Flight, engines: int) -> None:
    if len(flight.engines) != engines:
        there = ", ".join(f"n1_pct_{engine}" for engine in flight.engines)
        expected = f"expected all {engines} engines of the aircraft's file: a polar needs their whole thrust"
        raise RecordingError(f"{flight.name}: {there} alone; {expected}")


def performance(flights: Sequence[Flown], wing: Wing, fused: bool, notes: Sequence[str] = ()) -> Performance:
    """RecordingError when the points do not make a polar."""
    first = "fused" if fused else "brochure"
    ways = [Way(f"{first} thrust, accelerometer", "thrust", False, not fused),
            Way(f"{first} thrust, energy height", "thrust", True, not fused)]  # fmt: skip
    if fused:
        ways.append(Way("brochure thrust, accelerometer", "brochure", False, True))
    results = [_result(flights, way, wing.aspect_ratio) for way in ways]
    best = fit_polar(_points(flights, ways[0]))
    stds = best.point_std(_points(flights, ways[0]))
    told = zip(stds.tolist(), ((stds.min() / stds) ** 2).tolist(), strict=True)
    points = [point for one in flights for point in _told(one, ways[0], best, told)]
    steps = [step for one in flights for step in throttle_steps(one, best)]
    zeros = {one.name: [one.zero.mean_g, one.zero.std_g] for one in flights}
    gains = {way: gain_of(steps, way) for way in ("accel", "air")}
    known, said = _beside(results[0], wing), [*notes, *map(_senseless, results)]
    return Performance(results, known, points, _rms_n(points), steps, gains, zeros, [line for line in said if line])


def _senseless(polar: PolarResult) -> str:
    """Elliptic lift of a plane wing has e = 1: nothing has more; and nothing flies without drag."""
    e, drag = polar.oswald, polar.zero_lift_drag
    if e.low > 1.0:
        said = f"e = {e.value:.2f} ({e.low:.2f} to {e.high:.2f}): above 1"
        return f"{polar.of}: {said}; are thrust, mass and pitch right?"
    if drag.low < 0.0:
        said = f"C_D0 = {drag.value:.4f} ({drag.low:.4f} to {drag.high:.4f}): may be below 0"
        return f"{polar.of}: {said}; are thrust and the sign of the accelerometer right?"
    return ""


def _beside(polar: PolarResult, wing: Wing) -> list[BesideKnown]:
    drag, oswald = polar.zero_lift_drag, polar.oswald
    return [
        BesideKnown(one.zero_lift_drag, one.oswald, one.source, drag.low <= one.zero_lift_drag <= drag.high,
                    oswald.low <= one.oswald <= oswald.high)
        for one in wing.known if not isinstance(one, str)
    ]  # fmt: skip


def _result(flights: Sequence[Flown], way: Way, aspect_ratio: float) -> PolarResult:
    base = fit_polar(_points(flights, way))
    at = _numbers(base, aspect_ratio)
    moved: dict[str, Floats] = {}
    for shift in _shifts(flights, way):
        change = _numbers(fit_polar(_points(flights, way, shift)), aspect_ratio) - at
        moved[shift.source] = np.hypot(moved.get(shift.source, 0.0), change)
    systematic = SIGMAS_95 * np.sqrt(sum(change**2 for change in moved.values()))
    random = float(stdtrit(max(base.points - 2, 1), 0.975)) * _spread(base, aspect_ratio)
    zero_lift, oswald, ratio = (
        Interval(value, value - hypot(r, s), value + hypot(r, s), r, s)
        for value, r, s in zip(at.tolist(), random.tolist(), systematic.tolist(), strict=True)
    )
    budget = {source: float(change[0]) for source, change in moved.items()}
    budget["random"] = float(random[0]) / SIGMAS_95
    return PolarResult(way.name, zero_lift, oswald, ratio, base.scatter_g, base.points, budget)


def _numbers(polar: Polar, aspect_ratio: float) -> Floats:
    """C_D0, e, largest L/D."""
    return np.array((polar.zero_lift, polar.efficiency(aspect_ratio), polar.best_ratio))


def _spread(polar: Polar, aspect_ratio: float) -> Floats:
    """One sigma of `_numbers` from the random covariance."""
    zero_lift, factor = polar.zero_lift, polar.factor
    slopes = np.array((
        (1.0, 0.0),
        (0.0, -polar.efficiency(aspect_ratio) / factor),
        (-polar.best_ratio / (2 * zero_lift), -polar.best_ratio / (2 * factor)),
    ))  # fmt: skip
    return np.asarray(np.sqrt(np.diag(slopes @ polar.covariance @ slopes.T)))


def _shifts(flights: Sequence[Flown], way: Way) -> Iterator[Shift]:
    if way.together:
        yield Shift("thrust", None, None)
    for number, one in enumerate(flights):
        if not way.together:
            yield from (Shift("thrust", number, engine) for engine in range(len(one.flight.engines)))
        yield Shift("mass", number, None)
        if not way.energy:
            yield Shift("accelerometer zero", number, None)


def _points(flights: Sequence[Flown], way: Way, shift: Shift | None = None) -> PolarPoints:
    """The points that are used of all flights, one source shifted by one sigma."""
    parts = []
    for number, one in enumerate(flights):
        mine = shift is not None and shift.flight in (None, number)
        parts.append(np.array(_flight_points(one, way, shift if mine else None))[:, one.used])
    return PolarPoints(*np.concatenate(parts, axis=1))


def _flight_points(one: Flown, way: Way, shift: Shift | None) -> PolarPoints:
    thrust_n, weight_n = one.thrust_n[way.thrust], one.weight_n
    excess_g = one.energy_g if way.energy else one.excess_g
    excess_std_g = one.energy_std_g if way.energy else one.excess_std_g
    if shift is not None:
        stds_n = one.thrust_std_n[way.thrust]
        if shift.source == "thrust":
            thrust_n = thrust_n + (stds_n.sum(axis=1) if shift.engine is None else stds_n[:, shift.engine])
        elif shift.source == "mass":
            weight_n = weight_n * (1.0 + one.mass_std)
        else:
            excess_g = excess_g + one.zero.std_g
    lift = (weight_n * one.load_g - thrust_n * np.sin(one.alpha_rad)) / one.area_pa_m2
    drag = (thrust_n * np.cos(one.alpha_rad) - weight_n * excess_g) / one.area_pa_m2
    per_g = weight_n / one.area_pa_m2
    drag_std = np.hypot(one.thrust_random_n[way.thrust] / one.area_pa_m2, np.hypot(excess_std_g, one.doubt_g) * per_g)
    return PolarPoints(lift * lift, one.lift2_std, drag, drag_std, per_g)


def _why(one: Flown, i: int) -> str:
    """What most of a point's variance is from, in words."""
    moves_g = hypot(float(one.thrust_random_n["thrust"][i] / one.weight_n[i]), float(one.excess_std_g[i]))
    apart_g = abs(float(one.apart_g[i])) / sqrt(2.0)
    parts = {
        f"moves {1e3 * moves_g:.1f} mg": moves_g,
        f"air {-1e3 * one.apart_g[i]:+.1f} mg": apart_g,
        "": one.spread_g / sqrt(2.0),
    }
    return max(parts, key=lambda part: parts[part])


def _told(one: Flown, way: Way, polar: Polar, told: Iterator[tuple[float, float]]) -> Iterator[PerformancePoint]:
    points = _flight_points(one, way, None)
    per_drag_n = one.area_pa_m2 / np.cos(one.alpha_rad)
    error_n = (points.drag - polar.drag(points.lift2)) * per_drag_n
    for i, window in enumerate(one.windows):
        std, counts = next(told) if one.used[i] else (np.nan, 0.0)
        yield PerformancePoint(
            flight=one.name,
            name=window.name,
            start_s=window.start_s,
            end_s=window.end_s,
            mach=float(one.mach[i]),
            altitude_m=float(one.altitude_m[i]),
            weight_n=float(one.weight_n[i]),
            thrust_n=float(one.thrust_n["thrust"][i]),
            brochure_n=float(one.thrust_n["brochure"][i]),
            c_l=float(np.sqrt(points.lift2[i])),
            c_d=float(points.drag[i]),
            c_d_u95=SIGMAS_95 * std,
            missing_s=int(one.missing_s[i]),
            energy_minus_accel_n=float(one.weight_n[i] * (one.energy_g[i] - one.excess_g[i])),
            thrust_error_n=float(error_n[i]),
            thrust_error_n_u95=float(SIGMAS_95 * std * per_drag_n[i]),
            left_out=LEFT_OUT[int(one.why[i])],
            counts_pct=100.0 * counts,
            why=_why(one, i),
        )


def _rms_n(points: Sequence[PerformancePoint]) -> float:
    used = [point.energy_minus_accel_n for point in points if not point.left_out]
    return sqrt(float(np.mean(np.square(used))))
