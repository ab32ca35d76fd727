"""What a deck file holds, how its curves are read, and what makes it valid.

Thrust surface: a polynomial in corrected fuel flow and Mach inside a box, its tangent in fuel flow beyond, held in Mach
beyond. N1 curve: monotone cubic Hermite (Fritsch & Carlson 1980). Both are C1 and rise everywhere, or the deck is refused.
"""

from bisect import bisect_right
from itertools import pairwise
from math import inf
from typing import Literal

import msgspec

from thrustd.errors import DeckError


class ThrustSurface(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """G(w, M) = sum c[i][j] (w / scale)^i M^j in newton, trusted inside the box."""

    fuel_flow_scale_kg_s: float
    coefficients_n: tuple[tuple[float, ...], ...]
    fuel_flow_box_kg_s: tuple[float, float]  # tangent beyond it
    mach_box: tuple[float, float]  # held beyond it
    fitted_fuel_flow_kg_s: tuple[float, float]  # where data were: beyond it the deck says extrapolating
    fitted_mach: tuple[float, float]


class N1Curve(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """ln w over corrected N1: cubic Hermite through knots with given slopes, tangent beyond the ends."""

    engine: int
    corrected_n1_pct: tuple[float, ...]
    log_fuel_flow: tuple[float, ...]
    slope_per_pct: tuple[float, ...]
    mach_slope: float
    fitted_n1_pct: tuple[float, float]
    relative_std: float  # thrust, against the fuel-flow route on flights not used for the fit


class Spread(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One sigma of the deck against a real engine."""

    relative: float  # engine to engine and wear
    floor_n: float
    extrapolating_relative: float  # added in quadrature outside the fitted region
    missing_temperature_relative: float  # added when ISA stands in for the measured temperature
    transient_n1_rate_pct_s: float  # above this the throttle is moving
    transient_lag_s: float  # thrust leads or lags the deck by about this much while it moves


class DeckData(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The file `models/brochure/*.json`."""

    schema: Literal["thrustd.deck.v1"]
    name: str
    engine_type: str
    provenance: tuple[str, ...]
    errors: dict[str, float]  # measured at the fit, relative, -
    thrust: ThrustSurface
    n1: tuple[N1Curve, ...]
    spread: Spread


def corrected_thrust(surface: ThrustSurface, corrected_kg_s: float, mach: float) -> float:
    """G(w, M) in N: the polynomial inside the box, its tangent in w beyond, held in M beyond."""
    mach = min(max(mach, surface.mach_box[0]), surface.mach_box[1])
    low, high = surface.fuel_flow_box_kg_s
    inside = min(max(corrected_kg_s, low), high)
    scale = surface.fuel_flow_scale_kg_s
    x = inside / scale
    value = slope = 0.0
    for row in reversed(surface.coefficients_n):
        slope = slope * x + value
        value = value * x + _horner(row, mach)
    return value + slope * (corrected_kg_s - inside) / scale


def _horner(coefficients: tuple[float, ...], x: float) -> float:
    value = 0.0
    for coefficient in reversed(coefficients):
        value = value * x + coefficient
    return value


def hermite(curve: N1Curve, n_pct: float) -> float:
    """ln of corrected fuel flow at corrected N1: cubic Hermite, tangents beyond the end knots."""
    knots, values, slopes = curve.corrected_n1_pct, curve.log_fuel_flow, curve.slope_per_pct
    if n_pct <= knots[0]:
        return values[0] + slopes[0] * (n_pct - knots[0])
    if n_pct >= knots[-1]:
        return values[-1] + slopes[-1] * (n_pct - knots[-1])
    right = bisect_right(knots, n_pct)
    left = right - 1
    width = knots[right] - knots[left]
    t = (n_pct - knots[left]) / width
    u = 1.0 - t
    return (
        values[left] * u * u * (1.0 + 2.0 * t)
        + values[right] * t * t * (3.0 - 2.0 * t)
        + width * t * u * (slopes[left] * u - slopes[right] * t)
    )


def check_deck(data: DeckData, where: str) -> None:
    surface = data.thrust
    for name, pair in (
        ("thrust.fuel_flow_box_kg_s", surface.fuel_flow_box_kg_s),
        ("thrust.mach_box", surface.mach_box),
    ):
        if not 0.0 <= pair[0] < pair[1] < inf:
            raise DeckError(f"{where}: {name} = {list(pair)}: expected 0 <= low < high")
    if not surface.fuel_flow_scale_kg_s > 0.0:
        raise DeckError(f"{where}: thrust.fuel_flow_scale_kg_s = {surface.fuel_flow_scale_kg_s}: expected > 0")
    _check_monotone_surface(surface, where)
    if len({curve.engine for curve in data.n1}) != len(data.n1):
        raise DeckError(f"{where}: n1: one curve per engine expected, got {[c.engine for c in data.n1]}")
    for curve in data.n1:
        _check_curve(curve, where)


def _check_monotone_surface(surface: ThrustSurface, where: str) -> None:
    low, high = surface.fuel_flow_box_kg_s
    for i in range(8):
        mach = surface.mach_box[0] + (surface.mach_box[1] - surface.mach_box[0]) * i / 7
        thrusts = [corrected_thrust(surface, low + (high - low) * k / 40, mach) for k in range(42)]
        if not all(a < b for a, b in pairwise(thrusts)):
            raise DeckError(f"{where}: thrust.coefficients_n: thrust falls with fuel flow at Mach {mach:.2f}")


def _check_curve(curve: N1Curve, where: str) -> None:
    name = f"{where}: n1 of engine {curve.engine}"
    n = len(curve.corrected_n1_pct)
    if n < 2 or len(curve.log_fuel_flow) != n or len(curve.slope_per_pct) != n:
        raise DeckError(f"{name}: expected the same number (>= 2) of knots, values and slopes")
    for label, row in (
        ("corrected_n1_pct", curve.corrected_n1_pct),
        ("log_fuel_flow", curve.log_fuel_flow),
    ):
        if not all(a < b for a, b in pairwise(row)):
            raise DeckError(f"{name}: {label}: expected strictly rising values, got {list(row)}")
    rises = [b - a for a, b in pairwise(curve.log_fuel_flow)]
    secants = [rise / (b - a) for rise, (a, b) in zip(rises, pairwise(curve.corrected_n1_pct), strict=True)]
    # Fritsch & Carlson 1980: slopes within three times the neighbouring secants keep a Hermite cubic monotone
    for i, slope in enumerate(curve.slope_per_pct):
        limit = 3.0 * min(secants[max(i - 1, 0)], secants[min(i, n - 2)])
        if not 0.0 <= slope <= limit * (1.0 + 1e-9):
            raise DeckError(f"{name}: slope_per_pct[{i}] = {slope}: expected 0 to {limit:.6g}")
