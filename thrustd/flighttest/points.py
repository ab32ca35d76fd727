"""Test points: what a steady window says of thrust, fuel and the air around, each mean with its 95 % uncertainty.

    corrected:  F / delta_t,   W_f / (delta_t sqrt(theta_t)),   N1 / sqrt(theta_t)      (Walsh & Fletcher, ch. 4)
    TSFC = W_f / F,  g/(kN s);      (s_TSFC / TSFC)^2 = (s_F / F)^2 + (1 - 2 e) (s_W / W)^2,   e = d ln F / d ln W

delta_t, theta_t: total pressure over 101325 Pa, total temperature over 288.15 K. e: where the deck makes the thrust of
the fuel flow, an error of the meter is in both, and in s_F too. A fused thrust is that of the mounts first: e = 0.
"""

from collections.abc import Sequence
from math import sqrt

import msgspec
import numpy as np

from thrustd.core.atmosphere import ZERO_CELSIUS_K, total_pressure_ratio, total_temperature_ratio
from thrustd.core.columns import Floats
from thrustd.core.steady import SteadyLimits
from thrustd.core.types import Status
from thrustd.flighttest.flight import Flight
from thrustd.flighttest.terms import budget_in
from thrustd.flighttest.uncertainty import Mean, mean_of
from thrustd.flighttest.windows import Window, spans, steady_windows, watched, windows_by
from thrustd.records.recording import Recording
from thrustd.records.rows import Row
from thrustd.replay.budget import Budget

AIRCRAFT = "mach", "pressure_altitude_m", "sat_degC", "accel_x_g", "accel_z_g", "pitch_deg", "aoa_deg"
NEEDED = "thrust_N", "fuel_flow_kg_s"  # of an engine, beside what has to be steady
MICRO = 1e6  # kg/(N s) -> g/(kN s)
OFTEN = 0.1  # a status bit that is on for this share of a point is told
KEPT = Status.CHANNEL_OPEN | Status.WIRE_FAULT | Status.LINK_LOST  # of the installation, not of the estimate
TELLING = Status(~int(KEPT) & sum(map(int, Status)))


class Point(msgspec.Struct, frozen=True):
    """One test point."""

    name: str
    start_s: float
    end_s: float
    moved: list[str]  # channels that are outside their limits
    missing_s: dict[str, int]  # seconds without a value, by channel; means are of the others
    spans: dict[str, float]  # largest minus smallest in the window, by channel
    values: dict[str, Mean]  # by channel, engine's name behind it
    status: dict[str, list[str]]  # by engine: bits that were on for a tenth of the time or more
    budgets: list[Budget] = []  # by engine, the terms of its band; empty: the log does not tell them

    @property
    def steady(self) -> bool:
        """Inside all limits, all of the time."""
        return not self.moved and not self.missing_s

    def row(self) -> Row:
        """Flat, for tables: `NAME`, `NAME_u95`, and of the thrust `NAME_random_u95`, `NAME_systematic_u95`."""
        row: Row = {"point": self.name, "start_s": self.start_s, "end_s": self.end_s, "steady": self.steady}
        for name, value in self.values.items():
            row |= {name: value.mean, f"{name}_u95": value.u95}
            if value.systematic_u95:
                row |= {f"{name}_random_u95": value.random_u95, f"{name}_systematic_u95": value.systematic_u95}
        return row | {f"status_{engine}": " ".join(bits) for engine, bits in self.status.items()}


class TestPoints(msgspec.Struct, frozen=True):
    """All points of a flight."""

    __test__ = False  # no test of pytest's

    flight: str
    thrust: str  # fused, or brochure where there is no estimate
    engines: tuple[str, ...]
    limits: SteadyLimits
    points: list[Point]
    missing_s: dict[str, int]  # seconds of the flight without a value, by channel that has to be steady

    def rows(self) -> list[Row]:
        return [{"flight": self.flight} | point.row() for point in self.points]


