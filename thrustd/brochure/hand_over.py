"""One engine's brochure thrust over time: fuel flow says the level, N1 carries it while the throttle moves.

Fuel flow leads the thrust by whatever accelerates the spools (40 % in a slam), N1 follows the thrust but its line is
some per cent off on any one engine. So the difference between both is learnt while the engine is steady and kept while
it is not:

    k = (F_fuel - F_N1) / s,   s = max(F_N1, 1000 N)                    random walk with N1: P += |dN1| WANDER_1_PCT^2
    y = k + v,                 v^2 = STEADY_STD^2 + (LEAD_S_PCT dN1/dt)^2    scalar Kalman filter, robust (Huber)
    F = F_N1 + k s,            sigma_k = s sqrt(P)

N1's line has another shape on any one engine, and at rest another than in flight: away from the thrust s0 where fuel
flow confirmed it, LINE^2 |ln s/s0| is added to the variance. When N1 is missing the fuel flow stands alone and leads by
FUEL_LEAD_S, when fuel flow is missing k stays as it was.
"""

from collections.abc import Sequence
from math import exp, hypot, isfinite, log, nan, sqrt
from typing import NamedTuple

from thrustd.brochure.deck import DeckEstimate

SCALE_FLOOR_N = 1000.0
START_STD = 0.08  # N1's line against the fuel flow of one engine, before anything is known
WANDER_1_PCT = 0.01  # growth of sigma_k per root of per cent N1: 4.5 % over 20 % of N1
STEADY_STD = 0.006  # noise of fuel flow and N1 at one reading
LEAD_S_PCT = 0.2  # relative fuel flow that accelerates the spools by 1 %/s
LINE_STD = 0.035  # per root of ln s: 4 % from 2 to 8 kN in flight. From idle at rest 10 to 20 %: not all of it
CONFIRM_S = 2.0  # steady for so long: fuel flow says what N1 stands for here
FUEL_LEAD_S = 1.0  # a slam's fuel flow leads the thrust by about this much
SURPRISE_SIGMAS = 3.0
LAG_S = 0.25  # thrust leads or lags N1 by about this much
# Always to the same side: ten readings a second of an error that lasts tau = 2 s say as little as white ones of
# sqrt(2 tau / 0.1 s) times its size.
AS_WHITE = 6.3
STILL_N_S = 40.0  # the rate of a brochure thrust that rests: its readings' noise
SETTLE_S = 3.0  # fuel flow and spools find together after a movement: the doubt fades as slowly
RATE_TAU_S = 0.5
MAX_STEP_S = 1.0
MAX_REMEMBERED = 1000.0  # no per cent of N1 and no ln s is as large


class BrochureThrust(NamedTuple):
    """The brochure route at one instant, N; NaN = no estimate."""

    thrust_n: float
    std_n: float  # one sigma, slow: engine, deck and hand-over
    lag_n: float  # one sigma that lasts as long as the throttle moves


SILENT = BrochureThrust(nan, nan, nan)


