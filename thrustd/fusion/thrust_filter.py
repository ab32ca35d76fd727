"""One engine's thrust from two routes: an extended Kalman filter on filterpy.

State  x = [T, r, b, c, d], see `dynamics`. Measurements, each a scalar update behind its own gate:

    mount     z = T + b + v              H = [1, 0, 1, 0, 0]
    brochure  z = T (1 + c) + d + v      H = [1 + c, 0, 0, T, 1]
    tare      0 = T + v                  engine off (N1 < 5 %): mount's zero is learnt as b

filterpy takes NaN without a word and is poisoned for good: nothing that is not finite reaches `update`.
"""

from math import isfinite, nan, sqrt
from typing import NamedTuple

import numpy as np
from filterpy.kalman import KalmanFilter

from thrustd.fusion.dynamics import BROCHURE, MOUNT, N_STATE, RATE, SHAPE, THRUST, Matrix, Motion, propagate, rate_sigma
from thrustd.fusion.gate import Gate
from thrustd.fusion.settings import FusionSettings
from thrustd.types import Estimate, Fault, Status

START_STD_N = 4000.0  # nothing is known: 0 to take-off thrust
START_RATE_STD_N_S = 100.0
TARE_H = np.array([[1.0, 0.0, 0.0, 0.0, 0.0]])
MOUNT_H = np.array([[1.0, 0.0, 1.0, 0.0, 0.0]])
MAX_STEP_S = 10.0  # longer silences are predicted as this long: the band is as wide as it gets by then
START_ERROR_N = 60.0  # of either route, before the first measurement says its own


class FusionInputs(NamedTuple):
    """What is known of one engine at one fused step; NaN = no measurement. Forces in N, sigma beside them."""

    t_ns: int
    mount_n: float  # sum of the engine's mounts, corrected for load factors
    mount_std_n: float  # of the model in this region, its slow errors included
    brochure_n: float
    brochure_std_n: float  # engine bias included
    n1_pct: float
    n1_rate_pct_s: float
    load_share: float = nan
    mount_extrapolating: bool = False
    brochure_extrapolating: bool = False
    transient: bool = False
    gap: bool = False
    one_mount: bool = False
    load_factor_stale: bool = False
    status: int = 0  # Status bits found elsewhere (monitor, catalogue): handed through


Verdict = tuple[float, float, bool]  # innovation, its NIS, used


class StepRecord(NamedTuple):
    """What the smoother needs of one step: state (5,) and covariance (5, 5) after it, and how it was predicted."""

    t_ns: int
    x: Matrix
    p: Matrix
    f: Matrix
    q: Matrix


