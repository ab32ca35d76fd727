"""The standard atmosphere (ISO 2533), and what moving through it does to pressure and temperature.

    T = max(288.15 K - 0.0065 K/m h, 216.65 K),   p = 101325 Pa (T / 288.15 K)^5.25588, above 11 km times
    exp(-(h - 11 km) / 6341.62 m),   T_t / T = 1 + 0.2 M^2,   p_t / p = (T_t / T)^3.5,   q = 0.7 p M^2

h: pressure altitude [m], below 20 km; M: Mach number. Every function takes numbers or arrays, in numba too.
"""

from typing import Any

import numpy as np

from thrustd.core.jit import compiled

SEA_LEVEL_PA = 101325.0
SEA_LEVEL_K = 288.15
ZERO_CELSIUS_K = 273.15
AIR_J_KG_K = 287.05287
HEAT_RATIO = 1.4


@compiled
def isa_k(altitude_m: Any) -> Any:
    """Static temperature of the standard day."""
    return np.maximum(SEA_LEVEL_K - 0.0065 * altitude_m, 216.65)


@compiled
def static_pressure_pa(altitude_m: Any) -> Any:
    low_pa = SEA_LEVEL_PA * (isa_k(altitude_m) / SEA_LEVEL_K) ** 5.25588
    return low_pa * np.exp(-np.maximum(altitude_m - 11000.0, 0.0) / 6341.62)


@compiled
def stagnation(mach: Any) -> Any:
    """Total over static temperature."""
    return 1.0 + 0.2 * mach * mach


@compiled
def total_pressure_ratio(mach: Any, altitude_m: Any) -> Any:
    """delta_t: total pressure over 101325 Pa."""
    return static_pressure_pa(altitude_m) / SEA_LEVEL_PA * stagnation(mach) ** 3.5


@compiled
def total_temperature_ratio(mach: Any, static_k: Any) -> Any:
    """theta_t: total temperature over 288.15 K."""
    return static_k * stagnation(mach) / SEA_LEVEL_K


@compiled
def dynamic_pressure_pa(mach: Any, altitude_m: Any) -> Any:
    return 0.5 * HEAT_RATIO * static_pressure_pa(altitude_m) * mach * mach


@compiled
def sound_m_s(static_k: Any) -> Any:
    """Speed of sound."""
    return np.sqrt(HEAT_RATIO * AIR_J_KG_K * static_k)
