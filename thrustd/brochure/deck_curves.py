"""The deck's surface and spool curves as compiled arithmetic on plain numbers; equations in `deck` and `deck_data`."""

from math import exp, isfinite, nan, sqrt
from typing import Any

import numpy as np
import numpy.typing as npt

from thrustd.compiled import compiled

SEA_LEVEL_PRESSURE_PA = 101325.0  # ISO 2533
SEA_LEVEL_TEMPERATURE_K = 288.15  # ISO 2533
TROPOPAUSE_M = 11000.0  # ISO 2533
ZERO_CELSIUS_K = 273.15
SCALE, LENGTH, FLOW_LOW, FLOW_HIGH, MACH_LOW, MACH_HIGH = range(6)  # of a surface
MACH_SLOPE, EXPONENT, PCT_LOW, PCT_HIGH = range(4)  # of a spool curve
KNOTS, LOGS, SLOPES = range(3)
Floats = npt.NDArray[np.float64]


def _surface_n(rows: Floats, numbers: Floats, corrected_kg_s: float, mach: float) -> float:
    """G(w, M); a row holds the powers of u and, last, the nozzle's coefficient."""
    mach = min(max(mach, numbers[MACH_LOW]), numbers[MACH_HIGH])
    stagnation = 1.0 + 0.2 * mach * mach
    speed, expansion = mach / sqrt(stagnation), stagnation**-3.5 - 1.0
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
        return value + slope_n_s_kg * (corrected_kg_s - inside)
    return value - slope_n_s_kg * length * (1.0 - exp((corrected_kg_s - low) / length))


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
    isa_k = max(SEA_LEVEL_TEMPERATURE_K - 0.0065 * pressure_altitude_m, 216.65)
    pressure_pa = SEA_LEVEL_PRESSURE_PA * (isa_k / SEA_LEVEL_TEMPERATURE_K) ** 5.25588
    if pressure_altitude_m > TROPOPAUSE_M:
        pressure_pa *= exp(-(pressure_altitude_m - TROPOPAUSE_M) / 6341.62)
    static_k = sat_degc + ZERO_CELSIUS_K if isfinite(sat_degc) else isa_k
    stagnation = 1.0 + 0.2 * mach * mach
    delta_t = pressure_pa / SEA_LEVEL_PRESSURE_PA * stagnation**3.5
    return delta_t, static_k * stagnation / SEA_LEVEL_TEMPERATURE_K


ratios: Any = compiled(_ratios, "UniTuple(f8, 2)(f8, f8, f8)", "numpy")


@compiled
def _spool(curve: Floats, line: Floats, speed_pct: float, mach: float, theta_t: float) -> tuple[float, bool]:
    """(corrected fuel flow that the spool speed stands for [kg/s], outside the flights of the fit)."""
    if curve.shape[1] == 0 or not speed_pct > 0.0:
        return nan, False
    corrected_pct = speed_pct / sqrt(theta_t)
    flow = exp(hermite_log(curve, corrected_pct) + line[MACH_SLOPE] * mach) * theta_t ** line[EXPONENT]
    return flow, not line[PCT_LOW] <= corrected_pct <= line[PCT_HIGH]


def _routes(
    rows: Floats, numbers: Floats, curve_1: Floats, line_1: Floats, curve_2: Floats, line_2: Floats,
    fuel_flow_kg_s: float, n1_pct: float, n2_pct: float, mach: float, pressure_altitude_m: float, sat_degc: float,
) -> tuple[float, float, float, float, float, bool]:  # fmt: skip
    """Thrusts by fuel flow, N1, N2 [N]; corrected fuel flow by the first two [kg/s]; N1 outside the flights."""
    delta_t, theta_t = ratios(mach, pressure_altitude_m, sat_degc)
    flow = fuel_flow_kg_s / (delta_t * sqrt(theta_t)) if fuel_flow_kg_s > 0.0 else nan
    n1_flow, n1_outside = _spool(curve_1, line_1, n1_pct, mach, theta_t)
    n2_flow, _ = _spool(curve_2, line_2, n2_pct, mach, theta_t)
    return (
        delta_t * surface_n(rows, numbers, flow, mach),
        delta_t * surface_n(rows, numbers, n1_flow, mach),
        delta_t * surface_n(rows, numbers, n2_flow, mach),
        flow,
        n1_flow,
        n1_outside,
    )


_CURVE = "f8[:, ::1], f8[::1]"
_SIGNATURE = f"Tuple((f8, f8, f8, f8, f8, b1))({_CURVE}, {_CURVE}, {_CURVE}, f8, f8, f8, f8, f8, f8)"
routes: Any = compiled(_routes, _SIGNATURE, "numpy")
