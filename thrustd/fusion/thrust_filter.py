"""One engine's thrust from two routes: a Kalman filter on filterpy.

State  x = [T, r, z, h, c, d], see `dynamics`. Measurements, each a scalar update behind its own gate:

    mount     y = T - age r + z + h + v              sigma_h: the model's error in this region, zero taken out
    brochure  y = T - age r + s c + d + v            sigma_d: the deck's spread, the engine's own taken out
    tare      0 = T + v                              engine off (N1 < 5 %): what the mounts show is their error

s is the brochure thrust in steps of 5 %. The errors are learnt only from the difference of two measurements:
the first of an instant moves T and r alone (Schmidt-Kalman), else a thrust that moves would teach the filter an error
in proportion to it. z is learnt with the engine off alone: the deck's errors come back with the thrust, so many
readings of it say no more of a zero than one. One reading of the engine is one measurement, however often it is
repeated; its lead or lag while the throttle moves is noise. filterpy takes NaN without a word and is poisoned for
good: nothing that is not finite reaches `update`.
Reference: Schmidt 1966; Bierman, Factorization Methods for Discrete Sequential Estimation, ch. 8 (consider states).
"""

from math import isfinite, nan

import numpy as np

from thrustd.fusion.dynamics import ENGINE, MOUNT, N_STATE, RATE, SHAPE, START_ERROR_N, THRUST, ZERO, Dynamics, Matrix
from thrustd.fusion.estimate_row import estimate_row
from thrustd.fusion.fusion_inputs import FusionInputs, sane
from thrustd.fusion.gate import NOTHING, Gate, Verdict, agree_on_a_move, surprise_n_s
from thrustd.fusion.kalman import KalmanFilter
from thrustd.fusion.settings import FusionSettings, settings_row
from thrustd.fusion.smoother import Tape
from thrustd.types import Estimate, Fault, Status

