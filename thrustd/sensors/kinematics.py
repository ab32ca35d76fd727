"""The longitudinal acceleration against pitch and airspeed, which no engine comes into.

    dV/dt = g (f_x - b - sin theta)          V: airspeed, b: what the accelerometer shows too much     (body x axis)

A Kalman filter for V and b with Mach's airspeed as its measurement: in steady flight b is known to 0.003 g within some
10 s, beside 0.008 g of mounting. Slower than FLYING_MACH it is no airspeed yet: an aircraft that taxis or stands goes
at 0 +- 10 m/s, for some 10 s at a time. What a turn adds (w q - v r) goes with |n_z - 1|, and is doubt for a while.
More than FOUND sigmas of b, or of a speed that is no taxiing, is a fault of the accelerometer or of the Mach number;
what is beyond one is in the band before that. The engines tell which: an accelerometer that shows too much makes every
mount's force too large, an airspeed that is as much too low makes every brochure thrust too large.

    s = +1: too much, -1: too little      ln odds = sum over engines of ln Phi(s d / std) - ln Phi(-s d / std)
                                          d: mounts' thrust minus the brochure's
Reference: Klein & Morelli, Aircraft System Identification, sec. 3.3 and 10.1 (kinematic consistency).
"""

from collections.abc import Callable, Sequence
from math import erfc, exp, isfinite, log, nan, radians, sin, sqrt
from typing import Any, NamedTuple

import numpy as np

from thrustd.core.columns import Floats, Integers
from thrustd.core.jit import compiled
from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.sensors.monitor_inputs import Sensor

ACCELERATION: Sensor = ("accel_x_g", 0)
MACH: Sensor = ("mach", 0)
TAKEN: tuple[Sensor, ...] = (ACCELERATION, ("accel_z_g", 0), ("pitch_deg", 0), MACH, ("sat_degC", 0))
MACH_TAKEN = TAKEN.index(MACH)
# see `air_leaves`; it does not read the last one
LEAVES: tuple[Sensor, ...] = (MACH, ("pressure_altitude_m", 0), ACCELERATION, ("pitch_deg", 0), ("accel_z_g", 0))

AIRSPEED_STD_M_S, TURBULENCE_M_S2 = 0.3, 0.02
WANDER_G = 1e-3  # of b, per root of a second
MOUNTING_G, START_G, START_M_S = 0.008, 0.02, 10.0
OF_A_TURN, TURN_NOISE, TURN_FADES_S = 0.1, 0.3, 40.0
FLYING_MACH, TAXI_M_S, TAXI_S = 0.2, 10.0, 10.0
FOUND, OVER, TOO_FAST = 5.0, 2.0, 3.0  # sigmas; a speed that readings have pulled back from is no further off
REFUTED = log(0.02)  # odds; else it is the accelerometer
LEAST_PHI = 1e-12
SETTLED_S, LASTS_S = 20.0, 4.0  # by then a Mach number or a pitch that drifts is known by its own watch
SOUND_M_S, ABOUT_SOUND_M_S = 20.0468, 320.0  # of the root of the temperature; anywhere below 10 km
INSTANTS, INSTANT_S = 60, 0.4  # as often as an engine is weighed; of what is older b shows as much as of the oldest
KEPT = "v", "b", "p_vv", "p_vb", "p_bb", "turn", "since_s", "found", "excess_g", "odd_s", "more", "blamed"
BALANCE = np.dtype(
    [(name, np.float64) for name in KEPT]
    # of biases of 1 g that began at some instants, the oldest first: how long ago, done to V, not in b yet
    + [("n", np.int64), *((name, np.float64, INSTANTS) for name in ("age_s", "ahead_m_s", "unseen"))]
    + [("variance_g2", np.float64)]  # of b; 0: it says nothing
)


class Bias(NamedTuple):
    """What the aircraft's motion says of the accelerometer."""

    balance: Any  # BALANCE (1,)
    weight_n: float  # of an engine


def no_balance() -> Any:
    """(1,) of BALANCE, before the first reading."""
    balance = np.zeros(1, BALANCE)
    balance["v"] = nan
    return balance


@compiled
def _begin(m: Any, v: float) -> None:
    m.v, m.b, m.p_vv, m.p_vb, m.p_bb, m.since_s = v, 0.0, START_M_S**2, 0.0, START_G**2, 0.0
    m.n, m.variance_g2 = 0, 0.0