class HandOver:
    """Mutable: the learnt difference between both routes of one engine."""

    __slots__ = ("_k", "_ln_s0", "_movement", "_n1_pct", "_p", "_t_ns")

    def __init__(self) -> None:
        self._k, self._p = 0.0, START_STD**2
        self._n1_pct = self._ln_s0 = nan
        self._movement = Movement()
        self._t_ns = -1

    def step(self, t_ns: int, deck: DeckEstimate, n1_pct: float, n1_rate_pct_s: float) -> BrochureThrust:
        """`deck` from the inputs that are believed; N1 and its rate NaN when it is not one of them."""
        dt_s = 0.0 if self._t_ns < 0 else min(max((t_ns - self._t_ns) * 1e-9, 0.0), MAX_STEP_S)
        self._t_ns = t_ns
        fuel_n, n1_n = deck.fuel_flow_thrust_n, deck.n1_thrust_n
        if not isfinite(n1_n):
            self._n1_pct = nan
            return self._thrust(deck, fuel_n, START_STD * max(abs(fuel_n), SCALE_FLOOR_N), dt_s, FUEL_LEAD_S)
        scale_n = max(n1_n, SCALE_FLOOR_N)
        if isfinite(self._n1_pct):
            self._p = min(self._p + abs(n1_pct - self._n1_pct) * WANDER_1_PCT**2, START_STD**2)
        self._n1_pct = n1_pct
        rate_pct_s = n1_rate_pct_s if isfinite(n1_rate_pct_s) else 0.0
        if isfinite(fuel_n) and dt_s > 0.0:
            self._learn((fuel_n - n1_n) / scale_n, rate_pct_s, dt_s)
        line = self._line_variance(log(scale_n), rate_pct_s, dt_s if isfinite(fuel_n) else 0.0)
        return self._thrust(deck, n1_n + self._k * scale_n, scale_n * sqrt(self._p + line), dt_s)

    def snapshot(self) -> list[float | None]:
        """What was learnt: k, P, N1 then, ln s0; unknown is None."""
        return [value if isfinite(value) else None for value in (self._k, self._p, self._n1_pct, self._ln_s0)]

    def restore(self, state: Sequence[float | None]) -> bool:
        """Take over a snapshot; False, and nothing changed, when it is none."""
        values = [nan if value is None else value for value in state]
        sane = len(values) == 4 and abs(values[0]) < 1.0 and 0.0 <= values[1] <= START_STD**2
        if sane and not any(abs(value) > MAX_REMEMBERED for value in values):
            self._k, self._p, self._n1_pct, self._ln_s0 = values
            return True
        return False

    def _line_variance(self, ln_s: float, rate_pct_s: float, dt_s: float) -> float:
        """Relative variance of N1's line since fuel flow confirmed it."""
        if not isfinite(self._ln_s0):
            self._ln_s0 = ln_s
        steady = STEADY_STD**2 / (STEADY_STD**2 + (LEAD_S_PCT * rate_pct_s) ** 2)
        self._ln_s0 += steady * min(dt_s / CONFIRM_S, 1.0) * (ln_s - self._ln_s0)
        return LINE_STD**2 * abs(ln_s - self._ln_s0)

    def _learn(self, ratio: float, n1_rate_pct_s: float, dt_s: float) -> None:
        noise = (STEADY_STD**2 + (LEAD_S_PCT * n1_rate_pct_s) ** 2) * 0.1 / dt_s  # readings come ten times a second
        innovation = ratio - self._k
        noise = max(noise, (innovation / SURPRISE_SIGMAS) ** 2 * 0.1 / dt_s - self._p)
        gain = self._p / (self._p + noise)
        self._k += gain * innovation
        self._p *= 1.0 - gain

    def _thrust(
        self, deck: DeckEstimate, thrust_n: float, hand_over_n: float, dt_s: float, lead_s: float = 0.0
    ) -> BrochureThrust:
        lag_n = self._movement.step(thrust_n, dt_s, lead_s)
        return BrochureThrust(thrust_n, hypot(deck.std_n, hand_over_n), lag_n) if isfinite(thrust_n) else SILENT


class Movement:
    """How far a brochure thrust may lead or lag while the throttle moves, and until the engine has settled. Mutable."""

    __slots__ = ("_lagged_n", "_rate_n_s")

    def __init__(self) -> None:
        self._lagged_n, self._rate_n_s = nan, 0.0

    def step(self, thrust_n: float, dt_s: float, lead_s: float = 0.0) -> float:
        """One sigma, as white noise of ten readings a second [N]; `lead_s`: known to lead by so much."""
        if not isfinite(thrust_n):
            self._lagged_n = nan
            return nan
        if not isfinite(self._lagged_n):
            self._lagged_n = thrust_n
        self._lagged_n += min(dt_s / RATE_TAU_S, 1.0) * (thrust_n - self._lagged_n)
        rate_n_s = abs(thrust_n - self._lagged_n) / RATE_TAU_S
        self._rate_n_s = max(rate_n_s, self._rate_n_s * exp(-dt_s / SETTLE_S))
        return AS_WHITE * hypot(LAG_S, lead_s) * max(self._rate_n_s - STILL_N_S, 0.0)
