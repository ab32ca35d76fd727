"""The deck's surface and spool curves as compiled arithmetic on plain numbers; equations in `deck` and `deck_data`."""

from math import exp, isfinite, log, nan, sqrt
from typing import Any, NamedTuple

from numba import types

from thrustd.core.atmosphere import ZERO_CELSIUS_K, isa_k, stagnation, total_pressure_ratio, total_temperature_ratio
from thrustd.core.columns import Floats
from thrustd.core.jit import compiled, named

SCALE, LENGTH, FLOW_LOW, FLOW_HIGH, MACH_LOW, MACH_HIGH = range(6)  # of a surface
MACH_SLOPE, EXPONENT, PCT_LOW, PCT_HIGH, LINE_STD = range(5)  # of a spool curve
# of the spread, and where the surface was fitted
RELATIVE, EXTRAPOLATING, NO_TEMPERATURE, LAG_N_PER_PCT_S, FLOOR_N, TRANSIENT_PCT_S, FUEL_FLOW = range(7)
FITTED_FLOW_LOW, FITTED_FLOW_HIGH, FITTED_MACH_LOW, FITTED_MACH_HIGH = range(7, 11)
KNOTS, LOGS, SLOPES = range(3)
_Said = tuple[float, float, float, bool, bool, float, float, float, float, float, float]


class DeckNumbers(NamedTuple):
    """A deck for one engine, flattened: what compiled code reads of it."""

    surface: Floats  # a row: powers of flight speed and, last, the nozzle's coefficient
    box: Floats
    spread: Floats
    curve_1: Floats  # of N1: (3, n_knots)
    line_1: Floats
    curve_2: Floats  # of N2
    line_2: Floats


class DeckInputs(NamedTuple):
    """What the deck may use at one instant; NaN = missing or stale."""

    fuel_flow_kg_s: float
    n1_pct: float
    n2_pct: float
    mach: float
    pressure_altitude_m: float
    sat_degc: float
    n1_rate_pct_s: float


@compiled
def _surface(rows: Floats, numbers: Floats, corrected_kg_s: float, mach: float) -> tuple[float, float]:
    """G(w, M) and w dG/dw, both N; a row holds the powers of u and, last, the nozzle's coefficient."""
    mach = min(max(mach, numbers[MACH_LOW]), numbers[MACH_HIGH])
    ratio = stagnation(mach)
    speed, expansion = mach / sqrt(ratio), ratio**-3.5 - 1.0
    low, scale, length = numbers[FLOW_LOW], numbers[SCALE], numbers[LENGTH]
    inside = min(max(corrected_kg_s, low), numbers[FLOW_HIGH])
    x = inside / scale
    value = slope = 0.0
    nozzle = rows.shape[1] - 1
    for i in range(rows.shape[0] - 1, -1, -1):
        row = 0.0
        for j in range(nozzle - 1, -1, -1):
            row = row * speed + rows[i, j]
        row += rows[i, nozzle] * expansion
        slope = slope * x + value
        value = value * x + row
    slope_n_s_kg = slope / scale
    if corrected_kg_s >= low:
        return value + slope_n_s_kg * (corrected_kg_s - inside), corrected_kg_s * slope_n_s_kg
    bend = exp((corrected_kg_s - low) / length)
    return value - slope_n_s_kg * length * (1.0 - bend), corrected_kg_s * slope_n_s_kg * bend


def _surface_n(rows: Floats, numbers: Floats, corrected_kg_s: float, mach: float) -> float:
    """G(w, M)."""
    return _surface(rows, numbers, corrected_kg_s, mach)[0]


surface_n: Any = compiled(_surface_n, "f8(f8[:, ::1], f8[::1], f8, f8)", "numpy")


