"""One engine's brochure thrust over time: fuel flow says the level, N1 carries it while the throttle moves.

Fuel flow leads the thrust by whatever accelerates the spools (40 % in a slam), N1 follows the thrust but its line is
some per cent off on any one engine. So the difference between both is learnt while the engine is steady and kept while
it is not:

    k = (F_fuel - F_N1) / s,   s = max(F_N1, 1000 N)
    random walk with N1 and with time:    P += |dN1| WANDER_1_PCT^2 + dt WANDER_1_S^2
    y = k + v,                 v^2 = STEADY_STD^2 + (LEAD_S_PCT dN1/dt)^2    scalar Kalman filter, robust (Huber)
    F = F_N1 + k s,            sigma_k = s sqrt(P)

N1's line has another shape on any one engine, and at rest another than in flight: away from the thrust s0 where fuel
flow confirmed it, LINE^2 |ln s/s0| is added to the variance. When N1 is missing the fuel flow stands alone and leads by
FUEL_LEAD_S, when fuel flow is missing k stays as it was.
"""

from collections.abc import Sequence
from math import exp, hypot, isfinite, log, nan, sqrt
from typing import Any

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.jit import compiled

SCALE_FLOOR_N = 1000.0
BOUND = 3.0  # of START_STD: further off one of both lies
START_STD = 0.08  # N1's line against the fuel flow of one engine, before anything is known
WANDER_1_PCT = 0.01  # growth of sigma_k per root of per cent N1: 4.5 % over 20 % of N1
TRAVELLED_PCT = 0.3  # less is the noise of a fan that rests
WANDER_1_S = 1e-3  # and per root of a second, with Mach and altitude: 1 % in 100 s
STEADY_STD = 0.006  # noise of fuel flow and N1 at one reading
LEAD_S_PCT = 0.2  # relative fuel flow that accelerates the spools by 1 %/s
LINE_STD = 0.035  # per root of ln s: 4 % from 2 to 8 kN in flight. From idle at rest 10 to 20 %: not all of it
CONFIRM_S = 2.0  # steady for so long: fuel flow says what N1 stands for here
FUEL_LEAD_S = 1.0  # a slam's fuel flow leads the thrust by about this much
SURPRISE_SIGMAS = 3.0
LAG_S = 0.25  # thrust leads or lags N1 by about this much
FUEL_LAG_S = hypot(LAG_S, FUEL_LEAD_S)  # without N1
# Always to the same side: ten readings a second of an error that lasts tau = 2 s say as little as white ones of
# sqrt(2 tau / 0.1 s) times its size.
AS_WHITE = 6.3
STILL_N_S = 40.0  # the rate of a brochure thrust that rests: its readings' noise
SETTLE_S = 3.0  # fuel flow and spools find together after a movement: the doubt fades as slowly
RATE_TAU_S = 0.5
MAX_STEP_S = 1.0
MAX_REMEMBERED = 1000.0  # no per cent of N1 and no ln s is as large


# the memory of one engine, a row of numbers: k, P, N1 when its travel was last counted, ln s0; then of the movement
K, P, LAST_N1_PCT, LN_S0, LAGGED_N, RATE_N_S = range(6)
LEARNT = slice(K, LAGGED_N)


class HandOver:
    """Mutable: the learnt difference between both sources of one engine."""

    __slots__ = ("row",)

    def __init__(self) -> None:
        self.row = np.array((0.0, START_STD**2, nan, nan, nan, 0.0))

    def snapshot(self) -> list[float | None]:
        """What was learnt: k, P, N1 then, ln s0; unknown is None."""
        return [value if isfinite(value) else None for value in self.row[LEARNT].tolist()]

    def restore(self, state: Sequence[float | None]) -> bool:
        """Take over a snapshot; False, and nothing changed, when it is none."""
        values = [nan if value is None else value for value in state]
        sane = len(values) == 4 and abs(values[K]) < 1.0 and 0.0 <= values[P] <= START_STD**2
        if sane and not any(abs(value) > MAX_REMEMBERED for value in values):
            self.row[LEARNT] = values
            return True
        return False


