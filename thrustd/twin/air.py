"""The air the twin flies in: ISA pressure, any temperature. Each function takes a number or an array, in numba too."""

from typing import TypeVar

import numpy as np

from thrustd.twin.fast import FloatArray, jit

SEA_LEVEL_PA = 101325.0
SEA_LEVEL_K = 288.15
KELVIN = 273.15
TROPOPAUSE_M = 11000.0

Real = TypeVar("Real", float, FloatArray)


@jit
def delta_ambient(altitude_m: Real) -> Real:
    """ISA pressure at a pressure altitude below 20 km, over that at sea level."""
    low = (1.0 - 2.25577e-5 * np.minimum(altitude_m, TROPOPAUSE_M)) ** 5.25588
    return low * np.exp(-np.maximum(altitude_m - TROPOPAUSE_M, 0.0) / 6341.62)


@jit
def delta_total(altitude_m: Real, mach: Real) -> Real:
    """Total pressure over 101 325 Pa."""
    return delta_ambient(altitude_m) * (1.0 + 0.2 * mach * mach) ** 3.5


@jit
def theta_total(static_k: Real, mach: Real) -> Real:
    """Total temperature over 288.15 K."""
    return static_k * (1.0 + 0.2 * mach * mach) / SEA_LEVEL_K


@jit
def dynamic_pressure_pa(altitude_m: Real, mach: Real) -> Real:
    return 0.7 * SEA_LEVEL_PA * delta_ambient(altitude_m) * mach * mach
