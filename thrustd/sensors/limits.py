"""What a healthy sensor never does: limits per signal, with a margin of about 2 over healthy flights.

Taken from three PH-LAB flights at 10 Hz (largest single step, largest median second difference in 2 s, longest run of
one value) and rounded up; see docs/fusion.md. Values are in the catalogue's units.
"""

from math import inf
from typing import NamedTuple


class SensorLimits(NamedTuple):
    """Per 0.1 s step of the monitor."""

    jump: float  # a step larger than this which stays is an offset
    noise: float  # median |second difference| over 2 s above this is noise; inf: read too seldom, its jumps are counted
    stuck_s: float  # the same value, bit for bit, for longer than this (less for a sensor that is never at rest)
    rate: float = inf  # per second, held for DRIFT_S: the aircraft cannot do it
    low: float = -inf  # outside: not this aircraft
    high: float = inf
    alone_jump: float = inf  # a step larger than this which the engine's other signals do not follow
    moves: float = inf  # changed by more than this within a second: the throttle was moved


LIMITS = {
    "deformation_mm": SensorLimits(0.15, 0.02, 2.0),
    "n1_pct": SensorLimits(6.0, 1.0, 6.0, alone_jump=1.5, moves=0.5),
    "n2_pct": SensorLimits(5.0, 0.8, 6.0, alone_jump=1.0, moves=0.4),
    "fuel_flow_kg_s": SensorLimits(0.05, 0.004, 6.0, alone_jump=0.0035, moves=0.003),
    "mach": SensorLimits(0.02, 0.004, 10.0, rate=0.035),
    "pressure_altitude_m": SensorLimits(60.0, 8.0, 28.0, rate=120.0),
    "sat_degC": SensorLimits(2.0, 1.0, inf, rate=1.6),  # coarse sensors hold a value for minutes: see SAT_CLIMB_M
    "tat_degC": SensorLimits(2.0, 1.0, inf, rate=2.0),
    "temperature_degC": SensorLimits(3.0, inf, inf, rate=1.0),  # 45 K in 900 s, noise of 0.2 K, once a second
    "accel_x_g": SensorLimits(0.18, 0.04, 3.0, low=-0.6, high=0.9),
    "accel_y_g": SensorLimits(0.12, 0.05, 3.0, low=-0.6, high=0.6),
    "accel_z_g": SensorLimits(0.4, 0.15, 3.0, low=-0.6, high=3.0),
}
ALONE_STUCK_S = 1.0  # the engine's other two signals moved, and this one did not by one bit
SAT_CLIMB_M = 400.0  # SAT that has not moved while the aircraft climbed or sank this far is stuck
FLYING_MACH = 0.12  # on the ground Mach and accelerations may rest at one value
TURNING_N1_PCT = 20.0  # below: the engine is off or starting, its sensors may rest