def _movement(row: Floats, thrust_n: float, dt_s: float, lag_s: float) -> float:
    """How far it may lead or lag while the throttle moves, and until the engine has settled: one sigma."""
    if not isfinite(thrust_n):
        row[LAGGED_N] = nan
        return nan
    if not isfinite(row[LAGGED_N]):
        row[LAGGED_N] = thrust_n
    row[LAGGED_N] += min(dt_s / RATE_TAU_S, 1.0) * (thrust_n - row[LAGGED_N])
    rate_n_s = abs(thrust_n - row[LAGGED_N]) / RATE_TAU_S
    row[RATE_N_S] = max(rate_n_s, row[RATE_N_S] * exp(-dt_s / SETTLE_S))
    return AS_WHITE * lag_s * max(row[RATE_N_S] - STILL_N_S, 0.0)


movement_n: Any = compiled(_movement, "f8(f8[::1], f8, f8, f8)", "numpy")


@compiled
def _learn(row: Floats, ratio: float, n1_rate_pct_s: float, dt_s: float) -> None:
    noise = (STEADY_STD**2 + (LEAD_S_PCT * n1_rate_pct_s) ** 2) * 0.1 / dt_s  # readings come ten times a second
    innovation = ratio - row[K]
    noise = max(noise, (innovation / SURPRISE_SIGMAS) ** 2 * 0.1 / dt_s - row[P])
    gain = row[P] / (row[P] + noise)
    row[K] = min(max(row[K] + gain * innovation, -BOUND * START_STD), BOUND * START_STD)
    row[P] *= 1.0 - gain


@compiled
def _line_variance(row: Floats, ln_s: float, rate_pct_s: float, dt_s: float) -> float:
    """Relative variance of N1's line since fuel flow confirmed it."""
    if not isfinite(row[LN_S0]):
        row[LN_S0] = ln_s
    steady = STEADY_STD**2 / (STEADY_STD**2 + (LEAD_S_PCT * rate_pct_s) ** 2)
    row[LN_S0] += steady * min(dt_s / CONFIRM_S, 1.0) * (ln_s - row[LN_S0])
    return LINE_STD**2 * abs(ln_s - row[LN_S0])


@compiled
def _carry(
    row: Floats, dt_s: float, fuel_n: float, n1_n: float, n1_pct: float, n1_rate_pct_s: float
) -> tuple[float, float, float]:
    """-> thrust, one sigma of the hand-over, one sigma of the movement, N."""
    if not isfinite(n1_n):
        row[LAST_N1_PCT] = nan
        return fuel_n, START_STD * max(abs(fuel_n), SCALE_FLOOR_N), movement_n(row, fuel_n, dt_s, FUEL_LAG_S)
    scale_n = max(n1_n, SCALE_FLOOR_N)
    travelled_pct = abs(n1_pct - row[LAST_N1_PCT])
    row[P] += dt_s * WANDER_1_S**2
    if travelled_pct > TRAVELLED_PCT:
        row[P] += travelled_pct * WANDER_1_PCT**2
    if not travelled_pct <= TRAVELLED_PCT:  # or it was not known
        row[LAST_N1_PCT] = n1_pct
    row[P] = min(row[P], START_STD**2)
    rate_pct_s = n1_rate_pct_s if isfinite(n1_rate_pct_s) else 0.0
    if isfinite(fuel_n) and dt_s > 0.0:
        _learn(row, (fuel_n - n1_n) / scale_n, rate_pct_s, dt_s)
    line = _line_variance(row, log(scale_n), rate_pct_s, dt_s if isfinite(fuel_n) else 0.0)
    thrust_n = n1_n + row[K] * scale_n
    return thrust_n, scale_n * sqrt(row[P] + line), movement_n(row, thrust_n, dt_s, LAG_S)


def _hand_over(
    row: Floats, dt_s: float, deck_std_n: float, fuel_n: float, n1_n: float, n1_pct: float, n1_rate_pct_s: float
) -> tuple[float, float, float]:
    """-> thrust, its slow one sigma (engine, deck, hand-over), one sigma that lasts as long as the throttle moves; N.

    `dt_s` after the last one; inputs that are trusted, else NaN. NaN = no estimate.
    """
    thrust_n, std_n, lag_n = _carry(row, min(max(dt_s, 0.0), MAX_STEP_S), fuel_n, n1_n, n1_pct, n1_rate_pct_s)
    if not isfinite(thrust_n):
        return nan, nan, nan
    return thrust_n, hypot(deck_std_n, std_n), lag_n


hand_over: Any = compiled(_hand_over, "UniTuple(f8, 3)(f8[::1], f8, f8, f8, f8, f8, f8)", "numpy")
