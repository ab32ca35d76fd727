"""One engine's thrust from two routes: an extended Kalman filter on filterpy.

State  x = [T, r, b, c]:  thrust [N], thrust rate [N/s], bias of the mount route [N], relative bias of the brochure.

    T' = r                    r' = -r / tau_r + w_r      w_r grows with the throttle's movement
    b' = -b / tau_b + w_b     c' = -c / tau_c + w_c      first-order Gauss-Markov: stays within its sigma

    mount     z = T + b + v          H = [1, 0, 1, 0]
    brochure  z = T (1 + c) + v      H = [1 + c, 0, 0, T]
    tare      0 = T + v              engine off (N1 < 5 %)

Reference: Brown & Hwang, Introduction to Random Signals and Applied Kalman Filtering, ch. 4 and 5. filterpy takes NaN
without a word and is poisoned for good: nothing that is not finite reaches `update` (see `_measure`).
"""

from math import exp, inf, isfinite, nan, sqrt
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from filterpy.kalman import KalmanFilter

from thrustd.fusion.gate import Gate
from thrustd.fusion.settings import FusionSettings
from thrustd.types import Estimate, Fault, Status

THRUST, RATE, MOUNT_BIAS, BROCHURE_BIAS = range(4)
START_STD_N = 4000.0  # nothing is known: 0 to take-off thrust
START_RATE_STD_N_S = 100.0
MAX_STEP_S = 10.0  # longer silences are predicted as this long: the band is as wide as it gets by then

Matrix = npt.NDArray[np.float64]


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


class ThrustFilter:
    """Fuses one engine. `step` per fused instant; the state can be checkpointed and restored."""

    def __init__(self, settings: FusionSettings, engine: int, name: str = "") -> None:
        self._settings = settings
        self._engine = engine
        self._name = name or f"engine[{engine}]"
        self._t_ns = -1
        self._off_s = 0.0
        self._tared = False
        self._faults: list[Fault] = []
        self._mount_gate = Gate(settings.gate_chi2, settings.fail_after_s, settings.recover_after_s)
        self._brochure_gate = Gate(settings.gate_chi2, settings.fail_after_s, settings.recover_after_s)
        self._kf = KalmanFilter(dim_x=4, dim_z=1)
        self._kf.x = np.zeros((4, 1))
        self._kf.P = np.diag(
            [
                START_STD_N**2,
                START_RATE_STD_N_S**2,
                settings.mount_bias_std_n**2,
                settings.brochure_bias_std**2,
            ]
        )

    @property
    def thrust_n(self) -> float:
        return float(self._kf.x[THRUST, 0])

    def step(self, inputs: FusionInputs) -> Estimate:
        """Predict to `t_ns`, weigh what is there, return the estimate."""
        dt_s = 0.0 if self._t_ns < 0 else max((inputs.t_ns - self._t_ns) * 1e-9, 0.0)
        self._t_ns = inputs.t_ns
        self._predict(min(dt_s, MAX_STEP_S), inputs)
        off = self._engine_off(inputs, dt_s)
        status = self._flags(inputs) | (Status.ENGINE_OFF if off else 0)
        if off:
            self._update(0.0, np.array([[1.0, 0.0, 0.0, 0.0]]), self._settings.tare_std_n**2, 0.0)
        mount = self._mount(inputs, dt_s)
        brochure = (nan, nan, False) if off else self._brochure(inputs, dt_s)
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
            "mount_gate": self._mount_gate.state(),
            "brochure_gate": self._brochure_gate.state(),
        }

    def restore(self, state: dict[str, list[float]]) -> bool:
        """Take over a snapshot; False (and nothing changed) when it is not a sane one."""
        shapes = {"clock": 3, "x": 4, "p": 16, "mount_gate": 3, "brochure_gate": 3}
        if set(state) != set(shapes) or any(len(state[key]) != n for key, n in shapes.items()):
            return False
        if not all(isfinite(value) for row in state.values() for value in row):
            return False
        p = np.array(state["p"]).reshape(4, 4)
        if not np.linalg.eigvalsh(p).min() > 0.0:
            return False
        self._kf.x, self._kf.P = np.array(state["x"]).reshape(4, 1), p
        clock = state["clock"]
        self._t_ns, self._off_s, self._tared = int(clock[0]), clock[1], bool(clock[2])
        self._mount_gate.load(state["mount_gate"])
        self._brochure_gate.load(state["brochure_gate"])
        return True

    def _predict(self, dt_s: float, inputs: FusionInputs) -> None:
        if dt_s <= 0.0:
            return
        s = self._settings
        rate = abs(inputs.n1_rate_pct_s) if isfinite(inputs.n1_rate_pct_s) else 0.0
        rate_std = sqrt(s.thrust_rate_std_n_s**2 + (s.throttle_rate_gain_n_per_pct * rate) ** 2)
        self._kf.predict(F=transition(dt_s, s), Q=process_noise(dt_s, s, rate_std))

    def _mount(self, inputs: FusionInputs, dt_s: float) -> tuple[float, float, bool]:
        h = np.array([[1.0, 0.0, 1.0, 0.0]])
        predicted = float(self._kf.x[THRUST, 0] + self._kf.x[MOUNT_BIAS, 0])
        r = self._settings.mount_noise_std_n**2 + max(
            _square(inputs.mount_std_n) - self._settings.mount_bias_std_n**2, 0.0
        )
        return self._measure(inputs.mount_n, predicted, h, r, self._mount_gate, "mount", dt_s)

    def _brochure(self, inputs: FusionInputs, dt_s: float) -> tuple[float, float, bool]:
        s = self._settings
        thrust, bias = float(self._kf.x[THRUST, 0]), float(self._kf.x[BROCHURE_BIAS, 0])
        h = np.array([[1.0 + bias, 0.0, 0.0, thrust]])
        slow = (s.brochure_bias_std * inputs.brochure_n) ** 2
        r = (s.brochure_noise_relative * inputs.brochure_n) ** 2 + max(_square(inputs.brochure_std_n) - slow, 1.0)
        return self._measure(inputs.brochure_n, thrust * (1.0 + bias), h, r, self._brochure_gate, "brochure", dt_s)

    def _measure(
        self, z: float, predicted: float, h: Matrix, r: float, gate: Gate, route: str, dt_s: float
    ) -> tuple[float, float, bool]:
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

    def _update(self, z: float, h: Matrix, r: float, predicted: float) -> None:
        # z - H x must be the innovation of the nonlinear h(x): shift z by the difference
        shift = float((h @ self._kf.x)[0, 0]) - predicted
        self._kf.update(np.array([[z + shift]]), R=np.array([[r]]), H=h)

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
        mount: tuple[float, float, bool],
        brochure: tuple[float, float, bool],
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
            mount_bias_n=float(x[MOUNT_BIAS, 0]),
            brochure_bias=float(x[BROCHURE_BIAS, 0]),
            load_share=inputs.load_share,
            status=int(status),
        )