def _hermite(curve: Floats, n_pct: float) -> float:
    """H(n); `curve` (3, n_knots): speed, ln of fuel flow, its slope."""
    knots, values, slopes = curve[KNOTS], curve[LOGS], curve[SLOPES]
    last = knots.size - 1
    if n_pct <= knots[0]:
        return values[0] + slopes[0] * (n_pct - knots[0])
    if n_pct >= knots[last]:
        return values[last] + slopes[last] * (n_pct - knots[last])
    right = 1
    while knots[right] <= n_pct:
        right += 1
    left = right - 1
    width = knots[right] - knots[left]
    t = (n_pct - knots[left]) / width
    u = 1.0 - t
    return (
        values[left] * u * u * (1.0 + 2.0 * t)
        + values[right] * t * t * (3.0 - 2.0 * t)
        + width * t * u * (slopes[left] * u - slopes[right] * t)
    )


hermite_log: Any = compiled(_hermite, "f8(f8[:, ::1], f8)", "numpy")


def _ratios(mach: float, pressure_altitude_m: float, sat_degc: float) -> tuple[float, float]:
    static_k = sat_degc + ZERO_CELSIUS_K if isfinite(sat_degc) else isa_k(pressure_altitude_m)
    return total_pressure_ratio(mach, pressure_altitude_m), total_temperature_ratio(mach, static_k)


ratios: Any = compiled(_ratios, "UniTuple(f8, 2)(f8, f8, f8)", "numpy")


@compiled
def spool_flow(curve: Floats, line: Floats, speed_pct: float, mach: float, theta_t: float) -> tuple[float, bool]:
    """(corrected fuel flow that the spool speed stands for [kg/s], outside the flights of the fit)."""
    if curve.shape[1] == 0 or not speed_pct > 0.0:
        return nan, False
    corrected_pct = speed_pct / sqrt(theta_t)
    flow = exp(hermite_log(curve, corrected_pct) + line[MACH_SLOPE] * mach) * theta_t ** line[EXPONENT]
    return flow, not line[PCT_LOW] <= corrected_pct <= line[PCT_HIGH]


@compiled
def _weight_of_n1(flow_n: float, n1_n: float, rate_pct_s: float, transient_pct_s: float) -> float:
    # in transients N1 follows the thrust better than fuel flow; the blend keeps the hand-over smooth
    if not isfinite(n1_n):
        return 0.0 if isfinite(flow_n) else nan
    if not isfinite(flow_n):
        return 1.0
    if not isfinite(rate_pct_s):
        return 0.0
    ratio = (rate_pct_s / transient_pct_s) ** 2
    return ratio / (1.0 + ratio)


@compiled
def _is_outside(spread: Floats, corrected_kg_s: float, mach: float) -> bool:
    fitted = spread[FITTED_FLOW_LOW] <= corrected_kg_s <= spread[FITTED_FLOW_HIGH]
    return not (fitted and spread[FITTED_MACH_LOW] <= mach <= spread[FITTED_MACH_HIGH])


@compiled
def _std_n(
    spread: Floats, thrust_n: float, per_fuel_n: float, outside: bool, n1_std: float, isa: bool, rate_pct_s: float
) -> float:
    """`per_fuel_n`: dF/d ln w. `n1_std`: relative, what the line of N1 adds. `isa`: the temperature is not measured."""
    relative_sq = spread[RELATIVE] ** 2 + (spread[EXTRAPOLATING] ** 2 if outside else 0.0)
    relative_sq += n1_std**2
    relative_sq += spread[NO_TEMPERATURE] ** 2 if isa else 0.0
    lag_n = spread[LAG_N_PER_PCT_S] * (rate_pct_s if isfinite(rate_pct_s) else 0.0)
    engine_n2 = (spread[FUEL_FLOW] * per_fuel_n) ** 2 + spread[FLOOR_N] ** 2
    return sqrt(engine_n2 + relative_sq * thrust_n**2 + lag_n**2)


@compiled
def _middle(a: float, b: float, c: float) -> float:
    """Of the finite ones; of two the first."""
    if isfinite(a) and isfinite(b) and isfinite(c):
        return max(min(a, b), min(max(a, b), c))
    return a if isfinite(a) else b if isfinite(b) else c


