"""One engine's thrust from two routes: a Kalman filter on filterpy.

State  x = [T, r, b, e, d], see `dynamics`. Measurements, each a scalar update behind its own gate:

    mount     z = T + b + v              H = [1, 0, 1, 0, 0]
    brochure  z = T + e + d + v          H = [1, 0, 0, 1, 1]
    tare      0 = T + v                  engine off (N1 < 5 %): mount's zero is learnt as b

filterpy takes NaN without a word and is poisoned for good: nothing that is not finite reaches `update`.
"""

from math import exp, isfinite, nan, sqrt
from typing import NamedTuple

import numpy as np
from filterpy.kalman import KalmanFilter

from thrustd.fusion.dynamics import ENGINE, MOUNT, N_STATE, RATE, THRUST, Matrix, Motion, propagate, rate_sigma
from thrustd.fusion.gate import Gate
from thrustd.fusion.settings import FusionSettings
from thrustd.types import Estimate, Fault, Status

START_STD_N = 4000.0  # nothing is known: 0 to take-off thrust
START_RATE_STD_N_S = 100.0
TARE_H = np.array([[1.0, 0.0, 0.0, 0.0, 0.0]])
BROCHURE_H = np.array([[1.0, 0.0, 0.0, 1.0, 1.0]])
MOUNT_H = np.array([[1.0, 0.0, 1.0, 0.0, 0.0]])
MAX_STEP_S = 10.0  # longer silences are predicted as this long: the band is as wide as it gets by then
SCALE_FLOOR_N = 500.0  # relative errors of the brochure are taken of at least this much thrust
SCALE_TAU_S = 1.0
PEAK_RISE_S = 0.5
ABSURD_RATE_PCT_S = 100.0
ABSURD_N = 1e5  # no engine, no mount: not a measurement
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
        self._surprised = False  # a measurement was gated out at the last step
        self._faults: list[Fault] = []
        self._mount_gate = Gate(settings.gate_chi2, settings.fail_after_s, settings.recover_after_s)
        self._brochure_gate = Gate(settings.gate_chi2, settings.fail_after_s, settings.recover_after_s)
        self._mount_sigma_n = self._shape_sigma_n = START_ERROR_N
        self._scale_n = self._scale_before_n = SCALE_FLOOR_N
        self._kf = KalmanFilter(dim_x=N_STATE, dim_z=1)
        self._kf.inv = np.reciprocal  # scalar measurements: S is 1 x 1
        self._kf.x = np.zeros((N_STATE, 1))
        sigmas = (
            START_STD_N,
            START_RATE_STD_N_S,
            START_ERROR_N,
            settings.brochure_bias_std * SCALE_FLOOR_N,
            START_ERROR_N,
        )
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
        inputs = _sane(inputs)
        dt_s = 0.0 if self._t_ns < 0 else max((inputs.t_ns - self._t_ns) * 1e-9, 0.0)
        if self._t_ns < 0:
            self._begin(inputs)
        self._t_ns = inputs.t_ns
        self._predict(min(dt_s, MAX_STEP_S), inputs)
        off = self._engine_off(inputs, dt_s)
        status = self._flags(inputs) | (Status.ENGINE_OFF if off else 0)
        if off:
            self._kf.update(np.array([[0.0]]), R=np.array([[self._settings.tare_std_n**2]]), H=TARE_H)
        # the brochure first: a mount that jumps alone then meets a thrust that is held
        brochure = (nan, nan, False) if off else self._brochure(inputs, dt_s)
        mount = self._mount(inputs, dt_s)
        self._surprised = self._is_surprised(mount, brochure)
        if brochure[2]:
            self._follow_brochure(inputs.brochure_n, dt_s)
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
            "sigmas": [self._mount_sigma_n, self._shape_sigma_n, self._scale_n, self._scale_before_n],
            "mount_gate": self._mount_gate.state(),
            "brochure_gate": self._brochure_gate.state(),
        }

    def restore(self, state: dict[str, list[float]]) -> bool:
        """Take over a snapshot; False (and nothing changed) when it is not a sane one."""
        shapes = {"clock": 3, "x": N_STATE, "p": N_STATE**2, "sigmas": 4, "mount_gate": 3, "brochure_gate": 3}
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
        self._mount_sigma_n, self._shape_sigma_n, self._scale_n, self._scale_before_n = state["sigmas"]
        self._mount_gate.load(state["mount_gate"])
        self._brochure_gate.load(state["brochure_gate"])
        return True

    def _begin(self, inputs: FusionInputs) -> None:
        """The first step: the routes' own sigmas take the place of START_ERROR_N."""
        if isfinite(inputs.mount_std_n):
            self._mount_sigma_n = inputs.mount_std_n
        if isfinite(inputs.brochure_std_n):
            self._shape_sigma_n = self._shape_now_n(inputs)
            self._scale_n = self._scale_before_n = max(abs(inputs.brochure_n), SCALE_FLOOR_N)
        engine_n = self._settings.brochure_bias_std * self._scale_n
        sigmas = (START_STD_N, START_RATE_STD_N_S, self._mount_sigma_n, engine_n, self._shape_sigma_n)
        self._kf.P = np.diag(np.square(sigmas))

    def _predict(self, dt_s: float, inputs: FusionInputs) -> None:
        if dt_s <= 0.0:
            self._motion = (np.eye(N_STATE), np.zeros((N_STATE, N_STATE)))
            return
        s = self._settings
        n1_rate_pct_s = inputs.n1_rate_pct_s if isfinite(inputs.n1_rate_pct_s) else 0.0
        mount_n, shape_n = self._error_sigmas(inputs, dt_s)
        motion = Motion(
            dt_s=dt_s,
            rate_sigma_n_s=rate_sigma(s, n1_rate_pct_s, self._surprised),
            moving_n_s=max(abs(float(self._kf.x[RATE, 0])), s.throttle_rate_gain_n_per_pct * abs(n1_rate_pct_s)),
            mount_sigma_n=mount_n,
            mount_sigma_before_n=self._mount_sigma_n,
            shape_sigma_n=shape_n,
            shape_sigma_before_n=self._shape_sigma_n,
            scale_n=self._scale_n,
            scale_before_n=self._scale_before_n,
        )
        self._mount_sigma_n, self._shape_sigma_n, self._scale_before_n = mount_n, shape_n, self._scale_n
        self._motion = propagate(s, motion)
        self._kf.predict(F=self._motion[0], Q=self._motion[1])

    def _follow_brochure(self, brochure_n: float, dt_s: float) -> None:
        """Moves s of the next step towards an accepted brochure thrust."""
        part = min(dt_s / SCALE_TAU_S, 1.0)
        self._scale_n = max(self._scale_n + part * (abs(brochure_n) - self._scale_n), SCALE_FLOOR_N)

    def _error_sigmas(self, inputs: FusionInputs, dt_s: float) -> tuple[float, float]:
        """Slow errors of (mount, deck's shape) in N; the last known ones where a route is silent."""
        s = self._settings
        mount_n, shape_n = self._mount_sigma_n, self._shape_sigma_n
        if isfinite(inputs.mount_std_n):
            mount_n = _held_peak(mount_n, inputs.mount_std_n, dt_s, s.mount_bias_tau_s)
        if isfinite(inputs.brochure_std_n) and not inputs.transient:
            shape_n = _held_peak(shape_n, self._shape_now_n(inputs), dt_s, s.brochure_shape_tau_s)
        return mount_n, shape_n

    def _shape_now_n(self, inputs: FusionInputs) -> float:
        """What the deck's spread says beyond the engine's own bias."""
        biased = self._settings.brochure_bias_std * inputs.brochure_n
        return sqrt(max(inputs.brochure_std_n**2 - biased**2, self._settings.brochure_noise_std_n**2))

    def _mount(self, inputs: FusionInputs, dt_s: float) -> Verdict:
        noise = self._settings.mount_noise_std_n**2
        return self._measure(inputs.mount_n, MOUNT_H, noise, self._mount_gate, "mount", dt_s)

    def _brochure(self, inputs: FusionInputs, dt_s: float) -> Verdict:
        noise = self._settings.brochure_noise_std_n**2
        if inputs.transient and isfinite(inputs.brochure_std_n):
            # lead and lag of the deck last as long as the throttle moves: noise, not an error that stays
            noise += max(self._shape_now_n(inputs) ** 2 - self._shape_sigma_n**2, 0.0)
        return self._measure(inputs.brochure_n, BROCHURE_H, noise, self._brochure_gate, "brochure", dt_s)

    def _measure(self, z: float, h: Matrix, r: float, gate: Gate, route: str, dt_s: float) -> Verdict:
        """Gate one scalar measurement and use it."""
        if not abs(z) < ABSURD_N:
            return nan, nan, False
        innovation = z - float((h @ self._kf.x)[0, 0])
        variance = float((h @ self._kf.P @ h.T)[0, 0]) + r
        was_failed = gate.failed
        used = gate.judge(innovation, variance, dt_s)
        if gate.failed != was_failed:
            self._report(f"{route}_{'failed' if gate.failed else 'recovered'}")
        if used:
            self._kf.update(np.array([[z]]), R=np.array([[r]]), H=h)
        return innovation, innovation * innovation / variance, used

    def _is_surprised(self, mount: Verdict, brochure: Verdict) -> bool:
        """A route was gated out, and either it is not yet given up or there is no other to hold the thrust."""
        routes = ((mount, self._mount_gate), (brochure, self._brochure_gate))
        rejected = [gate for verdict, gate in routes if isfinite(verdict[0]) and not verdict[2]]
        alone = not any(verdict[2] for verdict, _ in routes)
        return any(alone or not gate.failed for gate in rejected)

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
            brochure_bias=float(x[ENGINE, 0]) / self._scale_n,
            load_share=inputs.load_share,
            status=int(status),
        )


