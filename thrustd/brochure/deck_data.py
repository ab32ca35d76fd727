"""What a deck file holds, how its curves are read, and what makes it valid.

Thrust surface, with X = w / scale, u = M / sqrt(1 + 0.2 M^2) (flight speed over the total speed of sound: ram drag) and
q = (1 + 0.2 M^2)^-3.5 - 1 (static over total pressure: what the nozzles expand to):

    G(w, M) = sum_ij a_ij X^i u^j + sum_i b_i X^i q

inside a box; above it along the tangent in w; below it with a slope that dies out, so that the idle point is met,

    G(w) = G(w_0) - G'(w_0) L (1 - exp(-(w_0 - w) / L));

held in M beyond. Spool curves: monotone cubic Hermite (Fritsch & Carlson 1980).
Both are C1 and rise everywhere, or the deck is refused.
"""

from functools import lru_cache
from itertools import pairwise
from math import inf
from typing import Annotated, Literal

import msgspec
import numpy as np

from thrustd.brochure.deck_curves import hermite_log, surface_n
from thrustd.core.columns import Floats
from thrustd.core.errors import DeckError

Finite = Annotated[float, msgspec.Meta(ge=-1e9, le=1e9)]
NotNegative = Annotated[float, msgspec.Meta(ge=0.0, le=1e9)]
Positive = Annotated[float, msgspec.Meta(gt=0.0, le=1e9)]
Coefficients = Annotated[tuple[Finite, ...], msgspec.Meta(min_length=1, max_length=12)]
Knots = Annotated[tuple[Finite, ...], msgspec.Meta(min_length=2, max_length=200)]
Range = tuple[Finite, Finite]


