"""One engine's brochure thrust over time: fuel flow says the level, N1 carries it while the throttle moves.

Fuel flow leads the thrust by whatever accelerates the spools (40 % in a slam), N1 follows the thrust but its line is
some per cent off on any one engine. So the difference between both is learnt while the engine is steady and kept while
it is not:

    k = (F_fuel - F_N1) / s,   s = max(F_N1, 1000 N)                    random walk with N1: P += |dN1| WANDER_1_PCT^2
    y = k + v,                 v^2 = STEADY_STD^2 + (LEAD_S_PCT dN1/dt)^2    scalar Kalman filter, robust (Huber)
    F = F_N1 + k s,            sigma_k = s sqrt(P)

When N1 is missing the fuel flow stands alone, when fuel flow is missing k stays as it was.
"""

from math import isfinite, nan, sqrt
from typing import NamedTuple

from thrustd.brochure.deck import DeckEstimate

SCALE_FLOOR_N = 1000.0
START_STD = 0.08  # N1's line against the fuel flow of one engine, before anything is known
WANDER_1_PCT = 0.014  # growth of sigma_k per root of per cent N1: 4 % over 20 % of N1
STEADY_STD = 0.006  # noise of fuel flow and N1 at one reading
LEAD_S_PCT = 0.2  # relative fuel flow that accelerates the spools by 1 %/s
SURPRISE_SIGMAS = 3.0
LAG_S = 0.25  # thrust leads or lags N1 by about this much
RATE_TAU_S = 0.5
MAX_STEP_S = 1.0


class BrochureThrust(NamedTuple):
    """The brochure route at one instant, N; NaN = no estimate."""

    thrust_n: float
    std_n: float  # one sigma, slow: engine, deck and hand-over
    lag_n: float  # one sigma that lasts as long as the throttle moves


SILENT = BrochureThrust(nan, nan, nan)


class HandOver:
    """Mutable: the learnt difference between both routes of one engine."""

    __slots__ = ("_k", "_lagged_n", "_n1_pct", "_p", "_t_ns")

    def __init__(self) -> None:
        self._k, self._p = 0.0, START_STD**2
        self._n1_pct = self._lagged_n = nan
        self._t_ns = -1

    def step(self, t_ns: int, deck: DeckEstimate, n1_pct: float, n1_rate_pct_s: float) -> BrochureThrust:
        """`deck` from the inputs that are believed; N1 and its rate NaN when it is not one of them."""
        dt_s = 0.0 if self._t_ns < 0 else min(max((t_ns - self._t_ns) * 1e-9, 0.0), MAX_STEP_S)
        self._t_ns = t_ns
        fuel_n, n1_n = deck.fuel_flow_thrust_n, deck.n1_thrust_n
        if not isfinite(n1_n):
            self._n1_pct = nan
            return self._thrust(deck, fuel_n, START_STD * max(abs(fuel_n), SCALE_FLOOR_N), dt_s)
        scale_n = max(n1_n, SCALE_FLOOR_N)
        if isfinite(self._n1_pct):
            self._p = min(self._p + abs(n1_pct - self._n1_pct) * WANDER_1_PCT**2, START_STD**2)
        self._n1_pct = n1_pct
        if isfinite(fuel_n) and dt_s > 0.0:
            self._learn((fuel_n - n1_n) / scale_n, n1_rate_pct_s if isfinite(n1_rate_pct_s) else 0.0, dt_s)
        return self._thrust(deck, n1_n + self._k * scale_n, scale_n * sqrt(self._p), dt_s)

    def _learn(self, ratio: float, n1_rate_pct_s: float, dt_s: float) -> None:
        noise = (STEADY_STD**2 + (LEAD_S_PCT * n1_rate_pct_s) ** 2) * 0.1 / dt_s  # readings come ten times a second
        innovation = ratio - self._k
        noise = max(noise, (innovation / SURPRISE_SIGMAS) ** 2 * 0.1 / dt_s - self._p)
        gain = self._p / (self._p + noise)
        self._k += gain * innovation
        self._p *= 1.0 - gain

    def _thrust(self, deck: DeckEstimate, thrust_n: float, hand_over_n: float, dt_s: float) -> BrochureThrust:
        if not isfinite(thrust_n):
            self._lagged_n = nan
            return SILENT
        if not isfinite(self._lagged_n):
            self._lagged_n = thrust_n
        self._lagged_n += min(dt_s / RATE_TAU_S, 1.0) * (thrust_n - self._lagged_n)
        lag_n = LAG_S / RATE_TAU_S * abs(thrust_n - self._lagged_n)
        return BrochureThrust(thrust_n, sqrt(deck.std_n**2 + hand_over_n**2), lag_n)