@compiled
def _see(m: Any, k_v: float, k_b: float, dt_s: float) -> None:
    """What b shows of a bias that began at an instant: the filter's own answer to it."""
    if m.n == 0 or m.age_s[m.n - 1] >= INSTANT_S:
        if m.n == INSTANTS:
            m.n -= 1
            for i in range(1, m.n):  # the oldest stays
                m.age_s[i], m.ahead_m_s[i], m.unseen[i] = m.age_s[i + 1], m.ahead_m_s[i + 1], m.unseen[i + 1]
        m.age_s[m.n], m.ahead_m_s[m.n], m.unseen[m.n] = 0.0, 0.0, 1.0
        m.n += 1
    for i in range(m.n):
        m.age_s[i] += dt_s
        m.ahead_m_s[i] += dt_s * STANDARD_GRAVITY_M_S2 * m.unseen[i]
        m.unseen[i] += k_b * m.ahead_m_s[i]
        m.ahead_m_s[i] *= 1.0 - k_v


@compiled
def shown(m: Any, since_s: float) -> float:
    """Part of a bias that began so long ago which b shows by now."""
    for i in range(m.n):
        if m.age_s[i] <= since_s:
            return float(1.0 - m.unseen[i])
    return 0.0


@compiled
def _step(m: Any, v: float, f_x_g: float, pitch_deg: float, turn: float, variance: float, dt_s: float) -> None:
    """`variance`: of the airspeed v, m2/s2."""
    g = STANDARD_GRAVITY_M_S2
    m.v += dt_s * g * (f_x_g - sin(radians(pitch_deg)) - m.b)
    m.p_vv += dt_s * (-2.0 * g * m.p_vb + dt_s * g * g * m.p_bb + (TURBULENCE_M_S2 + TURN_NOISE * g * turn) ** 2)
    m.p_vb -= dt_s * g * m.p_bb
    m.p_bb += dt_s * WANDER_G**2
    s, nu = m.p_vv + variance, v - m.v
    k_v, k_b = m.p_vv / s, m.p_vb / s
    m.v, m.b = m.v + k_v * nu, m.b + k_b * nu
    m.p_bb -= k_b * m.p_vb
    m.p_vb, m.p_vv = (1.0 - k_v) * m.p_vb, (1.0 - k_v) * m.p_vv
    m.since_s += dt_s
    _see(m, k_v, k_b, dt_s)


def _balance(
    balance: Any, f_x_g: float, f_z_g: float, pitch_deg: float, mach: float, sat_degc: float, dt_s: float
) -> bool:
    """They contradict each other. NaN readings say nothing."""
    m = balance[0]
    v = mach * SOUND_M_S * sqrt(max((sat_degc if isfinite(sat_degc) else 0.0) + 273.15, 100.0))
    if not (isfinite(mach + f_x_g + f_z_g + pitch_deg) and dt_s > 0.0):
        m.v, m.variance_g2 = nan, 0.0
        return bool(m.found)
    turn = abs(f_z_g - 1.0)
    m.turn = max(turn, m.turn * exp(-dt_s / TURN_FADES_S))
    if not isfinite(m.v) or dt_s > 1.0:
        _begin(m, v)
    variance = AIRSPEED_STD_M_S**2 if mach > FLYING_MACH else TAXI_M_S**2 * (1.0 + 2.0 * TAXI_S / dt_s)
    _step(m, v, f_x_g, pitch_deg, turn, variance, dt_s)
    if m.since_s > SETTLED_S:
        variance_g2 = m.p_bb + MOUNTING_G**2 + (OF_A_TURN * m.turn) ** 2
        sigmas, taxiing_m_s = OVER if m.found else FOUND, m.v - v if mach <= FLYING_MACH else 0.0
        odd = abs(m.b) > sigmas * sqrt(variance_g2) or abs(taxiing_m_s) > TOO_FAST * TAXI_M_S
        m.more = 1.0 if (m.b if taxiing_m_s == 0.0 else taxiing_m_s) > 0.0 else -1.0
        m.odd_s = m.odd_s + dt_s if odd else 0.0
        m.found = odd and (m.found or m.odd_s > LASTS_S)
        m.excess_g = sqrt(max(m.b**2 - variance_g2, 0.0))  # of b beyond what is known of it
        m.variance_g2 = max(m.b**2, variance_g2)  # it may be the Mach number's or the pitch's
    return bool(m.found)


