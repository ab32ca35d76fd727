"""How the filter's state moves between two steps.

State  x = [T, r, b, e, d], all in newton or N/s: thrust, thrust rate, error of the mount route, the engine's own error
against the brochure, error of the deck's shape. T' = r; the others are first-order Gauss-Markov, with their own sigmas:

    r' = -r / tau_r + w        sigma_r^2 = steady^2 + (gain |dN1/dt|)^2
    b' = -b / tau_b + w        sigma_b = the mount model's error here
    e  = c s                   c' = -c / tau_c + w: relative, an engine differs from the brochure for the whole flight
    d' = -d / tau_d + w        sigma_d = what else the deck says about its spread

s is the brochure thrust that was accepted so far, low-passed, and carries both along: F_TT = F_ee = s_k / s_(k-1).
Scaling
e alone, or c as the state with z = T (1 + c), leaks what is not observable from T into e, a little at every step.

Friction in the rubber and the shape of the deck are other errors at another thrust, however soon it is reached:
1/tau = 1/tau_0 + |r| / forget_after. Reference: Brown & Hwang, Introduction to Random Signals and Applied Kalman
Filtering, ch. 5 (integrated Gauss-Markov, eq. 5.3).
"""

from math import exp, sqrt
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from thrustd.fusion.settings import FusionSettings

THRUST, RATE, MOUNT, ENGINE, SHAPE = range(5)
N_STATE = 5
Matrix = npt.NDArray[np.float64]

IDLE_RATE_N_S = 20.0  # the filter's rate is never still: less than this is no movement


def rate_sigma(settings: FusionSettings, n1_rate_pct_s: float, surprised: bool) -> float:
    """Strength of the thrust rate, N/s, for a throttle that moves N1 by `n1_rate_pct_s`.

    `surprised`: a measurement was just gated out. If the thrust moved, the next ones will find the gate open; if a
    sensor lies, the other route holds the thrust where it is and the gate stays shut.
    """
    moving = settings.throttle_rate_gain_n_per_pct * n1_rate_pct_s
    if surprised:
        moving = max(abs(moving), settings.surprise_rate_n_s)
    return sqrt(settings.thrust_rate_std_n_s**2 + moving * moving)


class Motion(NamedTuple):
    """What drives one prediction; sigmas are those of the end of the step."""

    dt_s: float
    rate_sigma_n_s: float
    moving_n_s: float  # how fast thrust moves: as estimated or by the throttle, whichever is more
    mount_sigma_n: float
    mount_sigma_before_n: float
    shape_sigma_n: float
    shape_sigma_before_n: float
    scale_n: float  # s, brochure thrust, low-passed
    scale_before_n: float


def propagate(settings: FusionSettings, motion: Motion) -> tuple[Matrix, Matrix]:
    """(F, Q), each (5, 5)."""
    dt_s, tau = motion.dt_s, settings.thrust_rate_tau_s
    u = dt_s / tau
    a = exp(-u)
    moved = max(motion.moving_n_s - IDLE_RATE_N_S, 0.0) * dt_s / settings.forget_after_n
    keep_mount = exp(-dt_s / settings.mount_bias_tau_s - moved)
    keep_shape = exp(-dt_s / settings.brochure_shape_tau_s - moved)
    keep_bias = exp(-dt_s / settings.brochure_bias_tau_s)
    scaled = motion.scale_n / motion.scale_before_n
    f = np.diag([scaled, a, keep_mount, keep_bias * scaled, keep_shape])
    f[THRUST, RATE] = tau * (1.0 - a)
    var = motion.rate_sigma_n_s**2
    # the closed form loses its digits below u = 1e-3: its series is 2/3 u^3
    drift = 2.0 * u - 3.0 + 4.0 * a - a * a if u > 1e-3 else 2.0 / 3.0 * u**3
    q = np.diag(
        [
            var * tau * tau * drift,
            var * (1.0 - a * a),
            _error_noise(motion.mount_sigma_n, motion.mount_sigma_before_n, keep_mount),
            (settings.brochure_bias_std * motion.scale_n) ** 2 * (1.0 - keep_bias**2),
            _error_noise(motion.shape_sigma_n, motion.shape_sigma_before_n, keep_shape),
        ]
    )
    q[THRUST, RATE] = q[RATE, THRUST] = var * tau * (1.0 - a) ** 2
    return f, q


def _error_noise(sigma: float, before: float, keep: float) -> float:
    """Keeps the variance at sigma^2, and lifts it there at once where the route just became worse."""
    return sigma**2 * (1.0 - keep**2) + max(sigma**2 - before**2, 0.0)