def _estimate(deck: DeckNumbers, given: DeckInputs) -> _Said:
    """Thrust [N], one sigma, weight of N1 (NaN: no estimate), outside the fit, transient; thrusts by fuel flow, N1, N2;
    dF/d ln w of the corrected fuel flow w [kg/s]; the same and ln w where fuel flow, N1 and N2 put w in the median.

    NaN where an input is missing; of the temperature that is a guess at it.
    """
    if not (isfinite(given.mach) and isfinite(given.pressure_altitude_m)):
        return nan, nan, nan, False, False, nan, nan, nan, nan, nan, nan
    mach, rate_pct_s, spread = max(given.mach, 0.0), given.n1_rate_pct_s, deck.spread
    delta_t, theta_t = ratios(mach, given.pressure_altitude_m, given.sat_degc)
    flow = given.fuel_flow_kg_s / (delta_t * sqrt(theta_t)) if given.fuel_flow_kg_s > 0.0 else nan
    n1_flow, n1_outside = spool_flow(deck.curve_1, deck.line_1, given.n1_pct, mach, theta_t)
    n2_flow, _ = spool_flow(deck.curve_2, deck.line_2, given.n2_pct, mach, theta_t)
    flow_n = delta_t * surface_n(deck.surface, deck.box, flow, mach)
    n1_n = delta_t * surface_n(deck.surface, deck.box, n1_flow, mach)
    n2_n = delta_t * surface_n(deck.surface, deck.box, n2_flow, mach)
    weight = _weight_of_n1(flow_n, n1_n, rate_pct_s, spread[TRANSIENT_PCT_S])
    if not isfinite(weight):
        return nan, nan, nan, False, False, nan, nan, n2_n, nan, nan, nan
    by_n1 = weight > 0.5
    w = n1_flow if by_n1 else flow
    outside = _is_outside(spread, w, mach) or (by_n1 and n1_outside)
    thrust_n = flow_n if weight == 0.0 else n1_n if weight == 1.0 else flow_n + weight * (n1_n - flow_n)
    per_fuel_n = delta_t * _surface(deck.surface, deck.box, w, mach)[1]
    n1_std, isa = weight * deck.line_1[LINE_STD], not isfinite(given.sat_degc)
    std_n = _std_n(spread, thrust_n, per_fuel_n, outside, n1_std, isa, rate_pct_s)
    moves, burnt = abs(rate_pct_s) > spread[TRANSIENT_PCT_S], _middle(flow, n1_flow, n2_flow)
    slope_n = delta_t * _surface(deck.surface, deck.box, burnt, mach)[1]
    return thrust_n, std_n, weight, outside, moves, flow_n, n1_n, n2_n, per_fuel_n, slope_n, log(burnt)


_ROW, _TABLE = types.float64[::1], types.float64[:, ::1]
NUMBERS: Any = named(DeckNumbers, _TABLE, _ROW, _ROW, _TABLE, _ROW, _TABLE, _ROW)
INPUTS: Any = named(DeckInputs, *[types.float64] * 7)
_tuple_of: Any = types.Tuple
_SAID = _tuple_of([types.float64] * 3 + [types.boolean] * 2 + [types.float64] * 6)
estimate: Any = compiled(_estimate, _SAID(NUMBERS, INPUTS), "numpy")


def _along(deck: DeckNumbers, rows: Floats, out: Floats) -> None:
    """Of many instants, inputs (n, 7): all but the weight of N1 and the two flags into (n, 8)."""
    for i in range(len(rows)):
        row = rows[i]
        said = estimate(deck, DeckInputs(row[0], row[1], row[2], row[3], row[4], row[5], row[6]))
        out[i, 0], out[i, 1], out[i, 2], out[i, 3], out[i, 4] = said[0], said[1], said[5], said[6], said[7]
        out[i, 5], out[i, 6], out[i, 7] = said[8], said[9], said[10]


along: Any = compiled(_along, types.void(NUMBERS, _TABLE, _TABLE), "numpy")
