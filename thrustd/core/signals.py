"""The catalogue: every channel's name, unit, sign, plausible range and resting value (ICD section 3).

One set of names in every file, on every screen and inside the pipeline. `rest` is what a quiet bench at 1 g and
room temperature would show; corrections use it when a channel was never seen.
"""

from dataclasses import dataclass
from math import isfinite, nan
from typing import Literal

STANDARD_GRAVITY_M_S2 = 9.80665  # ISO 80000-3
RUNS_PCT = 5.0  # N1 of an engine that runs


@dataclass(frozen=True, slots=True)
class Signal:
    name: str
    unit: str
    meaning: str  # with its sign convention
    low: float  # readings outside [low, high] are faults
    high: float
    rest: float
    scope: Literal["aircraft", "engine", "mount"]
    stale_after_s: float  # older than this it no longer counts as measured
    spread: float = 0.0  # one sigma around `rest` in ordinary flight, for the band while it is not measured
    memory_s: float = 10.0  # how long a value says something of the next one (correlation time in ordinary flight)

    @property
    def rests(self) -> bool:
        """Whether anything is known of it before it is heard."""
        return isfinite(self.rest)


FUEL_FLOW_ZERO_KG_S = -0.005  # lowest: the zero of a flow meter drifts and its noise goes both ways

_TABLE = (
    Signal("deformation_mm", "mm", "mount deformation, loaded by forward thrust +", -5, 5, 0, "mount", 0.05),
    Signal("temperature_degC", "degC", "mount temperature", -60, 200, 20, "mount", 3, 15, 600),
    Signal("vibration_mm_s", "mm/s", "radial vibration velocity at the mount", -5, 500, 0, "mount", 10, 10),
    Signal("n1_pct", "%", "fan speed, 100 % = 15 904 1/min", -1, 115, nan, "engine", 0.5),
    Signal("n2_pct", "%", "core speed, 100 % = 32 760 1/min", -1, 110, nan, "engine", 0.5),
    Signal("fuel_flow_kg_s", "kg/s", "fuel mass flow of one engine", FUEL_FLOW_ZERO_KG_S, 0.4, nan, "engine", 0.5),
    Signal("accel_x_g", "g", "specific force, forward +", -5, 5, 0, "aircraft", 0.5, 0.15, 5),
    Signal("accel_y_g", "g", "specific force, right +", -5, 5, 0, "aircraft", 0.5, 0.05, 2),
    Signal("accel_z_g", "g", "specific force, up +: 1 in level flight", -5, 8, 1, "aircraft", 0.5, 0.2, 2),
    Signal("pitch_deg", "deg", "body pitch angle, nose up +", -95, 95, 0, "aircraft", 1),
    Signal("pitch_rate_deg_s", "deg/s", "body pitch rate, nose up +", -400, 400, 0, "aircraft", 1, 3, 1),
    Signal("roll_rate_deg_s", "deg/s", "body roll rate, right wing down +", -400, 400, 0, "aircraft", 1, 5, 1),
    Signal("yaw_rate_deg_s", "deg/s", "body yaw rate, nose right +", -400, 400, 0, "aircraft", 1, 2, 1),
    Signal("mark", "-", "number of the test point, until 0 is said", 0, 1e6, 0, "aircraft", 1e6),
    Signal("mach", "-", "Mach number", -0.02, 1.0, nan, "aircraft", 1),
    Signal("pressure_altitude_m", "m", "standard (pressure) altitude", -500, 16000, nan, "aircraft", 1),
    Signal("sat_degC", "degC", "static air temperature", -90, 70, nan, "aircraft", 3),
    Signal("tat_degC", "degC", "total air temperature", -90, 100, nan, "aircraft", 3),
    Signal("dynamic_pressure_Pa", "Pa", "dynamic pressure", -100, 60000, 0, "aircraft", 1, 4000, 60),
    Signal("thrust_N", "N", "net thrust of one engine, forward +", -3000, 16000, nan, "engine", 1),
    Signal("thrust_std_N", "N", "one sigma of the net thrust", 0, 1e9, nan, "engine", 1),
    Signal("thrust_status", "-", "bits of the estimate, ICD ids 1854 and 1855", 0, 2**32 - 1, nan, "engine", 1),
    Signal("force_N", "N", "reference force on one mount, forward thrust +", -20000, 20000, nan, "mount", 1),
    Signal("time_s", "s", "seconds, strictly increasing", -1e12, 1e12, 0, "aircraft", 1),
)

CATALOGUE: dict[str, Signal] = {signal.name: signal for signal in _TABLE}
