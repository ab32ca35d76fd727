"""One engine's thrust from two routes: a Kalman filter on filterpy.

State  x = [T, r, h, c, d], see `dynamics`. Measurements, each a scalar update behind its own gate:

    mount     y = T - age r + h + v                  sigma_h: the mounts' error in this region
    brochure  y = T - age r + s c + d + v            sigma_d: the deck's spread, the engine's own taken out
    tare      0 = T + v                              engine off (N1 < 5 %): what the mounts show is their error

s is the brochure thrust in steps of 5 %. The errors are learnt only from the difference of two measurements:
the first of an instant moves T and r alone (Schmidt-Kalman), else a thrust that moves would teach the filter an error
in proportion to it. One reading of the engine is one measurement, however often it is repeated; its lead or lag while
the throttle moves is noise. filterpy takes NaN without a word and is poisoned for good: nothing that is not finite
reaches `update`.
Reference: Schmidt 1966; Bierman, Factorization Methods for Discrete Sequential Estimation, ch. 8 (consider states).
"""

from math import isfinite, nan
from typing import Any

import numpy as np
from filterpy.kalman import KalmanFilter

from thrustd.core.types import Estimate, Fault
from thrustd.fusion.dynamics import N_STATE, RATE, START_ERROR_N, THRUST, Matrix
from thrustd.fusion.estimate_row import estimate_row
from thrustd.fusion.settings import FusionSettings, settings_row
from thrustd.fusion.smoother import Tape
from thrustd.fusion.thrust_step import DONE, FILTER, LIED, NEVER_NS, NEWS, PAST_S, PREDICT, UPDATE, go_on, lay_out

START_STD_N = 4000.0  # nothing is known: 0 to take-off thrust
START_RATE_STD_N_S = 100.0
END_P = N_STATE + N_STATE**2  # in a row of x, P, three sizes and both gates
N_ROW = END_P + 9


