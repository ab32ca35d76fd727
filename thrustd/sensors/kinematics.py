"""The longitudinal acceleration against pitch and airspeed, which no engine comes into.

    dV/dt = g (f_x - b - sin theta)          V: airspeed, b: what the accelerometer shows too much     (body x axis)

A Kalman filter for V and b with Mach's airspeed as its measurement: in steady flight b is known to 0.003 g within some
10 s, beside 0.008 g of mounting. What a turn adds (w q - v r) goes with |n_z - 1|, and is doubt for a while. More than
FOUND sigmas is a fault of the accelerometer; three recorded flights never came to four, in turns and stalls.
Reference: Klein & Morelli, Aircraft System Identification, sec. 3.3 and 10.1 (kinematic consistency).
"""

from math import exp, isfinite, nan, radians, sin, sqrt
from typing import Any

import numpy as np

from thrustd.core.jit import compiled
from thrustd.core.signals import STANDARD_GRAVITY_M_S2

AIRSPEED_STD_M_S, TURBULENCE_M_S2 = 0.3, 0.02
WANDER_G = 1e-3  # of b, per root of a second
MOUNTING_G, START_G = 0.008, 0.02
OF_A_TURN, TURN_NOISE, TURN_FADES_S = 0.1, 0.3, 40.0
FLYING_MACH = 0.2  # slower: Mach is no airspeed yet
FOUND, OVER = 5.0, 2.0  # sigmas
SETTLED_S = 20.0  # the climb-out rotates
SOUND_M_S = 20.0468  # of the root of the temperature
BALANCE = np.dtype([(name, np.float64) for name in ("v", "b", "p_vv", "p_vb", "p_bb", "turn", "since_s", "found")])


def no_balance() -> Any:
    """(1,) of BALANCE, before the first reading."""
    balance = np.zeros(1, BALANCE)
    balance["v"] = nan
    return balance


@compiled
def _begin(m: Any, v: float) -> None:
    m.v, m.b, m.p_vv, m.p_vb, m.p_bb, m.since_s = v, 0.0, 1.0, 0.0, START_G**2, 0.0


@compiled
def _step(m: Any, v: float, f_x_g: float, pitch_deg: float, turn: float, dt_s: float) -> None:
    g = STANDARD_GRAVITY_M_S2
    m.v += dt_s * g * (f_x_g - sin(radians(pitch_deg)) - m.b)
    m.p_vv += dt_s * (-2.0 * g * m.p_vb + dt_s * g * g * m.p_bb + (TURBULENCE_M_S2 + TURN_NOISE * g * turn) ** 2)
    m.p_vb -= dt_s * g * m.p_bb
    m.p_bb += dt_s * WANDER_G**2
    s, nu = m.p_vv + AIRSPEED_STD_M_S**2, v - m.v
    k_v, k_b = m.p_vv / s, m.p_vb / s
    m.v, m.b = m.v + k_v * nu, m.b + k_b * nu
    m.p_bb -= k_b * m.p_vb
    m.p_vb, m.p_vv = (1.0 - k_v) * m.p_vb, (1.0 - k_v) * m.p_vv
    m.since_s += dt_s


def _balance(
    balance: Any, f_x_g: float, f_z_g: float, pitch_deg: float, mach: float, sat_degc: float, dt_s: float
) -> bool:
    """The accelerometer is at fault. NaN readings, and slow flight, say nothing."""
    m = balance[0]
    v = mach * SOUND_M_S * sqrt(max((sat_degc if isfinite(sat_degc) else 0.0) + 273.15, 100.0))
    if not (mach > FLYING_MACH and isfinite(f_x_g + f_z_g + pitch_deg) and dt_s > 0.0):
        m.v = nan
        return bool(m.found)
    turn = abs(f_z_g - 1.0)
    m.turn = max(turn, m.turn * exp(-dt_s / TURN_FADES_S))
    if not isfinite(m.v) or dt_s > 1.0:
        _begin(m, v)
    _step(m, v, f_x_g, pitch_deg, turn, dt_s)
    if m.since_s > SETTLED_S:
        sigmas = abs(m.b) / sqrt(m.p_bb + MOUNTING_G**2 + (OF_A_TURN * m.turn) ** 2)
        m.found = sigmas > (OVER if m.found else FOUND)
    return bool(m.found)


balance_of: Any = compiled(_balance)