def find_points(
    flight: Flight,
    limits: SteadyLimits | None = None,
    windows: Sequence[Window] | None = None,
    marks: str | None = None,
    fuel_std: float = 0.0,
) -> TestPoints:
    """Of windows that are given, of `marks` (a channel, or a CSV of windows), or found by the limits.

    fuel_std: systematic part of a fuel flow, one sigma, relative. RecordingError when there is no steady window, or no
    sample inside one that was given.
    """
    limits = limits or SteadyLimits()
    if windows is None and marks:
        windows = windows_by(flight, marks)
    flight = flight.per_second()
    if windows is None:
        windows = steady_windows(flight, limits)
    allowed = {name: quantity.limit for name, quantity in watched(flight, limits).items()}
    points = [_point(flight, window, allowed, fuel_std) for window in windows]
    thrust = "fused" if flight.fused else "brochure"
    return TestPoints(flight.name, thrust, flight.engines, limits, points, flight.missing_s(allowed))


def _point(flight: Flight, window: Window, allowed: dict[str, float], fuel_std: float) -> Point:
    part = flight.record.window(window.start_s, window.end_s)
    values = {name: mean_of(part[name]) for name in AIRCRAFT if name in part}
    for engine in flight.engines:
        values |= {f"{name}_{engine}": value for name, value in _engine(part, engine, fuel_std).items()}
    found = spans(flight, window, list(allowed))
    moved = [name for name, limit in allowed.items() if found[name] > limit]
    status = {engine: bits for engine in flight.engines if (bits := _status(part, engine))}
    needed = [*allowed, "sat_degC", *(f"{name}_{engine}" for engine in flight.engines for name in NEEDED)]
    missing = flight._replace(record=part).missing_s(name for name in needed if name in part)
    outside_s = round(window.end_s - window.start_s) - len(part)
    missing |= {"samples": outside_s} if outside_s > 1 else {}  # a mark that begins before the log, or ends after it
    terms = [budget_in(part, engine, flight.band) for engine in flight.engines] if flight.band else []
    return Point(
        window.name,
        window.start_s,
        window.end_s,
        moved,
        missing,
        found,
        values,
        status,
        [each for each in terms if each is not None],
    )


def _engine(part: Recording, engine: str, fuel_std: float) -> dict[str, Mean]:
    static_k = part["sat_degC"] + ZERO_CELSIUS_K
    delta = total_pressure_ratio(part["mach"], part["pressure_altitude_m"])
    theta = total_temperature_ratio(part["mach"], static_k)
    thrust_n, n1_pct = part[f"thrust_N_{engine}"], part[f"n1_pct_{engine}"]
    std_n = mean_of(part[f"thrust_std_N_{engine}"]).mean
    std = std_n / abs(mean_of(thrust_n).mean)
    found = {
        "thrust_N": mean_of(thrust_n, std_n),
        "thrust_corrected_N": _scaled(thrust_n / delta, std),
        "n1_pct": mean_of(n1_pct),
        "n1_corrected_pct": mean_of(n1_pct / np.sqrt(theta)),
    }
    brochure_n = part[f"brochure_N_{engine}"]
    if np.isfinite(brochure_n).any():
        found["brochure_N"] = mean_of(brochure_n, mean_of(part[f"brochure_std_N_{engine}"]).mean)
    fuel = part.channels.get(f"fuel_flow_kg_s_{engine}")
    if fuel is not None:
        found["fuel_flow_kg_s"] = _scaled(fuel, fuel_std)
        found["fuel_flow_corrected_kg_s"] = _scaled(fuel / (delta * np.sqrt(theta)), fuel_std)
        per_fuel = mean_of(part.channels.get(f"thrust_per_fuel_{engine}", np.zeros(len(part)))).mean
        found["tsfc_g_kN_s"] = _scaled(MICRO * fuel / thrust_n, sqrt(std**2 + (1.0 - 2.0 * per_fuel) * fuel_std**2))
    for name in ("n2_pct", "load_share"):
        if f"{name}_{engine}" in part:
            found[name] = mean_of(part[f"{name}_{engine}"])
    return found


def _scaled(values: Floats, std: float) -> Mean:
    """Of something whose systematic part is `std` of it."""
    return mean_of(values, abs(mean_of(values).mean) * std)


def _status(part: Recording, engine: str) -> list[str]:
    words = part.channels.get(f"status_{engine}")
    if words is None or not np.isfinite(words).any():
        return []
    bits = np.nan_to_num(words).astype(np.int64)
    return [str(bit.name).lower() for bit in TELLING if np.mean(bits & int(bit) != 0) >= OFTEN]
