"""One engine's thrust from two sources: a Kalman filter, its equations in `kalman`.

State  x = [T, r, h, c, d], see `dynamics`. Measurements, each a scalar update behind its own gate:

    mount     y = T - age r + h + v                  sigma_h: the mounts' error in this region
    brochure  y = T - age r + s c + d + v            sigma_d: the deck's spread, the engine's own taken out
    zero      0 = T + v                              engine off: what the mounts show is their error

s is the brochure thrust in steps of 5 %. The errors are learnt only from the difference of two measurements:
the first of an instant moves T and r alone (Schmidt-Kalman), else a thrust that moves would teach the filter an error
in proportion to it. One reading of the engine is one measurement, however often it is repeated; its lead or lag while
the throttle moves is noise. NaN would poison the filter for good: nothing that is not finite reaches `update`.
Reference: Schmidt 1966; Bierman, Factorization Methods for Discrete Sequential Estimation, ch. 8 (consider states).
"""

from math import isfinite, nan, sqrt
from typing import Any

import numpy as np

from thrustd.core.types import Estimate
from thrustd.fusion.dynamics import (
    LEAST_ERROR_N,
    MOUNT,
    MOUNT_N2,
    N_STATE,
    RATE,
    SHAPE,
    SHAPE_N2,
    START_ERROR_N,
    THRUST,
)
from thrustd.fusion.estimate_row import estimate_row
from thrustd.fusion.mixture import Weighed
from thrustd.fusion.settings import FusionSettings, settings_row
from thrustd.fusion.smoother import Tape
from thrustd.fusion.thrust_step import BOUND, FILTER, NEVER_NS, go_on

START_STD_N = 4000.0  # nothing is known: 0 to take-off thrust
START_RATE_STD_N_S = 100.0
END_P = N_STATE + N_STATE**2  # in a row of x, P and three sizes
ALONE = Weighed(np.array([[1.0, 0.0, 0.0]]), 0, 0.0, np.ones(1))  # the only hypothesis: all is well


class ThrustFilter:
    """Fuses one engine. `step` per fused instant; the state can be checkpointed and restored."""

    def __init__(self, settings: FusionSettings, engine: int, mount_age_s: float = 0.0) -> None:
        """`mount_age_s`: of a mount's mean force when it is told, half the time it is taken over."""
        self._engine = engine
        self._memory = np.zeros(1, FILTER)
        self._memory["t_ns"] = self._memory["read_ns"] = NEVER_NS
        self._memory["last_nu_n"], self._memory["mount_age_s"] = nan, mount_age_s
        self._memory["step_n"] = 2.0 * mount_age_s * settings.agreed_surprise_rate_n_s
        self._settings = settings_row(settings)
        self._memory["sizes"][0, :2] = START_ERROR_N**2  # there is no brochure thrust yet
        start = (START_STD_N, START_RATE_STD_N_S, START_ERROR_N, settings.brochure_bias_std, START_ERROR_N)
        self._prior = np.diag(np.square(start))
        self._x, self._p = np.zeros((N_STATE, 1)), self._prior.copy()  # written in place
        self._memory["f"] = np.eye(N_STATE)
        self._tape: Tape | None = None

    @property
    def thrust_n(self) -> float:
        return float(self._x.item(THRUST))

    def keep(self) -> Tape:
        """From now on every step is written on this tape, for `smoother.smooth`."""
        self._tape = Tape()
        return self._tape

    def step(self, told: Any, weighed: Weighed = ALONE) -> Estimate:
        """Predict to `t_ns`, weigh what is there, return the estimate. `told`: see `FusionInputs.row`."""
        go_on(self._memory, told, self._settings, self._x, self._p)
        row = estimate_row(self._memory, told, self._x, self._p, self._engine, weighed)
        if self._tape is not None:
            self._tape.write(told["t_ns"].item(), self._x, self._p, self._memory["f"][0], self._memory["q"][0])
        estimate: Estimate = tuple.__new__(Estimate, row)
        return estimate

    def begin_anew(self, thrust_n: float, std_n: float, told: Any) -> None:
        """Another hypothesis leads: the thrust is this, and the sources' errors are what is left of them.

        `told`: what the next `step` is. What is wrong with the thrust is wrong with the errors, to the other side:
        what led to it is not counted again.
        """
        if not (isfinite(thrust_n) and 0.0 < std_n < START_STD_N):
            return
        x, p, sizes = self._x, self._p, self._memory["sizes"][0]
        rate_n_s, way = x.item(RATE), np.zeros(N_STATE)
        x[:], p[:] = 0.0, self._prior
        x[THRUST], x[RATE], way[THRUST] = thrust_n, rate_n_s, std_n
        p[THRUST, THRUST] = LEAST_ERROR_N**2
        for place, size, source in ((MOUNT, MOUNT_N2, "mount_n"), (SHAPE, SHAPE_N2, "brochure_n")):
            left_n, bound_n = told[source].item() - thrust_n, BOUND * sqrt(sizes.item(size))
            p[place, place] = sizes[size]
            if abs(left_n) < bound_n + BOUND * std_n:
                x[place], p[place, place], way[place] = min(max(left_n, -bound_n), bound_n), LEAST_ERROR_N**2, -std_n
        p += np.outer(way, way)

    @property
    def calibrates(self) -> bool:
        """At this step the mounts are to be asked for their zeros."""
        return bool(self._memory["calibrated_now"].item())

    def snapshot(self) -> dict[str, list[float]]:
        """The whole state as plain numbers."""
        clock = [float(self._memory[name].item()) for name in ("t_ns", "off_s", "calibrated")]
        parts = self._x, self._p, self._memory["sizes"]
        return {"clock": clock, "now": [number for part in parts for number in part.ravel().tolist()]}

    def restore(self, state: dict[str, list[float]]) -> bool:
        """Take over a snapshot; False (and nothing changed) when it is not a sane one."""
        if {key: len(row) for key, row in state.items()} != {"clock": 3, "now": END_P + 3}:
            return False
        if not all(isfinite(value) for row in state.values() for value in row):
            return False
        now, memory = state["now"], self._memory
        covariance = np.reshape(now[N_STATE:END_P], (N_STATE, N_STATE))
        if not np.linalg.eigvalsh(covariance).min() > 0.0:
            return False
        self._x[:, 0], self._p[:] = now[:N_STATE], covariance
        memory["sizes"] = now[END_P:]
        t_ns, memory["off_s"], calibrated = state["clock"]
        memory["t_ns"], memory["calibrated"] = int(t_ns), bool(calibrated)
        return True
