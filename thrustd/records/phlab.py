"""PH-LAB recordings (FTIS at 10 Hz, openap at 1 Hz) into canonical channels and units.

FTIS `Ahrs1_bLongAcc` and `bLatAcc` are body-axis specific force; `bNormAcc` has 1 g removed, so
accel_z_g = bNormAcc + 1.
The openap files hold no body accelerations. They are *derived* from the flight path (and the notes say so):

    f_t = d(TAS)/dt / g0 + sin gamma            along the flight path, sin gamma = climb rate / TAS
    f_n = (cos gamma + TAS d(gamma)/dt / g0) / cos roll
    accel_x = f_t cos alpha + f_n sin alpha,    accel_z = f_n cos alpha - f_t sin alpha
    alpha = alpha_0 + f_n W / (q S C_L_alpha)

with the Citation II constants of the TU Delft course AE3212-II (S = 30 m2, C_L_alpha = 5.084 1/rad, alpha_0 = -1 deg).
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from thrustd.core.atmosphere import dynamic_pressure_pa
from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError
from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.records.loaded import Loaded
from thrustd.records.recording import TIME

POUND_PER_HOUR_KG_S = 0.45359237 / 3600
FOOT_M = 0.3048
KNOT_M_S = 1852 / 3600
WING_AREA_M2 = 30.0
LIFT_SLOPE_PER_RAD = 5.084
ZERO_LIFT_RAD = float(np.radians(-1.0))
MIN_AIRSPEED_M_S = 30.0  # below this the aircraft rolls: no flight path angle


class Source(NamedTuple):
    """Column = raw * scale + offset."""

    raw: str
    scale: float = 1.0
    offset: float = 0.0


FTIS = {
    "accel_x_g": Source("Ahrs1_bLongAcc"),
    "accel_y_g": Source("Ahrs1_bLatAcc"),
    "accel_z_g": Source("Ahrs1_bNormAcc", 1.0, 1.0),
    "pitch_deg": Source("Ahrs1_Pitch"),
    "roll_deg": Source("Ahrs1_Roll"),
    "pitch_rate_deg_s": Source("Ahrs1_bPitchRate"),
    "roll_rate_deg_s": Source("Ahrs1_bRollRate"),
    "yaw_rate_deg_s": Source("Ahrs1_bYawRate"),
    "pressure_altitude_m": Source("Dadc1_alt", FOOT_M),
    "mach": Source("Dadc1_mach"),
    "sat_degC": Source("Dadc1_sat"),
    "tat_degC": Source("Dadc1_tat"),
    "tas_m_s": Source("Dadc1_tas", KNOT_M_S),
    "cas_m_s": Source("Dadc1_cas", KNOT_M_S),
    "climb_rate_m_s": Source("Dadc1_altRate", FOOT_M / 60),
    "aoa_deg": Source("vane_AOA"),
    "n1_pct_left": Source("lh_engine_fan_N1"),
    "n1_pct_right": Source("rh_engine_fan_N1"),
    "n2_pct_left": Source("lh_engine_turbine_N2"),
    "n2_pct_right": Source("rh_engine_turbine_N2"),
    "fuel_flow_kg_s_left": Source("lh_engine_FMF", POUND_PER_HOUR_KG_S),
    "fuel_flow_kg_s_right": Source("rh_engine_FMF", POUND_PER_HOUR_KG_S),
    "itt_degC_left": Source("lh_engine_itt"),
    "itt_degC_right": Source("rh_engine_itt"),
}
OPENAP = {
    "n1_pct_left": Source("n1_l"),
    "n1_pct_right": Source("n1_r"),
    "n2_pct_left": Source("n2_l"),
    "n2_pct_right": Source("n2_r"),
    "fuel_flow_kg_s_left": Source("ff_l"),
    "fuel_flow_kg_s_right": Source("ff_r"),
    "pressure_altitude_m": Source("alt", FOOT_M),
    "mach": Source("mach"),
    "sat_degC": Source("sat"),
    "tas_m_s": Source("tas", KNOT_M_S),
    "climb_rate_m_s": Source("roc", FOOT_M / 60),
    "roll_deg": Source("roll"),
    "mass_kg": Source("mass"),
}
_UNIT_WORDS = {"deg C": "degC", "deg/s": "deg_s", "%": "pct", "lbs": "lb", "lbs/hr": "lb_h", "ft/min": "ft_min"}


def from_ph_lab(raw: dict[str, Floats], units: Mapping[str, str], name: str) -> Loaded | None:
    """Canonical columns where it is one of the two kinds, told by their own."""
    if "time" in raw and any(source.raw in raw for source in FTIS.values()):
        return from_ftis(raw, units, name)
    return from_openap(raw, name) if "ff_l" in raw and "ts" in raw else None


def from_ftis(raw: dict[str, Floats], units: Mapping[str, str], name: str) -> Loaded:
    """Canonical columns, then every other parameter under its own name with its unit behind it."""
    _check_whole(raw, "time", FTIS, (), name)
    columns = {TIME: raw["time"], **_converted(raw, FTIS)}
    if "mach" in columns and "pressure_altitude_m" in columns:
        columns["dynamic_pressure_Pa"] = dynamic_pressure_pa(columns["mach"], columns["pressure_altitude_m"])
    used = {source.raw for source in FTIS.values()} | {"time"}
    for name, values in raw.items():
        if name not in used and len(values) == len(raw["time"]):
            unit = units.get(name, "").strip()
            columns[f"{name}_{_UNIT_WORDS.get(unit, unit)}" if unit not in ("", "-") else name] = values
    return Loaded(columns, {"source": "PH-LAB FTIS"})


def from_openap(raw: dict[str, Floats], name: str) -> Loaded:
    """Canonical columns; body accelerations derived from the flight path."""
    _check_whole(raw, "ts", OPENAP, ("mach", "pressure_altitude_m", "tas_m_s", "climb_rate_m_s", "mass_kg"), name)
    time_s = raw["ts"]
    columns = {TIME: time_s, **_converted(raw, OPENAP)}
    columns["dynamic_pressure_Pa"] = dynamic_pressure_pa(columns["mach"], columns["pressure_altitude_m"])
    accel = raw["acc"] if "acc" in raw else _smooth(np.gradient(columns["tas_m_s"], time_s))
    columns |= _body_accelerations(columns, accel)
    note = "accel_x_g, accel_z_g, pitch_deg: derived from airspeed, climb rate, roll and mass; not measured"
    return Loaded(columns, {"source": "PH-LAB openap"}, (note,))


def _check_whole(
    raw: Mapping[str, Floats], time: str, table: Mapping[str, Source], needed: tuple[str, ...], name: str
) -> None:
    """RecordingError when a column that others are computed from is missing, or one has not as many rows as `time`."""
    missing = [table[channel].raw for channel in needed if table[channel].raw not in raw]
    if missing:
        raise RecordingError(f"{name}: no column {missing[0]!r}, expected one as in every recording of this kind")
    if len(raw[time]) < 2:
        raise RecordingError(f"{name}: {len(raw[time])} rows; expected a flight")
    for column in (*(source.raw for source in table.values() if source.raw in raw), *({"acc"} & raw.keys())):
        if len(raw[column]) != len(raw[time]):
            raise RecordingError(f"{name}: {column} has {len(raw[column])} rows; expected {len(raw[time])} as {time}")


def _converted(raw: Mapping[str, Floats], table: Mapping[str, Source]) -> dict[str, Floats]:
    return {name: raw[s.raw] * s.scale + s.offset for name, s in table.items() if s.raw in raw}


def _body_accelerations(columns: dict[str, Floats], accel_m_s2: Floats) -> dict[str, Floats]:
    from scipy.signal import medfilt  # takes half a second

    time_s, tas = columns[TIME], columns["tas_m_s"]
    flying = tas > MIN_AIRSPEED_M_S
    climb_m_s = medfilt(columns["climb_rate_m_s"], 9)  # some recordings have spikes of 80 m/s
    sine = np.where(flying, climb_m_s / np.maximum(tas, MIN_AIRSPEED_M_S), 0.0)
    gamma = _smooth(np.arcsin(np.clip(sine, -0.5, 0.5)))
    roll = np.radians(columns.get("roll_deg", np.zeros_like(tas)))
    along = accel_m_s2 / STANDARD_GRAVITY_M_S2 + np.sin(gamma)
    turn = tas * np.gradient(gamma, time_s) / STANDARD_GRAVITY_M_S2
    normal = np.where(flying, (np.cos(gamma) + turn) / np.maximum(np.cos(roll), 0.3), 1.0)
    weight_n = np.nan_to_num(columns["mass_kg"], nan=6300.0) * STANDARD_GRAVITY_M_S2
    pressure = np.maximum(columns["dynamic_pressure_Pa"], 500.0)
    lift = normal * weight_n / (pressure * WING_AREA_M2 * LIFT_SLOPE_PER_RAD)
    alpha = np.where(flying, np.clip(ZERO_LIFT_RAD + lift, -0.1, 0.25), 0.0)
    return {
        "accel_x_g": along * np.cos(alpha) + normal * np.sin(alpha),
        "accel_z_g": normal * np.cos(alpha) - along * np.sin(alpha),
        "pitch_deg": np.degrees(gamma + alpha),
    }


def _smooth(values: Floats, width: int = 5) -> Floats:
    """Centred mean over `width` samples: the climb rate at 1 Hz is too coarse to differentiate."""
    padded = np.pad(values, width // 2, mode="edge")
    return np.convolve(padded, np.full(width, 1.0 / width), mode="valid")
