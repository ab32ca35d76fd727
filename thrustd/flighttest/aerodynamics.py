"""Lift and drag of a flight per second, from thrust, accelerations, attitude and air data.

    f_t = f_x cos a - f_z sin a              specific excess thrust, along the flight path (g)
    f_n = f_x sin a + f_z cos a              load factor
    D = T cos a - m g f_t,   L = m g f_n - T sin a,   C = force / (q S)

T acts along the body axis. a = pitch - path, the path from the climb rate: a tilted accelerometer tilts the pitch of
the same box, and f_t does not change with it. Where there is no pitch, a is the vane's. The same without accelerometer:

    f_t = dh/dt / V + dV/dt / g              rate of energy height, from air data (still air)

dh/dt: pressure altitude by the measured temperature over the standard one. Klein & Morelli 2006, ch. 3.
"""

from typing import NamedTuple

import numpy as np
from scipy.signal import savgol_filter

from thrustd.core.aircraft import Wing
from thrustd.core.atmosphere import ZERO_CELSIUS_K, dynamic_pressure_pa, isa_k, sound_m_s
from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError
from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.flighttest.flight import Flight

RATE_S = 11  # samples of a second that a rate is a parabola's slope over
SLOWEST_M_S = 30.0  # below it the aircraft rolls


class Motion(NamedTuple):
    """Each (n,), a row per second."""

    time_s: Floats
    alpha_rad: Floats
    excess_g: Floats  # by accelerometer
    energy_g: Floats  # by air data
    load_g: Floats
    area_pa_m2: Floats  # q S; NaN on the ground


class Coefficients(NamedTuple):
    lift: Floats
    drag: Floats


def motion_of(flight: Flight, wing: Wing) -> Motion:
    """RecordingError when neither pitch nor angle of attack is known, or an acceleration is missing."""
    record = flight.record
    for name in ("accel_x_g", "accel_z_g"):
        if name not in record:
            raise RecordingError(f"{flight.name}: no column {name!r}, which lift and drag need")
    static_k = record["sat_degC"] + ZERO_CELSIUS_K
    speed_m_s = record["mach"] * sound_m_s(static_k)
    altitude_m = record["pressure_altitude_m"]
    flying = speed_m_s > SLOWEST_M_S
    safe_m_s = np.maximum(speed_m_s, SLOWEST_M_S)
    climb = _rate(altitude_m) * static_k / isa_k(altitude_m) / safe_m_s
    alpha = _alpha(flight, np.arcsin(np.clip(climb, -0.5, 0.5)))
    along, normal = record["accel_x_g"], record["accel_z_g"]
    return Motion(
        record.time_s,
        alpha,
        along * np.cos(alpha) - normal * np.sin(alpha),
        climb + _rate(speed_m_s) / STANDARD_GRAVITY_M_S2,
        along * np.sin(alpha) + normal * np.cos(alpha),
        np.where(flying, dynamic_pressure_pa(record["mach"], altitude_m) * wing.area_m2, np.nan),
    )


def coefficients(motion: Motion, thrust_n: Floats, mass_kg: Floats, excess_g: Floats) -> Coefficients:
    """C_L, C_D (n,) from the thrust of all engines, the mass and one of the two excess thrusts."""
    weight_n = mass_kg * STANDARD_GRAVITY_M_S2
    lift_n = weight_n * motion.load_g - thrust_n * np.sin(motion.alpha_rad)
    drag_n = thrust_n * np.cos(motion.alpha_rad) - weight_n * excess_g
    return Coefficients(lift_n / motion.area_pa_m2, drag_n / motion.area_pa_m2)


def _alpha(flight: Flight, path_rad: Floats) -> Floats:
    record = flight.record
    if "pitch_deg" in record and np.isfinite(record["pitch_deg"]).any():
        return np.asarray(np.radians(record["pitch_deg"]) - path_rad)
    if "aoa_deg" in record and np.isfinite(record["aoa_deg"]).any():
        return np.asarray(np.radians(record["aoa_deg"]))
    raise RecordingError(f"{flight.name}: neither pitch_deg nor aoa_deg; lift and drag need one of them")


def _rate(values: Floats) -> Floats:
    """Per second; NaN near a value that is missing."""
    if len(values) < RATE_S:
        return np.full(len(values), np.nan)
    edges = "interp" if np.isfinite((values[:RATE_S], values[-RATE_S:])).all() else "constant"
    return np.asarray(savgol_filter(values, RATE_S, 2, deriv=1, mode=edges, cval=np.nan))