class ThrustFilter:
    """Fuses one engine. `step` per fused instant; the state can be checkpointed and restored."""

    def __init__(self, settings: FusionSettings, engine: int, name: str = "") -> None:
        self._settings = settings
        self._engine = engine
        self._name = name or f"engine[{engine}]"
        self._t_ns = -1
        self._off_s = 0.0
        self._tared = False
        self._mount_heard = False  # and used at the last step
        self._surprised = False  # a measurement was gated out at the last step
        self._faults: list[Fault] = []
        self._mount_gate = Gate(settings.gate_chi2, settings.fail_after_s, settings.recover_after_s)
        self._brochure_gate = Gate(settings.gate_chi2, settings.fail_after_s, settings.recover_after_s)
        self._mount_sigma_n = self._shape_sigma_n = START_ERROR_N
        self._kf = KalmanFilter(dim_x=N_STATE, dim_z=1)
        self._kf.inv = np.reciprocal  # scalar measurements: S is 1 x 1
        self._kf.x = np.zeros((N_STATE, 1))
        sigmas = (START_STD_N, START_RATE_STD_N_S, START_ERROR_N, settings.brochure_bias_std, START_ERROR_N)
        self._kf.P = np.diag(np.square(sigmas))
        self._motion: tuple[Matrix, Matrix] = (np.eye(N_STATE), np.zeros((N_STATE, N_STATE)))

    @property
    def thrust_n(self) -> float:
        return float(self._kf.x[THRUST, 0])

    def record(self) -> StepRecord:
        """The last step, for `smoother.smooth`; the arrays are never changed afterwards."""
        return StepRecord(self._t_ns, self._kf.x.ravel().copy(), self._kf.P, *self._motion)

    def step(self, inputs: FusionInputs) -> Estimate:
        """Predict to `t_ns`, weigh what is there, return the estimate."""
        dt_s = 0.0 if self._t_ns < 0 else max((inputs.t_ns - self._t_ns) * 1e-9, 0.0)
        self._t_ns = inputs.t_ns
        self._predict(min(dt_s, MAX_STEP_S), inputs)
        off = self._engine_off(inputs, dt_s)
        status = self._flags(inputs) | (Status.ENGINE_OFF if off else 0)
        if off:
            self._update(0.0, TARE_H, self._settings.tare_std_n**2, 0.0)
        # the brochure first: a mount that jumps alone then meets a thrust that is held
        brochure = (nan, nan, False) if off else self._brochure(inputs, dt_s)
        mount = self._mount(inputs, dt_s)
        self._surprised = self._is_surprised(mount, brochure)
        self._mount_heard = mount[2]
        status |= self._route_flags(inputs, mount[2], brochure[2], off)
        return self._estimate(inputs, mount, brochure, status)

    def take_faults(self) -> list[Fault]:
        """Faults since the last call: "mount_failed", "mount_recovered", "brochure_...", "tare"."""
        faults, self._faults = self._faults, []
        return faults

    def snapshot(self) -> dict[str, list[float]]:
        """The whole state as plain numbers."""
        return {
            "clock": [float(self._t_ns), self._off_s, float(self._tared)],
            "x": self._kf.x.ravel().tolist(),
            "p": self._kf.P.ravel().tolist(),
            "sigmas": [self._mount_sigma_n, self._shape_sigma_n],
            "mount_gate": self._mount_gate.state(),
            "brochure_gate": self._brochure_gate.state(),
        }

    def restore(self, state: dict[str, list[float]]) -> bool:
        """Take over a snapshot; False (and nothing changed) when it is not a sane one."""
        shapes = {"clock": 3, "x": N_STATE, "p": N_STATE**2, "sigmas": 2, "mount_gate": 3, "brochure_gate": 3}
        if set(state) != set(shapes) or any(len(state[key]) != n for key, n in shapes.items()):
            return False
        if not all(isfinite(value) for row in state.values() for value in row):
            return False
        p = np.array(state["p"]).reshape(N_STATE, N_STATE)
        if not np.linalg.eigvalsh(p).min() > 0.0:
            return False
        self._kf.x, self._kf.P = np.array(state["x"]).reshape(N_STATE, 1), p
        clock = state["clock"]
        self._t_ns, self._off_s, self._tared = int(clock[0]), clock[1], bool(clock[2])
        self._mount_sigma_n, self._shape_sigma_n = state["sigmas"]
        self._mount_gate.load(state["mount_gate"])
        self._brochure_gate.load(state["brochure_gate"])
        return True

    def _predict(self, dt_s: float, inputs: FusionInputs) -> None:
        if dt_s <= 0.0:
            self._motion = (np.eye(N_STATE), np.zeros((N_STATE, N_STATE)))
            return
        s = self._settings
        n1_rate_pct_s = inputs.n1_rate_pct_s if isfinite(inputs.n1_rate_pct_s) else 0.0
        mount_n, shape_n = self._error_sigmas(inputs)
        motion = Motion(
            dt_s=dt_s,
            rate_sigma_n_s=rate_sigma(s, n1_rate_pct_s, self._surprised),
            moving_n_s=max(abs(float(self._kf.x[RATE, 0])), s.throttle_rate_gain_n_per_pct * abs(n1_rate_pct_s)),
            mount_sigma_n=mount_n,
            mount_sigma_before_n=self._mount_sigma_n,
            shape_sigma_n=shape_n,
            shape_sigma_before_n=self._shape_sigma_n,
        )
        self._mount_sigma_n, self._shape_sigma_n = mount_n, shape_n
        self._motion = propagate(s, motion)
        self._kf.predict(F=self._motion[0], Q=self._motion[1])

    def _error_sigmas(self, inputs: FusionInputs) -> tuple[float, float]:
        """Slow errors of (mount, deck's shape) in N; the last known ones where a route is silent."""
        s = self._settings
        mount_n = inputs.mount_std_n if isfinite(inputs.mount_std_n) else self._mount_sigma_n
        if not isfinite(inputs.brochure_std_n):
            return mount_n, self._shape_sigma_n
        biased = s.brochure_bias_std * inputs.brochure_n
        return mount_n, sqrt(max(inputs.brochure_std_n**2 - biased**2, s.brochure_noise_std_n**2))

    def _mount(self, inputs: FusionInputs, dt_s: float) -> Verdict:
        predicted = float(self._kf.x[THRUST, 0] + self._kf.x[MOUNT, 0])
        noise = self._settings.mount_noise_std_n**2
        return self._measure(inputs.mount_n, predicted, MOUNT_H, noise, self._mount_gate, "mount", dt_s)

    def _brochure(self, inputs: FusionInputs, dt_s: float) -> Verdict:
        thrust, bias, shape = (float(self._kf.x[i, 0]) for i in (THRUST, BROCHURE, SHAPE))
        h = np.array([[1.0 + bias, 0.0, 0.0, thrust, 1.0]])
        noise = self._settings.brochure_noise_std_n**2
        # second order: E[T c] = T c + P_Tc, or the product leaks into c step by step
        predicted = thrust * (1.0 + bias) + shape + float(self._kf.P[THRUST, BROCHURE])
        return self._measure(inputs.brochure_n, predicted, h, noise, self._brochure_gate, "brochure", dt_s)

    def _measure(self, z: float, predicted: float, h: Matrix, r: float, gate: Gate, route: str, dt_s: float) -> Verdict:
        """Gate one scalar measurement and use it; -> (innovation, its NIS, used)."""
        if not (isfinite(z) and isfinite(r)):
            return nan, nan, False
        innovation = z - predicted
        variance = float((h @ self._kf.P @ h.T)[0, 0]) + r
        was_failed = gate.failed
        used = gate.judge(innovation, variance, dt_s)
        if gate.failed != was_failed:
            self._report(f"{route}_{'failed' if gate.failed else 'recovered'}")
        if used:
            self._update(z, h, r, predicted)
        return innovation, innovation * innovation / variance, used

    def _is_surprised(self, mount: Verdict, brochure: Verdict) -> bool:
        """A route was gated out, and either it is not yet given up or there is no other to hold the thrust."""
        routes = ((mount, self._mount_gate), (brochure, self._brochure_gate))
        rejected = [gate for verdict, gate in routes if isfinite(verdict[0]) and not verdict[2]]
        alone = not any(verdict[2] for verdict, _ in routes)
        return any(alone or not gate.failed for gate in rejected)

    def _update(self, z: float, h: Matrix, r: float, predicted: float) -> None:
        # z - H x must be the innovation of the nonlinear h(x): shift z by the difference
        shift = float((h @ self._kf.x)[0, 0]) - predicted
        bias, before = self._kf.x[BROCHURE, 0], self._kf.P
        self._kf.update(np.array([[z + shift]]), R=np.array([[r]]), H=h)
        if not self._mount_heard:
            self._consider_bias(bias, before, h, r)

    def _consider_bias(self, bias: float, before: Matrix, h: Matrix, r: float) -> None:
        """Without the mounts nothing tells the deck's bias from thrust: it is considered, not estimated.

        Schmidt-Kalman: the gain of c is zero and P = (I - K H) P' (I - K H)^T + K R K^T with that gain.
        """
        gain = self._kf.K.copy()
        gain[BROCHURE, 0] = 0.0
        self._kf.x[BROCHURE, 0] = bias
        left = np.eye(N_STATE) - gain @ h
        self._kf.P = left @ before @ left.T + r * (gain @ gain.T)

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

    def _flags(self, inputs: FusionInputs) -> int:
        bits = (
            (inputs.mount_extrapolating, Status.MODEL_EXTRAPOLATING),
            (inputs.brochure_extrapolating, Status.DECK_EXTRAPOLATING),
            (inputs.transient, Status.TRANSIENT),
            (inputs.gap, Status.GAP),
            (inputs.one_mount, Status.ONE_MOUNT),
            (inputs.load_factor_stale, Status.LOAD_FACTOR_STALE),
        )
        return inputs.status | sum(int(bit) for on, bit in bits if on)

    def _route_flags(self, inputs: FusionInputs, mount_used: bool, brochure_used: bool, off: bool) -> int:
        mount, brochure = isfinite(inputs.mount_n), isfinite(inputs.brochure_n)
        bits = (
            (not mount, Status.MOUNT_LOST),
            (mount and not mount_used, Status.MOUNT_REJECTED),
            (self._mount_gate.failed, Status.MOUNT_FAILED),
            (not brochure and not off, Status.BROCHURE_LOST),
            (brochure and not brochure_used and not off, Status.BROCHURE_REJECTED),
            (self._brochure_gate.failed, Status.BROCHURE_FAILED),
            (self._kf.P[THRUST, THRUST] > self._settings.converging_std_n**2, Status.CONVERGING),
        )
        return sum(int(bit) for on, bit in bits if on)

    def _estimate(
        self,
        inputs: FusionInputs,
        mount: Verdict,
        brochure: Verdict,
        status: int,
    ) -> Estimate:
        x = self._kf.x
        used = [nis for _, nis, accepted in (mount, brochure) if accepted]
        return Estimate(
            t_ns=inputs.t_ns,
            engine=self._engine,
            thrust_n=float(x[THRUST, 0]),
            thrust_std_n=sqrt(float(self._kf.P[THRUST, THRUST])),
            thrust_rate_n_s=float(x[RATE, 0]),
            mount_n=inputs.mount_n,
            mount_std_n=inputs.mount_std_n,
            brochure_n=inputs.brochure_n,
            brochure_std_n=inputs.brochure_std_n,
            innovation_n=mount[0],
            brochure_innovation_n=brochure[0],
            nis=sum(used) / len(used) if used else nan,
            mount_bias_n=float(x[MOUNT, 0]),
            brochure_bias=float(x[BROCHURE, 0]),
            load_share=inputs.load_share,
            status=int(status),
        )