balance_of: Any = compiled(_balance)


@compiled
def air_leaves(air: Floats, readings: Floats, places: Integers, t_s: float) -> None:
    """Adds to `air` (so far; last time, Mach number, acceleration) by how much a Mach number may have become wrong.

    By what it moved, or by what it did not show of an acceleration: of one that nobody measures, 1 g. `places`: LEAVES.
    """
    mach, f_x_g, pitch_deg = readings[places[0]], readings[places[2]], readings[places[3]]
    dt_s, moved, along_g = t_s - air[1], abs(mach - air[2]), abs(f_x_g - sin(radians(pitch_deg)))
    if dt_s > 0.0:  # NaN is not
        air[0] += dt_s * STANDARD_GRAVITY_M_S2 * (along_g if isfinite(along_g) else 1.0) / ABOUT_SOUND_M_S
        air[0] += moved if isfinite(moved) else 0.0
    air[1], air[2], air[3] = t_s, mach, f_x_g if isfinite(f_x_g) else air[3]


def _accelerometer_odds(more: float, apart_n: Floats) -> float:
    """ln of the odds that it is the accelerometer and not the Mach number; `apart_n` (n, 2): d and its sigma."""
    signs = [more * d_n / std_n for d_n, std_n in apart_n.tolist() if isfinite(d_n) and std_n > 0.0]
    return sum(log(max(erfc(-x / sqrt(2.0)), LEAST_PHI)) - log(max(erfc(x / sqrt(2.0)), LEAST_PHI)) for x in signs)


class Accelerometer:
    """Are it and the Mach number trusted? Mutable; `snapshot` / `restore` for the checkpoint."""

    def __init__(self, place: Callable[[Sensor], int], engine_mass_kg: float) -> None:
        """`place`: of a sensor among the readings."""
        self._taken = [(sensor, place(sensor)) for sensor in TAKEN]
        self._balance, self._weight_n = no_balance(), engine_mass_kg * STANDARD_GRAVITY_M_S2
        self._blamed, self._excess_g = self._balance["blamed"], self._balance["excess_g"]  # (1,), views

    @property
    def bias(self) -> Bias:
        """What the bank is told of it; goes on."""
        return Bias(self._balance, self._weight_n)

    @property
    def blamed(self) -> Sensor | None:
        """Which of both is at fault."""
        return (None, ACCELERATION, MACH)[int(self._blamed.item())]

    def look(
        self, readings: Floats, trusts: Callable[[Sensor], bool] | None, dt_s: float, apart_n: Callable[[], Floats]
    ) -> None:
        """`trusts`: what the sensors' own watches say; None: all is well.

        `apart_n` is asked when they contradict each other: by engine mounts' thrust minus the brochure's, its sigma.
        """
        taken = [
            readings.item(at) if sensor == ACCELERATION or trusts is None or trusts(sensor) else nan
            for sensor, at in self._taken
        ]
        contradict, blamed = balance_of(self._balance, *taken, dt_s), self.blamed
        if contradict and blamed is None:
            is_mach = _accelerometer_odds(float(self._balance["more"].item()), apart_n()) < REFUTED
            self._balance["blamed"] = 2.0 if is_mach else 1.0
        elif not contradict and (blamed == ACCELERATION or taken[MACH_TAKEN] > FLYING_MACH):
            self._balance["blamed"] = 0.0  # an airspeed that says nothing has not agreed

    @property
    def error_n(self) -> float:
        """What it may do to an engine's thrust before it is found."""
        return 0.0 if self.blamed else float(self._weight_n * self._excess_g.item())

    def snapshot(self) -> list[float]:
        return [0.0 if value != value else value for value in self._balance[list(KEPT)][0].tolist()]

    def restore(self, numbers: Sequence[float]) -> None:
        """ValueError or TypeError when these are no numbers of this kind."""
        for name, value in zip(KEPT, numbers, strict=True):
            self._balance[name] = float(value)
        self._balance["v"], self._balance["variance_g2"] = nan, 0.0
        if self._balance["blamed"].item() not in (0.0, 1.0, 2.0):
            raise ValueError("not who is blamed")
