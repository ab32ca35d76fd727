"""Chi-square gate: a measurement that is odd is left out of this step. Who is at fault, others decide (`sensors`).

nu = y - H x,   S = H P H^T + R     innovation of a scalar measurement and its predicted variance
accepted  if  nu^2 / S <= gate
"""

from math import isfinite
from typing import Any

from thrustd.core.columns import Floats
from thrustd.core.jit import compiled

MOVING_PCT_S = 0.5  # N1 of a throttle that rests stays within 0.3 %/s
PUSHED = 2.0  # rubber is stiffer than its spring rate, and lags


@compiled
def judge(s: Any, y: float, h: Floats, r: float, doubt: float, x: Floats, p: Floats) -> tuple[float, float, bool]:
    """A measurement y = h x + v, h (1, n), of variance r, of a state x (n, 1) with covariance p (n, n).

    `s`: settings; `doubt`: variance by which the gate opens.
    -> innovation, its square over its variance, and whether the measurement is used: the verdict.
    """
    expected, spread = 0.0, 0.0
    for i in range(len(x)):
        expected += h[0, i] * x[i, 0]
        for j in range(len(x)):
            spread += h[0, i] * p[i, j] * h[0, j]
    nu, variance = y - expected, spread + r
    return nu, nu * nu / variance, isfinite(nu) and nu * nu <= s.gate_chi2 * (variance + doubt)


@compiled
def agree_on_a_move(
    mount_nu_n: float, brochure_nu_n: float, brochure_used: bool, n1_rate_pct_s: float, n_per_pct: float, push_n: float
) -> bool:
    """Mounts gated out, and brochure too or N1 itself goes to the same side: the thrust moved, no sensor lies.

    The deck lags what a throttle that is cut does to the mounts, so its own innovation may stay inside. N1 speaks for
    no more than it moves the thrust by, `n_per_pct`, in a second. A throttle that is cut is quicker than N1 is read:
    both mounts were pushed back by `push_n`; no spool accelerates like that.
    """
    if PUSHED * push_n < mount_nu_n < 0.0:
        return True
    both = not brochure_used and mount_nu_n * brochure_nu_n > 0.0
    if abs(n1_rate_pct_s) > MOVING_PCT_S and mount_nu_n * n1_rate_pct_s > 0.0:
        return both or abs(mount_nu_n) < abs(n1_rate_pct_s) * n_per_pct
    return both


@compiled
def surprise_n_s(s: Any, mount: Any, brochure: Any) -> float:
    """Rate that the thrust may have had, N/s, when a measurement was gated out.

    When nobody else holds the thrust where it was, the thrust moved: before N1, read ten times a second, says so.
    When the other source holds it, a sensor lies and its gate stays shut. A source: (innovation, used).
    """
    mount_odd, brochure_odd = isfinite(mount[0]) and not mount[1], isfinite(brochure[0]) and not brochure[1]
    if not mount_odd and not brochure_odd:
        return 0.0
    if not mount[1] and not brochure[1]:
        return s.agreed_surprise_rate_n_s
    return s.surprise_rate_n_s
