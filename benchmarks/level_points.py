"""A flight test of the twin: level points at seven speeds, with a drag polar that is known exactly.

The engines start, the aircraft rolls, climbs, and holds and changes its speed at constant altitude. The motion is
given; the thrust it takes follows from the polar,

    T = m (dV/dt + g dh/dt / V) + q S (C_D0 + k C_L^2),    C_L = m g n / (q S), 0 on the ground

and the fan speeds are those at which the twin's engines, each with its own health, make half of it. Specific forces are
those of the motion, so thrust, accelerations and air data agree to the newton.
"""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from thrustd.core.atmosphere import ZERO_CELSIUS_K, dynamic_pressure_pa, isa_k, sound_m_s, stagnation
from thrustd.core.columns import Floats
from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.records.recording import Recording, make_recording
from thrustd.twin.aircraft import LIFT_SLOPE_PER_RAD, WING_M2, ZERO_LIFT_RAD
from thrustd.twin.engine import Health, engine_columns, true_thrust_n
from thrustd.twin.engine_start import SIDES, with_engine_start

SAMPLE_HZ = 20.0
HOLD_S, CHANGE_S, START_S = 75.0, 40.0, 60.0
IDLE_S, ROLL_S, CLIMB_M_S = 20.0, 30.0, 8.0
LIFT_OFF_M_S = 70.0  # indicated
ROTATES_S = 1.5
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
    level_m, day_k = float(rng.uniform(1500, 4500)), float(rng.uniform(-10, 12))
    time_s, indicated, altitude_m = _course(rng.permutation(SPEEDS_M_S) * float(rng.uniform(0.97, 1.03)), level_m)
    n, flying = len(time_s), altitude_m > 0.0
    static_k = np.asarray(isa_k(altitude_m)) + day_k
    density = dynamic_pressure_pa(1.0, altitude_m) * 2 / sound_m_s(static_k) ** 2
    speed = indicated / np.sqrt(density / 1.225)
    wind = WIND_M_S * _smooth_noise(rng, n, WIND_S) * flying
    mach = (speed + wind) / sound_m_s(static_k)
    load = 1.0 + GUST_G * _smooth_noise(rng, n, 0.5) * flying
    area = dynamic_pressure_pa(mach, altitude_m) * WING_M2
    mass = np.full(n, polar.mass_kg)
    air = mach, altitude_m, static_k
    true_m = altitude_m * static_k / isa_k(altitude_m)  # what the energy is made of
    path = np.gradient(true_m, time_s) / np.maximum(speed, 30.0)
    along = np.gradient(speed, time_s) / STANDARD_GRAVITY_M_S2 + path
    for _ in range(3):  # the mass falls with the fuel, which follows from the thrust
        lift = np.where(flying, mass * STANDARD_GRAVITY_M_S2 * load / np.maximum(area, 1.0), 0.0)
        drag_n = area * (polar.zero_lift + polar.factor * lift * lift)
        wanted_n = mass * STANDARD_GRAVITY_M_S2 * along + drag_n
        engines = [_engine(time_s, wanted_n / 2, air, health) for health in healths]
        mass = polar.mass_kg - np.cumsum(sum(e["fuel_flow_kg_s"] for e in engines)) / SAMPLE_HZ
    settled = np.where(flying, ZERO_LIFT_RAD + lift / LIFT_SLOPE_PER_RAD, 0.0)
    alpha = np.where(altitude_m < level_m, gaussian_filter1d(settled, ROTATES_S * SAMPLE_HZ), settled)
    thrust_n = sum(e["thrust_N"] for e in engines)
    excess = (thrust_n * np.cos(alpha) - drag_n) / (mass * STANDARD_GRAVITY_M_S2)
    excess *= speed > 0.0  # brakes
    columns = {
        "time_s": time_s, "mach": mach, "pressure_altitude_m": altitude_m, "sat_degC": static_k - ZERO_CELSIUS_K,
        "tat_degC": static_k * stagnation(mach) - ZERO_CELSIUS_K, "mass_kg": mass,
        "accel_x_g": excess * np.cos(alpha) + load * np.sin(alpha), "accel_y_g": np.zeros(n),
        "accel_z_g": load * np.cos(alpha) - excess * np.sin(alpha), "pitch_deg": np.degrees(alpha + np.arcsin(path)),
    }  # fmt: skip
    for side, engine in zip(SIDES, engines, strict=True):
        columns |= {f"{name}_{side}": column for name, column in engine.items()}
    about = {"source": "twin, level points", "seed": str(seed)}
    return _started(make_recording(f"level_points_seed{seed}", columns, about), healths)


def _started(flight: Recording, healths: tuple[Health, ...]) -> Recording:
    """Behind a start of the engines, with the thrust that they make then."""
    whole = with_engine_start(flight)
    air = whole["mach"], whole["pressure_altitude_m"], whole["sat_degC"] + ZERO_CELSIUS_K
    made = {
        f"thrust_N_{side}": true_thrust_n(whole.time_s, whole[f"n1_pct_{side}"], *air, health, health.fuel_factor)
        for side, health in zip(SIDES, healths, strict=True)
    }
    return whole.with_channels(**made)


def _course(levels: Floats, level_m: float) -> tuple[Floats, Floats, Floats]:
    """Time, indicated speed, altitude: roll and climb, then each level held, smooth changes between."""
    rolled_s = IDLE_S + ROLL_S
    climbed_s = rolled_s + level_m / CLIMB_M_S
    corners, values = [0.0, IDLE_S, rolled_s, climbed_s, climbed_s + START_S], [0.0, 0.0, LIFT_OFF_M_S, *levels[[0, 0]]]
    for level in levels:
        corners += [corners[-1] + CHANGE_S, corners[-1] + CHANGE_S + HOLD_S]
        values += [level, level]
    time_s = np.arange(0.0, corners[-1], 1 / SAMPLE_HZ)
    heights = np.interp(time_s, (rolled_s, climbed_s), (0.0, level_m))
    speeds, heights = (
        gaussian_filter1d(column, 2.0 * SAMPLE_HZ, mode="nearest")
        for column in (np.interp(time_s, corners, values), heights)
    )
    return time_s, np.where(speeds > 0.01, speeds, 0.0), np.where(heights > 0.01, heights, 0.0)


def _engine(time_s: Floats, wanted_n: Floats, air: tuple[Floats, Floats, Floats], health: Health) -> dict[str, Floats]:
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
    return engine_columns(time_s, n1_pct, air, health)


def _smooth_noise(rng: np.random.Generator, n: int, seconds: float) -> Floats:
    """Unit variance."""
    noise = gaussian_filter1d(rng.standard_normal(n), seconds * SAMPLE_HZ, mode="wrap")
    return np.asarray(noise / noise.std())