START_STD_N = 4000.0  # nothing is known: 0 to take-off thrust
START_RATE_STD_N_S = 100.0
PAUSE_S = 1.0  # a restart, frames that were shed: nobody saw whether the throttle moved
MAX_STEP_S = 10.0  # longer silences are predicted as this long: the band is as wide as it gets by then
OFF_DOUBT_N = 150.0
STILL_TO_COME = 2.0  # of a move that began within the step that a mean is taken over
TARE_H = np.array([[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
NEVER_NS = -1
ERRORS, ZERO_ALONE, NO_ERROR = slice(ZERO, N_STATE), slice(ZERO, ZERO + 1), slice(0, 0)
PAST_S = 5.0  # what lied is named within 3.4 s
END_P = N_STATE + N_STATE**2  # in a row of x, P, three sizes and both gates
N_ROW = END_P + 9
LIED = int(Status.SENSOR_DOUBTED | Status.MOUNTS_DISAGREE | Status.STUCK)


class ThrustFilter:
    """Fuses one engine. `step` per fused instant; the state can be checkpointed and restored."""

    def __init__(self, settings: FusionSettings, engine: int, name: str = "", mount_age_s: float = 0.0) -> None:
        """`mount_age_s`: of a mount's mean force when it is told, half the time it is taken over."""
        self._settings = settings
        self._engine = engine
        self._name = name or f"engine[{engine}]"
        self._t_ns = self._read_ns = NEVER_NS  # of the last step, of the last brochure reading used
        self._off_s, self._off, self._tared = 0.0, False, False
        self._surprise_n_s = 0.0
        # one sigma of what no N1 spoke of yet, over the step that a mean is taken over
        self._step_n = 2.0 * mount_age_s * settings.agreed_surprise_rate_n_s
        self._anchored = False  # a measurement of this instant has said where T is: the next teaches the errors
        self._brochure_verdict = NOTHING  # of the last reading
        self._faults: list[Fault] = []
        self._numbers = settings_row(settings)
        self._mount_gate, self._brochure_gate = Gate(self._numbers), Gate(self._numbers)
        self._dynamics = Dynamics(self._numbers)
        self._kf = KalmanFilter(dim_x=N_STATE, dim_z=1)
        self._kf.inv = np.reciprocal  # scalar measurements: S is 1 x 1
        self._kf.x = np.zeros((N_STATE, 1))
        zero_n, engine_std = settings.mount_zero_std_n, settings.brochure_bias_std
        start = (START_STD_N, START_RATE_STD_N_S, zero_n, START_ERROR_N, engine_std, START_ERROR_N)
        self._kf.P = np.diag(np.square(start))
        self._motion: tuple[Matrix, Matrix] = self._dynamics.step(0.0, 0.0, 0.0, 0.0, nan, nan, nan)
        # F, Q, the rows of H and R of one scalar measurement are written anew in place
        self._kf.F, self._kf.Q = self._motion
        self._mount_h, self._brochure_h, self._r = np.zeros((1, N_STATE)), np.zeros((1, N_STATE)), np.zeros((1, 1))
        self._kf.R = self._r
        self._mount_h[0, (THRUST, ZERO, MOUNT)] = 1.0
        self._mount_h[0, RATE] = -mount_age_s
        self._brochure_h[0, (THRUST, SHAPE)] = 1.0
        self._tape: Tape | None = None
        self._doubts = 0  # the `LIED` bits of the last step
        self._past, self._past_s = [self._row(), self._row()], 0.0  # of 5 to 10 s ago, of `_past_s` ago

    @property
    def thrust_n(self) -> float:
        return float(self._kf.x.item(THRUST))

    def keep(self) -> Tape:
        """From now on every step is written on this tape, for `smoother.smooth`."""
        self._tape = Tape()
        return self._tape

    def step(self, inputs: FusionInputs) -> Estimate:
        """Predict to `t_ns`, weigh what is there, return the estimate."""
        inputs = sane(inputs)
        first = self._t_ns == NEVER_NS
        dt_s = 0.0 if first else max((inputs.t_ns - self._t_ns) * 1e-9, 0.0)
        self._t_ns = inputs.t_ns
        self._anchored = False
        if dt_s > PAUSE_S:
            self._surprise_n_s = max(self._surprise_n_s, self._settings.surprise_rate_n_s)
        self._predict(min(dt_s, MAX_STEP_S), inputs)
        self._look_back(min(dt_s, MAX_STEP_S), inputs)
        off = self._off = self._engine_off(inputs, dt_s)
        if off:
            self._update(0.0, self._settings.tare_std_n**2, TARE_H)
        # the mount first: it is the one that knows where the thrust is while the throttle moves
        mount = self._mount(inputs, dt_s, off)
        still = inputs.n1_pct < self._settings.engine_off_n1_pct  # no deck says anything of an engine that stands
        if off or still:
            self._brochure_verdict = NOTHING
        brochure = NOTHING if off or still else self._brochure(inputs)
        gain_n_pct = self._settings.throttle_rate_gain_n_per_pct
        if agree_on_a_move(mount, brochure, inputs.n1_rate_pct_s, gain_n_pct, inputs.push_n):
            moved_n = mount.innovation_n
            self._open(moved_n**2)
            mount = self._mount(inputs, 0.0, off)
            self._open(min(STILL_TO_COME * moved_n, self._step_n, key=abs) ** 2)
            if isfinite(brochure.innovation_n) and not brochure.used:
                brochure = self._brochure(inputs, again=True)
        routes = (mount, self._mount_gate), (self._brochure_verdict, self._brochure_gate)
        self._surprise_n_s = surprise_n_s(self._settings, *routes)
        if self._tape is not None:
            self._tape.write(self._t_ns, self._kf.x, self._kf.P, *self._motion)
        return self._estimate(inputs, mount, brochure, off)

    def take_faults(self) -> list[Fault]:
        """Faults since the last call: "mount_failed", "mount_recovered", "brochure_...", "tare"."""
        faults, self._faults = self._faults, []
        return faults

    def snapshot(self) -> dict[str, list[float]]:
        """The whole state as plain numbers."""
        clock = [float(self._t_ns), self._off_s, float(self._tared), float(self._doubts), self._past_s]
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
        self._past = past
        self._t_ns, self._off_s, self._tared = int(state["clock"][0]), state["clock"][1], bool(state["clock"][2])
        self._doubts, self._past_s = int(state["clock"][3]), min(max(state["clock"][4], 0.0), PAST_S)
        return True

    def _row(self) -> list[float]:
        """All that measurements change."""
        parts = self._kf.x, self._kf.P, self._dynamics.sizes, self._mount_gate.row, self._brochure_gate.row
        return [number for part in parts for number in part.ravel().tolist()]

    def _load(self, row: list[float]) -> None:
        self._kf.x, self._kf.P = np.array(row[:N_STATE]).reshape(N_STATE, 1), _covariance(row)
        self._dynamics.sizes[:], self._mount_gate.row[:], self._brochure_gate.row[:] = (
            row[END_P:-6],
            row[-6:-3],
            row[-3:],
        )

    def _look_back(self, dt_s: float, inputs: FusionInputs) -> None:
        """A sensor that is named has lied since a while: all but the thrust is as it was 5 to 10 s ago.

        The errors have moved meanwhile as the thrust did. A thrust that was misled both routes gate out, and it is
        opened then.
        """
        self._past_s += dt_s
        named, self._doubts = inputs.status & LIED & ~self._doubts, inputs.status & LIED
        if self._past_s >= PAST_S:
            self._past, self._past_s = [self._past[1], self._row()], 0.0
        if named:
            thrust_n, age_s = self.thrust_n, PAST_S + self._past_s
            self._load(self._past[0])
            self._kf.x[RATE] = (thrust_n - self.thrust_n) / age_s
            self._predict(age_s, inputs)
            self._kf.x[THRUST] = thrust_n
            self._past[1] = self._past[0]

    def _predict(self, dt_s: float, inputs: FusionInputs) -> None:
        routes_n = inputs.mount_std_n, inputs.brochure_n, inputs.brochure_std_n
        rate_n_s: float = self._kf.x.item(RATE)
        self._motion = self._dynamics.step(dt_s, rate_n_s, inputs.n1_rate_pct_s, self._surprise_n_s, *routes_n)
        self._kf.predict()

    def _open(self, variance_n2: float) -> None:
        """The thrust may be elsewhere than it was predicted."""
        more = np.zeros((N_STATE, N_STATE))
        more[THRUST, THRUST] = variance_n2
        self._kf.P = self._kf.P + more
        self._motion = self._motion[0], self._motion[1] + more

    def _mount(self, inputs: FusionInputs, dt_s: float, off: bool) -> Verdict:
        """With the engine off the mounts show their own error, whatever the filter held it for: a wider gate."""
        noise, doubt_n2 = self._settings.mount_noise_std_n**2, OFF_DOUBT_N**2 if off else 0.0
        return self._measure(inputs.mount_n, self._mount_h, noise, self._mount_gate, "mount", dt_s, doubt_n2)

    def _brochure(self, inputs: FusionInputs, again: bool = False) -> Verdict:
        """Once per reading of the engine; in between the last verdict stands."""
        read_ns = inputs.t_ns - round(inputs.brochure_age_s * 1e9)
        if not isfinite(inputs.brochure_n):
            self._brochure_verdict = NOTHING
            return NOTHING
        if read_ns <= self._read_ns and not again:
            return NOTHING
        dt_s = 0.0 if self._read_ns == NEVER_NS else (read_ns - self._read_ns) * 1e-9
        self._read_ns = read_ns
        h = self._brochure_h
        h[0, RATE], h[0, ENGINE] = -inputs.brochure_age_s, self._dynamics.scale_n
        noise = self._settings.brochure_noise_std_n**2 + inputs.brochure_lag_n**2
        self._brochure_verdict = self._measure(inputs.brochure_n, h, noise, self._brochure_gate, "brochure", dt_s)
        return self._brochure_verdict

    def _measure(
        self, y: float, h: Matrix, r: float, gate: Gate, route: str, dt_s: float, doubt_n2: float = 0.0
    ) -> Verdict:
        """Gate one scalar measurement, opened by `doubt_n2`, and use it."""
        if not isfinite(y):
            return NOTHING
        was_failed = gate.failed
        verdict = gate.judge(y, h, r, doubt_n2, dt_s, self._kf.x, self._kf.P)
        if gate.failed != was_failed:
            self._report(f"{route}_{'failed' if gate.failed else 'recovered'}")
        if verdict.used:
            self._update(y, r, h)
        return verdict

    def _update(self, y: float, r: float, h: Matrix) -> None:
        self._r[0, 0] = r
        kf, kept = self._kf, ERRORS if not self._anchored else NO_ERROR if self._off else ZERO_ALONE
        errors, spread = kf.x[kept], kf.P[kept, kept]
        kf.update(y, H=h)  # makes new arrays
        kf.x[kept], kf.P[kept, kept] = errors, spread
        self._anchored = True

    def _engine_off(self, inputs: FusionInputs, dt_s: float) -> bool:
        turning = not inputs.n1_pct < self._settings.engine_off_n1_pct  # NaN counts as turning
        self._off_s = 0.0 if turning else self._off_s + dt_s
        off = self._off_s >= self._settings.engine_off_after_s
        if off and not self._tared and isfinite(inputs.mount_n):
            self._report("tare")
            self._tared = True
        if turning:
            self._tared = False
        return off

    def _report(self, kind: str) -> None:
        self._faults.append(Fault(self._t_ns, self._name, kind))

    def _estimate(self, inputs: FusionInputs, mount: Verdict, brochure: Verdict, off: bool) -> Estimate:
        gates, last = (self._mount_gate.row, self._brochure_gate.row), self._brochure_verdict
        memory = self._kf.x, self._kf.P, self._dynamics.sizes, *gates, self._numbers, self._engine
        row = estimate_row(*memory, off, last.innovation_n, last.used, *mount, *brochure, *inputs)
        estimate: Estimate = tuple.__new__(Estimate, row)
        return estimate


def _covariance(row: list[float]) -> Matrix:
    return np.reshape(row[N_STATE:END_P], (N_STATE, N_STATE))