def transition(dt_s: float, s: FusionSettings) -> Matrix:
    """F = exp(A dt), (4, 4)."""
    a = exp(-dt_s / s.thrust_rate_tau_s)
    f = np.diag([1.0, a, exp(-dt_s / s.mount_bias_tau_s), exp(-dt_s / s.brochure_bias_tau_s)])
    f[THRUST, RATE] = s.thrust_rate_tau_s * (1.0 - a)
    return f


def process_noise(dt_s: float, s: FusionSettings, rate_std_n_s: float) -> Matrix:
    """Q, (4, 4): integrated Gauss-Markov rate (Brown & Hwang, eq. 5.3), and the two Gauss-Markov biases."""
    tau = s.thrust_rate_tau_s
    u = dt_s / tau
    a = exp(-u)
    var = rate_std_n_s**2
    q = np.zeros((4, 4))
    q[RATE, RATE] = var * (1.0 - a * a)
    q[THRUST, RATE] = q[RATE, THRUST] = var * tau * (1.0 - a) ** 2
    # the closed form loses its digits below u = 1e-3: its series is 2/3 u^3
    exact = 2.0 * u - 3.0 + 4.0 * a - a * a
    q[THRUST, THRUST] = var * tau**2 * (exact if u > 1e-3 else 2.0 / 3.0 * u**3)
    q[MOUNT_BIAS, MOUNT_BIAS] = s.mount_bias_std_n**2 * (1.0 - exp(-2.0 * dt_s / s.mount_bias_tau_s))
    q[BROCHURE_BIAS, BROCHURE_BIAS] = s.brochure_bias_std**2 * (1.0 - exp(-2.0 * dt_s / s.brochure_bias_tau_s))
    return q


def _square(value: float) -> float:
    return value * value if isfinite(value) else inf
