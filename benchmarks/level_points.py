"""A flight test of the twin: level points at seven speeds, with a drag polar that is known exactly.

The motion is given, speed held and changed at constant altitude; the thrust it takes follows from the polar,

    T = m (dV/dt) + q S (C_D0 + k C_L^2),    C_L = m g n / (q S)

and the fan speeds are those at which the twin's engines, each with its own health, make half of it. Specific forces are
those of the motion, so thrust, accelerations and air data agree to the newton.
"""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from thrustd.core.atmosphere import ZERO_CELSIUS_K, dynamic_pressure_pa, isa_k, sound_m_s, stagnation
from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.records.recording import Recording, make_recording
from thrustd.twin.aircraft import LIFT_SLOPE_PER_RAD, WING_M2, ZERO_LIFT_RAD
from thrustd.twin.engine import Health, fuel_lead_kg_s, steady_fuel_kg_s, steady_n2_pct, true_thrust_n
from thrustd.twin.engine_start import SIDES
from thrustd.twin.fast import FloatArray

SAMPLE_HZ = 20.0
HOLD_S, CHANGE_S, START_S = 75.0, 40.0, 60.0
SPEEDS_M_S = (125.0, 112.0, 100.0, 90.0, 80.0, 72.0, 66.0)  # indicated, fast to slow
WIND_M_S, WIND_S = 0.15, 6.0  # gusts along the path: one sigma and how long
GUST_G = 0.01
N1_GRID_PCT = np.linspace(25.0, 104.0, 80)


class Polar(NamedTuple):
    """The truth."""

    zero_lift: float = 0.022
    factor: float = 0.045
    mass_kg: float = 6200.0  # when the log begins


def level_points(seed: int, healths: tuple[Health, ...], polar: Polar) -> Recording:
    """Profile of the flight, repeatable by its seed; the mass along it is the column mass_kg."""
    rng = np.random.default_rng([seed, 11])
    altitude_m, day_k = float(rng.uniform(1500, 4500)), float(rng.uniform(-10, 12))
    time_s, indicated = _speeds(rng.permutation(SPEEDS_M_S) * float(rng.uniform(0.97, 1.03)))
    n = len(time_s)
    static_k = np.full(n, float(isa_k(altitude_m)) + day_k)
    density = dynamic_pressure_pa(1.0, altitude_m) * 2 / sound_m_s(static_k[0]) ** 2
    speed = indicated / np.sqrt(density / 1.225)
    wind = WIND_M_S * _smooth_noise(rng, n, WIND_S)
    mach = (speed + wind) / sound_m_s(static_k)
    load = 1.0 + GUST_G * _smooth_noise(rng, n, 0.5)
    area = dynamic_pressure_pa(mach, altitude_m) * WING_M2
    mass = np.full(n, polar.mass_kg)
    air = mach, np.full(n, altitude_m), static_k
    for _ in range(3):  # the mass falls with the fuel, which follows from the thrust
        lift = mass * STANDARD_GRAVITY_M_S2 * load / area
        along = np.gradient(speed, time_s) / STANDARD_GRAVITY_M_S2
        wanted_n = mass * STANDARD_GRAVITY_M_S2 * along + area * (polar.zero_lift + polar.factor * lift * lift)
        engines = [_engine(time_s, wanted_n / 2, air, health) for health in healths]
        mass = polar.mass_kg - np.cumsum(sum(e["fuel_flow_kg_s"] for e in engines)) / SAMPLE_HZ
    alpha = ZERO_LIFT_RAD + lift / LIFT_SLOPE_PER_RAD
    thrust_n = sum(e["thrust_N"] for e in engines)
    excess = (thrust_n * np.cos(alpha) - area * (polar.zero_lift + polar.factor * lift * lift)) / (
        mass * STANDARD_GRAVITY_M_S2
    )
    columns = {
        "time_s": time_s, "mach": mach, "pressure_altitude_m": air[1], "sat_degC": static_k - ZERO_CELSIUS_K,
        "tat_degC": static_k * stagnation(mach) - ZERO_CELSIUS_K, "mass_kg": mass,
        "accel_x_g": excess * np.cos(alpha) + load * np.sin(alpha), "accel_y_g": np.zeros(n),
        "accel_z_g": load * np.cos(alpha) - excess * np.sin(alpha), "pitch_deg": np.degrees(alpha),
    }  # fmt: skip
    for side, engine in zip(SIDES, engines, strict=True):
        columns |= {f"{name}_{side}": column for name, column in engine.items()}
    return make_recording(f"level_points_seed{seed}", columns, {"source": "twin, level points", "seed": str(seed)})


def _speeds(levels: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Time and indicated speed: each level held, smooth changes between."""
    corners = [0.0, START_S]
    values = [levels[0], levels[0]]
    for level in levels:
        corners += [corners[-1] + CHANGE_S, corners[-1] + CHANGE_S + HOLD_S]
        values += [level, level]
    time_s = np.arange(0.0, corners[-1], 1 / SAMPLE_HZ)
    return time_s, gaussian_filter1d(np.interp(time_s, corners, values), 2.0 * SAMPLE_HZ, mode="nearest")


def _engine(
    time_s: FloatArray, wanted_n: FloatArray, air: tuple[FloatArray, FloatArray, FloatArray], health: Health
) -> dict[str, FloatArray]:
    """The fan speed that makes the thrust while nothing moves, and what the engine does at it."""
    steady = health._replace(lead_s=0.0)
    table = np.stack(
        [true_thrust_n(time_s, np.full_like(time_s, n1), *air, steady, health.fuel_factor) for n1 in N1_GRID_PCT]
    )
    below = np.clip((table <= wanted_n).sum(axis=0) - 1, 0, len(N1_GRID_PCT) - 2)
    at = np.arange(len(time_s))
    low, high = table[below, at], table[below + 1, at]
    part = np.clip((wanted_n - low) / (high - low), 0.0, 1.0)
    n1_pct = N1_GRID_PCT[below] + part * (N1_GRID_PCT[1] - N1_GRID_PCT[0])
    n1_pct = gaussian_filter1d(n1_pct, 1.0 * SAMPLE_HZ, mode="nearest")  # a governor does not follow gusts
    nominal = steady_fuel_kg_s(n1_pct, *air)
    return {
        "n1_pct": n1_pct,
        "n2_pct": steady_n2_pct(n1_pct, air[0], air[2]),
        "fuel_flow_kg_s": health.fuel_factor * fuel_lead_kg_s(n1_pct, time_s, nominal),
        "thrust_N": true_thrust_n(time_s, n1_pct, *air, health, health.fuel_factor),
    }


def _smooth_noise(rng: np.random.Generator, n: int, seconds: float) -> FloatArray:
    """Unit variance."""
    noise = gaussian_filter1d(rng.standard_normal(n), seconds * SAMPLE_HZ, mode="wrap")
    return np.asarray(noise / noise.std())