class ThrustFilter:
    """Fuses one engine. `step` per fused instant; the state can be checkpointed and restored."""

    def __init__(self, settings: FusionSettings, engine: int, name: str = "", mount_age_s: float = 0.0) -> None:
        """`mount_age_s`: of a mount's mean force when it is told, half the time it is taken over."""
        self._engine = engine
        self._name = name or f"engine[{engine}]"
        self._memory = np.zeros(1, FILTER)
        self._memory["t_ns"] = self._memory["read_ns"] = NEVER_NS
        self._memory["last_nu_n"], self._memory["mount_age_s"] = nan, mount_age_s
        self._memory["step_n"] = 2.0 * mount_age_s * settings.agreed_surprise_rate_n_s
        self._settings = settings_row(settings)
        self._z, self._n_news, (self._slow,) = self._memory["z"], self._memory["n_news"], self._memory["slow"]
        self._slow[0, :2] = START_ERROR_N**2  # there is no brochure thrust yet
        self._kf = KalmanFilter(dim_x=N_STATE, dim_z=1)
        self._kf.inv = np.reciprocal  # scalar measurements: S is 1 x 1
        self._kf.x = np.zeros((N_STATE, 1))
        start = (START_STD_N, START_RATE_STD_N_S, START_ERROR_N, settings.brochure_bias_std, START_ERROR_N)
        self._kf.P = np.diag(np.square(start))
        # F, Q, H and R of one scalar measurement are written anew in place
        self._kf.F, self._kf.Q, self._h, self._kf.R = (self._memory[name][0] for name in ("f", "q", "h", "r"))
        self._kf.F[:] = np.eye(N_STATE)
        self._tape: Tape | None = None
        self._faults: list[Fault] = []
        self._past = [self._row(), self._row()]  # of 5 to 10 s ago, of `past_s` ago

    @property
    def thrust_n(self) -> float:
        return float(self._kf.x.item(THRUST))

    def keep(self) -> Tape:
        """From now on every step is written on this tape, for `smoother.smooth`."""
        self._tape = Tape()
        return self._tape

    def step(self, told: Any) -> Estimate:
        """Predict to `t_ns`, weigh what is there, return the estimate. `told`: see `FusionInputs.row`."""
        kf, what = self._kf, (self._memory, told, self._settings)
        while (deed := go_on(*what, kf.x, kf.P)) != DONE:
            if deed == UPDATE:
                kf.update(self._z.item(), H=self._h)
            elif deed == PREDICT:
                kf.predict()
            else:
                self._look_back(told)
        if self._n_news.item():
            self._report()
        row = estimate_row(*what, kf.x, kf.P, self._engine)
        if self._tape is not None:
            self._tape.write(told["t_ns"].item(), kf.x, kf.P, kf.F, kf.Q)
        estimate: Estimate = tuple.__new__(Estimate, row)
        return estimate

    def take_faults(self) -> list[Fault]:
        """Since the last call: routes that failed or are believed again, "tare"."""
        faults, self._faults = self._faults, []
        return faults

    def snapshot(self) -> dict[str, list[float]]:
        """The whole state as plain numbers."""
        clock = [float(self._memory[name].item()) for name in ("t_ns", "off_s", "tared", "doubts", "past_s")]
        return {"clock": clock, "now": self._row(), "past": [*self._past[0], *self._past[1]]}

    def restore(self, state: dict[str, list[float]]) -> bool:
        """Take over a snapshot; False (and nothing changed) when it is not a sane one."""
        if {key: len(row) for key, row in state.items()} != {"clock": 5, "now": N_ROW, "past": 2 * N_ROW}:
            return False
        if not all(isfinite(value) for row in state.values() for value in row):
            return False
        now, *past = np.reshape([*state["now"], *state["past"]], (3, N_ROW)).tolist()
        if not all(np.linalg.eigvalsh(_covariance(row)).min() > 0.0 for row in (now, *past)):
            return False
        self._load(now)
        self._past, memory = past, self._memory
        t_ns, memory["off_s"], tared, doubts, past_s = state["clock"]
        memory["t_ns"], memory["tared"], memory["doubts"] = int(t_ns), bool(tared), int(doubts)
        memory["past_s"] = min(max(past_s, 0.0), PAST_S)
        return True

    def _row(self) -> list[float]:
        """All that measurements change."""
        return [number for part in (self._kf.x, self._kf.P, self._slow) for number in part.ravel().tolist()]

    def _load(self, row: list[float]) -> None:
        self._kf.x, self._kf.P = np.array(row[:N_STATE]).reshape(N_STATE, 1), _covariance(row)
        self._slow[:] = np.reshape(row[END_P:], (3, 3))

    def _look_back(self, told: Any) -> None:
        """A sensor that is named has lied since a while: all but the thrust is as it was 5 to 10 s ago.

        The errors have moved meanwhile as the thrust did; or it did not, and was misled by as much: so far it is open.
        """
        memory = self._memory
        if memory["past_s"].item() >= PAST_S:
            self._past, memory["past_s"] = [self._past[1], self._row()], 0.0
        if told["status"].item() & LIED & ~memory["doubts"].item():
            thrust_n, age_s = self.thrust_n, PAST_S + memory["past_s"].item()
            self._load(self._past[0])
            rate_n_s = (thrust_n - self.thrust_n) / age_s
            lay_out(memory, told, self._settings, age_s, rate_n_s)
            self._kf.x[RATE] = rate_n_s
            self._kf.predict()
            self._kf.x[THRUST] = thrust_n
            self._kf.P[THRUST, THRUST] += (rate_n_s * age_s) ** 2
            self._past[1] = self._past[0]

    def _report(self) -> None:
        t_ns = self._memory["t_ns"].item()
        for what in self._memory["news"][0, : self._n_news.item()].tolist():
            route, kind, active = NEWS[what]
            self._faults.append(Fault(t_ns, f"{route}[{self._name}]" if route else self._name, kind, active))


def _covariance(row: list[float]) -> Matrix:
    return np.reshape(row[N_STATE:END_P], (N_STATE, N_STATE))
