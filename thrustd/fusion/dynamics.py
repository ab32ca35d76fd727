"""How the filter's state moves between two steps.

State  x = [T, r, z, h, c, d]: thrust [N] and its rate [N/s]; zero of the mounts [N] and the rest of their error [N];
the engine's own deviation from the brochure [-] and the error of the deck's shape [N].
T' = r; the others are first-order Gauss-Markov, each with its own time and sigma:

    r' = -r / tau_r + w        sigma_r^2 = steady^2 + (gain |dN1/dt|)^2
    z' = -z / tau_z + w        sigma_z                     c' = -c / tau_c + w     sigma_c
    h' = -h / tau_h + w        sigma_h(t)                  d' = -d / tau_d + w     sigma_d(t)

sigma_h and sigma_d follow the region where the engine works: see `ErrorSize`. Friction in the rubber and the shape of
the deck are other errors at another thrust, however soon it is reached: 1/tau = 1/tau_0 + |r| / forget_after.
Reference: Brown & Hwang, Introduction to Random Signals and Applied Kalman Filtering, ch. 5 (integrated Gauss-Markov,
eq. 5.3).
"""

from math import exp, inf, sqrt

import numpy as np
import numpy.typing as npt

from thrustd.fusion.settings import FusionSettings

THRUST, RATE, ZERO, MOUNT, ENGINE, SHAPE = range(6)
N_STATE = 6
Matrix = npt.NDArray[np.float64]

DOUBT_ENDS = 0.1
FALLS_BELOW = 0.8  # of v: less is the noise of the readings, and the error would be forgotten by it
SHAPE_SETTLE_S = 10.0  # fuel flow has said anew where N1's line is; what a throttle left in the mounts is not over
START_ERROR_N = 60.0  # h and d, before the first measurement says its own
IDLE_RATE_N_S = 60.0  # the filter's rate is never still: less than this is no movement


class ErrorSize:
    """Variance of one slow error when nothing is learnt of it, while its sigma changes with the region, N^2.

        v' = max(sigma^2, a^2 v + (1 - a^2) sigma^2),     q = v' - a^2 v

    It is as large as the region says at once, and falls as slowly as the error forgets, a, or within `settle_s`, b:

        v' = max(sigma^2, b^2 v + (1 - b^2) sigma^2),     a = min(a, v' / v)

    for then the error was a sum, and the part that has ended was independent of what stays. Where sigma^2 falls to less
    than `DOUBT_ENDS` of v, a doubt ended (an acceleration came back): b = 0.
    """

    __slots__ = ("settle_s", "variance_n2")

    def __init__(self, std_n: float, settle_s: float = inf) -> None:
        self.variance_n2 = std_n * std_n
        self.settle_s = settle_s

    def step(self, std_n: float, keep: float, dt_s: float) -> tuple[float, float]:
        """(a, q) of a step over which the error forgets down to the part `keep`; NaN std = the route is silent."""
        before_n2 = self.variance_n2
        wanted_n2 = std_n * std_n if std_n == std_n else before_n2
        fall = keep
        if wanted_n2 < FALLS_BELOW * before_n2:
            fall = 0.0 if wanted_n2 < DOUBT_ENDS * before_n2 else keep * exp(-dt_s / self.settle_s)
        self.variance_n2 = max(wanted_n2, wanted_n2 + fall * fall * (before_n2 - wanted_n2))
        if fall < keep and self.variance_n2 < keep * before_n2:
            keep = self.variance_n2 / before_n2
        return keep, self.variance_n2 - keep * keep * before_n2


class Dynamics:
    """F and Q of one filter, written anew in place for every step."""

    def __init__(self, settings: FusionSettings) -> None:
        self._settings = settings
        self.mount, self.shape = ErrorSize(START_ERROR_N), ErrorSize(START_ERROR_N, SHAPE_SETTLE_S)
        self._f, self._q = np.eye(N_STATE), np.zeros((N_STATE, N_STATE))
        self._f_diagonal = self._f.reshape(-1)[:: N_STATE + 1]  # views
        self._q_diagonal = self._q.reshape(-1)[:: N_STATE + 1]

    def step(
        self, dt_s: float, rate_n_s: float, n1_rate_pct_s: float, surprise_n_s: float, stds_n: tuple[float, float]
    ) -> tuple[Matrix, Matrix]:
        """(F, Q), each (6, 6), good until the next call.

        `rate_n_s` of the thrust now; the throttle moves N1 by `n1_rate_pct_s`; `surprise_n_s`: a rate unseen;
        `stds_n`: sigma of h and d where the engine works now, NaN when nobody says.
        """
        s = self._settings
        moving = max(abs(s.throttle_rate_gain_n_per_pct * n1_rate_pct_s), surprise_n_s)
        var = sqrt(s.thrust_rate_std_n_s**2 + moving * moving) ** 2
        moving_n_s = max(abs(rate_n_s), s.throttle_rate_gain_n_per_pct / 4.0 * abs(n1_rate_pct_s))
        moved = max(moving_n_s - IDLE_RATE_N_S, 0.0) * dt_s / s.forget_after_n
        tau = s.thrust_rate_tau_s
        u = dt_s / tau
        a = exp(-u)
        keep_mount, q_mount = self.mount.step(stds_n[0], exp(-dt_s / s.mount_error_tau_s - moved), dt_s)
        keep_shape, q_shape = self.shape.step(stds_n[1], exp(-dt_s / s.brochure_shape_tau_s - moved), dt_s)
        keep_zero = exp(-dt_s / s.mount_zero_tau_s)
        keep_engine = exp(-dt_s / s.brochure_bias_tau_s)
        self._f_diagonal[:] = 1.0, a, keep_zero, keep_mount, keep_engine, keep_shape
        self._f[THRUST, RATE] = tau * (1.0 - a)
        # the closed form loses its digits below u = 1e-3: its series is 2/3 u^3
        drift = 2.0 * u - 3.0 + 4.0 * a - a * a if u > 1e-3 else 2.0 / 3.0 * u**3
        self._q_diagonal[:] = (
            var * tau * tau * drift,
            var * (1.0 - a * a),
            s.mount_zero_std_n**2 * (1.0 - keep_zero**2),
            q_mount,
            s.brochure_bias_std**2 * (1.0 - keep_engine**2),
            q_shape,
        )
        self._q[THRUST, RATE] = self._q[RATE, THRUST] = var * tau * (1.0 - a) ** 2
        return self._f, self._q