class ThrustSurface(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """G(w, M) in newton."""

    fuel_flow_scale_kg_s: Positive
    speed_n: Annotated[tuple[Coefficients, ...], msgspec.Meta(min_length=2, max_length=12)]  # a[i][j]
    nozzle_n: Coefficients  # b[i]
    fuel_flow_box_kg_s: Range  # corrected; tangent above it
    idle_length_kg_s: Positive  # L of the bend below it
    mach_box: Range  # held beyond it
    fitted_fuel_flow_kg_s: Range  # where the pairs were: beyond it the deck says extrapolating
    fitted_mach: Range


class SpoolCurve(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """ln w = H(n) + mach_slope M + temperature_exponent ln theta_t, tangent beyond the end knots of H."""

    engine: Annotated[int, msgspec.Meta(ge=0, le=7)]
    corrected_pct: Knots
    log_fuel_flow: Knots
    slope_per_pct: Knots
    mach_slope: Finite
    temperature_exponent: Finite
    fitted_pct: Range
    relative_std: Positive  # thrust, against the fuel-flow source on flights left out of the fit


class Spread(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One sigma of the deck against a real engine. Behind ram drag a per cent of fuel flow is up to 1.8 % of thrust."""

    floor_n: Positive
    extrapolating_relative: Positive  # added in quadrature outside the fitted region
    missing_temperature_relative: Positive  # added when ISA stands in for the measured temperature
    transient_n1_rate_pct_s: Positive  # above this the throttle is moving
    thrust_per_n1_n: Positive  # thrust per per cent of N1 near cruise
    transient_lag_s: Positive  # thrust leads or lags the deck by about this much while it moves
    fuel_flow_relative: NotNegative = 0.0  # engine to engine and wear: thrust as by this much more or less fuel flow
    relative: NotNegative = 0.0  # the same, of thrust


class DeckData(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The file `models/brochure/*.json`."""

    schema: Literal["thrustd.deck.v1"]
    name: str
    engine_type: str
    provenance: tuple[str, ...]
    errors: dict[str, float]  # measured at the fit on data left out of it, relative, -
    thrust: ThrustSurface
    n1: tuple[SpoolCurve, ...]
    n2: tuple[SpoolCurve, ...]  # cross-check only
    spread: Spread


@lru_cache(maxsize=16)
def surface_numbers(surface: ThrustSurface) -> tuple[Floats, Floats]:
    """Coefficients and limits as `deck_curves.surface_n` reads them."""
    powers = max(map(len, surface.speed_n))
    rows = np.zeros((max(len(surface.speed_n), len(surface.nozzle_n)), powers + 1))
    for i, coefficients in enumerate(surface.speed_n):
        rows[i, : len(coefficients)] = coefficients
    rows[: len(surface.nozzle_n), powers] = surface.nozzle_n
    scale, length = surface.fuel_flow_scale_kg_s, surface.idle_length_kg_s
    return rows, np.array((scale, length, *surface.fuel_flow_box_kg_s, *surface.mach_box))


@lru_cache(maxsize=16)
def curve_numbers(curve: SpoolCurve | None) -> tuple[Floats, Floats]:
    """Knots (3, n) and the rest as `deck_curves` reads them; no knots for no curve."""
    if curve is None:
        return np.zeros((3, 0)), np.zeros(5)
    knots = np.array((curve.corrected_pct, curve.log_fuel_flow, curve.slope_per_pct), dtype=np.float64)
    line = (curve.mach_slope, curve.temperature_exponent, *curve.fitted_pct, curve.relative_std)
    return knots, np.array(line, dtype=np.float64)


def spread_numbers(data: DeckData) -> Floats:
    """The spread, and the box of the fit, as `deck_curves.estimate` reads them."""
    spread, surface = data.spread, data.thrust
    return np.array(
        (
            spread.relative,
            spread.extrapolating_relative,
            spread.missing_temperature_relative,
            spread.transient_lag_s * spread.thrust_per_n1_n,
            spread.floor_n,
            spread.transient_n1_rate_pct_s,
            spread.fuel_flow_relative,
            *surface.fitted_fuel_flow_kg_s,
            *surface.fitted_mach,
        ),
        dtype=np.float64,
    )


def corrected_thrust(surface: ThrustSurface, corrected_kg_s: float, mach: float) -> float:
    """G(w, M) in N."""
    return surface_n(*surface_numbers(surface), corrected_kg_s, mach)


def hermite(curve: SpoolCurve, n_pct: float) -> float:
    """H(n): ln of corrected fuel flow at corrected spool speed and Mach 0, theta_t 1."""
    return hermite_log(curve_numbers(curve)[0], n_pct)


def check_deck(data: DeckData, where: str) -> None:
    """Raise a DeckError that names what is not monotone or does not fit together."""
    surface = data.thrust
    for name, (low, high) in (
        ("thrust.fuel_flow_box_kg_s", surface.fuel_flow_box_kg_s),
        ("thrust.mach_box", surface.mach_box),
        ("thrust.fitted_fuel_flow_kg_s", surface.fitted_fuel_flow_kg_s),
        ("thrust.fitted_mach", surface.fitted_mach),
    ):
        if not 0.0 <= low < high < inf:
            raise DeckError(f"{where}: {name} = {[low, high]}: expected 0 <= low < high")
    _check_surface(surface, where)
    for spool, curves in (("n1", data.n1), ("n2", data.n2)):
        if len({curve.engine for curve in curves}) != len(curves):
            raise DeckError(f"{where}: {spool}: one curve per engine expected, got {[c.engine for c in curves]}")
        for curve in curves:
            _check_curve(curve, f"{where}: {spool} of engine {curve.engine}")


def _check_surface(surface: ThrustSurface, where: str) -> None:
    low, high = surface.fuel_flow_box_kg_s
    flows = [low + (high - low) * k / 60 for k in range(-1, 62)]  # one step into either tangent
    for i in range(21):
        mach = surface.mach_box[0] + (surface.mach_box[1] - surface.mach_box[0]) * i / 20
        thrusts = [corrected_thrust(surface, flow, mach) for flow in flows]
        if not all(a < b for a, b in pairwise(thrusts)):
            raise DeckError(f"{where}: thrust.speed_n: thrust must rise with fuel flow; it falls at Mach {mach:.2f}")


def _check_curve(curve: SpoolCurve, name: str) -> None:
    n = len(curve.corrected_pct)
    if len(curve.log_fuel_flow) != n or len(curve.slope_per_pct) != n:
        raise DeckError(f"{name}: expected the same number of knots, values and slopes")
    for label, row in (("corrected_pct", curve.corrected_pct), ("log_fuel_flow", curve.log_fuel_flow)):
        if not all(a < b for a, b in pairwise(row)):
            raise DeckError(f"{name}: {label} = {list(row)}: expected strictly rising values")
    rises = [b - a for a, b in pairwise(curve.log_fuel_flow)]
    secants = [rise / (b - a) for rise, (a, b) in zip(rises, pairwise(curve.corrected_pct), strict=True)]
    # Fritsch & Carlson 1980: slopes within three times the neighbouring secants keep a Hermite cubic monotone
    for i, slope in enumerate(curve.slope_per_pct):
        limit = 3.0 * min(secants[max(i - 1, 0)], secants[min(i, n - 2)])
        if not 0.0 < slope <= limit * (1.0 + 1e-9):
            raise DeckError(f"{name}: slope_per_pct[{i}] = {slope}: expected above 0, up to {limit:.6g}")