def _held_peak(held: float, now: float, dt_s: float, tau_s: float) -> float:
    """A sigma that rises within half a second and falls as slowly as the error it stands for.

    Every rise adds its variance to the state at once (`dynamics`): a sigma that flickers would pump it up for ever.
    """
    if now > held:
        return held + min(dt_s / PEAK_RISE_S, 1.0) * (now - held)
    return now + (held - now) * exp(-dt_s / tau_s)


def _sane(inputs: FusionInputs) -> FusionInputs:
    """A route whose force or sigma is no number of this world is silent."""
    mount = abs(inputs.mount_n) < ABSURD_N and 0.0 < inputs.mount_std_n < ABSURD_N
    brochure = abs(inputs.brochure_n) < ABSURD_N and 0.0 < inputs.brochure_std_n < ABSURD_N
    rate_known = abs(inputs.n1_rate_pct_s) < ABSURD_RATE_PCT_S
    if mount and brochure and rate_known:
        return inputs
    return inputs._replace(
        mount_n=inputs.mount_n if mount else nan,
        mount_std_n=inputs.mount_std_n if mount else nan,
        brochure_n=inputs.brochure_n if brochure else nan,
        brochure_std_n=inputs.brochure_std_n if brochure else nan,
        n1_rate_pct_s=inputs.n1_rate_pct_s if rate_known else nan,
    )
