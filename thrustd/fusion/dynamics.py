"""How the filter's state moves between two steps.

State  x = [T, r, h, c, d]: thrust [N] and its rate [N/s]; error of the mounts [N]; the engine's own deviation from the
brochure [-] and the error of the deck's shape [N].
T' = r; the others are first-order Gauss-Markov, each with its own time and sigma:

    r' = -r / tau_r + w        sigma_r^2 = steady^2 + (gain |dN1/dt|)^2
    h' = -h / tau_h + w        sigma_h(t)
    c' = -c / tau_c + w        sigma_c                     d' = -d / tau_d + w     sigma_d(t)

sigma_h and sigma_d follow the region where the engine works: see `_follow`. Friction in the rubber and the shape of
the deck are other errors at another thrust, however soon it is reached: 1/tau = 1/tau_0 + |r| / forget_after.
Reference: Brown & Hwang, Introduction to Random Signals and Applied Kalman Filtering, ch. 5 (integrated Gauss-Markov,
eq. 5.3).
"""

from math import exp, inf, isfinite, nan, sqrt
from typing import Any

from thrustd.core.columns import Floats
from thrustd.core.jit import compiled

THRUST, RATE, MOUNT, ENGINE, SHAPE = range(5)
N_STATE = 5

DOUBT_ENDS = 0.1
FALLS_BELOW, RISES_ABOVE = 0.8, 1.1  # of v: less is the noise of the readings, and the error would be learnt from it
SHAPE_SETTLE_S = 10.0  # fuel flow has said anew where N1's line is; what a throttle left in the mounts is not over
START_ERROR_N = 60.0  # h and d, before the first measurement says its own
LEAST_ERROR_N = 10.0  # of h and d: no source is exact, and a state known exactly makes covariances singular
IDLE_RATE_N_S = 60.0  # the filter's rate is never still: less than this is no movement
UNKNOWN_RATE_PCT_S = 1.0  # nobody says whether the throttle moves: it may
SCALE_FLOOR_N = 500.0  # relative errors of the brochure are taken of at least this much thrust
SCALE_STEP = 0.05  # s must not follow the noise of the reading it weighs: c would be learnt from it
MOUNT_N2, SHAPE_N2, SCALE_N = range(3)  # a row of sizes: variances of h and d when nothing is learnt of them, and s


@compiled
def _follow(sizes: Floats, which: int, std_n: float, keep: float, dt_s: float, settle_s: float) -> tuple[float, float]:
    """(a, q) of a slow error over a step, while its sigma changes with the region; NaN = the source is silent.

        v' = max(sigma^2, a^2 v + (1 - a^2) sigma^2),     q = v' - a^2 v

    v: its variance when nothing is learnt of it. It is as large as the region says at once, and falls as slowly as the
    error forgets, a (the part `keep`), or within `settle_s`, b:

        v' = max(sigma^2, b^2 v + (1 - b^2) sigma^2),     a = min(a, v' / v)

    for then the error was a sum, and the part that has ended was independent of what stays. Where sigma^2 falls to less
    than `DOUBT_ENDS` of v, a doubt ended (an acceleration came back): b = 0. Between `FALLS_BELOW` and `RISES_ABOVE` of
    v it is the same: a v that grew with readings that are high by noise would let the low ones alone move the thrust.
    """
    before_n2 = sizes[which]
    wanted_n2 = std_n * std_n if isfinite(std_n) else before_n2
    fall = keep
    if before_n2 < wanted_n2 < RISES_ABOVE * before_n2:
        wanted_n2 = before_n2
    if wanted_n2 < FALLS_BELOW * before_n2:
        fall = 0.0 if wanted_n2 < DOUBT_ENDS * before_n2 else keep * exp(-dt_s / settle_s)
    after_n2 = max(wanted_n2, wanted_n2 + fall * fall * (before_n2 - wanted_n2))
    if fall < keep and after_n2 < keep * before_n2:
        keep = after_n2 / before_n2
    sizes[which] = after_n2
    return keep, after_n2 - keep * keep * before_n2


@compiled
def _slow_std(std_n: float, else_n: float) -> float:
    """What is left of a source's sigma beside another error; NaN of a silent source."""
    return sqrt(max(std_n**2 - else_n**2, LEAST_ERROR_N**2)) if isfinite(std_n) else nan


@compiled
def move(m: Any, t: Any, s: Any, dt_s: float, rate_n_s: float) -> None:
    """Write F and Q, each (5, 5), of a step of `dt_s` with a thrust that moves by `rate_n_s`.

    `m`: FILTER, whose f and q are those of the step before, or unity and zeros; `t`: INPUTS; `s`: SETTINGS.
    """
    f, q, sizes, brochure_std_n, n1_rate_pct_s = m.f, m.q, m.sizes, t.brochure_std_n, t.n1_rate_pct_s
    if isfinite(brochure_std_n):
        scale_n = max(abs(t.brochure_n), SCALE_FLOOR_N)
        if abs(scale_n - sizes[SCALE_N]) > SCALE_STEP * sizes[SCALE_N]:
            sizes[SCALE_N] = scale_n
    n1_rate_pct_s = abs(n1_rate_pct_s) if isfinite(n1_rate_pct_s) else UNKNOWN_RATE_PCT_S
    moving = max(s.throttle_rate_gain_n_per_pct * n1_rate_pct_s, m.surprise_n_s)
    var = sqrt(s.thrust_rate_std_n_s**2 + moving * moving) ** 2
    moving_n_s = max(abs(rate_n_s), s.throttle_rate_gain_n_per_pct / 4.0 * n1_rate_pct_s)
    moved = max(moving_n_s - IDLE_RATE_N_S, 0.0) * dt_s / s.forget_after_n
    tau = s.thrust_rate_tau_s
    u = dt_s / tau
    a = exp(-u)
    sigma_h = _slow_std(t.mount_std_n, 0.0)
    sigma_d = _slow_std(brochure_std_n, s.brochure_bias_std * sizes[SCALE_N])
    keep_engine = exp(-dt_s / s.brochure_bias_tau_s)
    keep_h, q_h = _follow(sizes, MOUNT_N2, sigma_h, exp(-dt_s / s.mount_error_tau_s - moved), dt_s, inf)
    keep_d, q_d = _follow(sizes, SHAPE_N2, sigma_d, exp(-dt_s / s.brochure_shape_tau_s - moved), dt_s, SHAPE_SETTLE_S)
    f[RATE, RATE], f[MOUNT, MOUNT], f[ENGINE, ENGINE], f[SHAPE, SHAPE] = a, keep_h, keep_engine, keep_d
    f[THRUST, RATE] = tau * (1.0 - a)
    # the closed form loses its digits below u = 1e-3: its series is 2/3 u^3
    drift = 2.0 * u - 3.0 + 4.0 * a - a * a if u > 1e-3 else 2.0 / 3.0 * u**3
    q[THRUST, THRUST], q[RATE, RATE] = var * tau * tau * drift, var * (1.0 - a * a)
    q[THRUST, RATE] = q[RATE, THRUST] = var * tau * (1.0 - a) ** 2
    q[MOUNT, MOUNT], q[ENGINE, ENGINE] = q_h, s.brochure_bias_std**2 * (1.0 - keep_engine**2)
    q[SHAPE, SHAPE] = q_d
