"""One sensor on its own: dead, stuck, noisy, a jump that stays, a rate that the aircraft cannot have.

Stepped at 10 Hz. A jump is doubted at once (the sensor is left out) and judged CONFIRM_S later: if the signal stays
where it jumped to, it is an offset; if it came back it was a spike. Noise is the median of |second difference| over
2 s, which one jump cannot lift.
"""

from collections import deque
from itertools import pairwise
from math import isfinite
from statistics import median

from thrustd.fusion.limits import SensorLimits

STEP_S = 0.1
DEAD_S = 1.0
CONFIRM_S = 1.0
NOISE_STEPS = 21
DRIFT_STEPS = 30
CALM_S = 5.0  # free of the symptom this long: believed again
JUMP_MEMORY_STEPS = 30
LEARN_REST_S = 60.0  # watched for this long, a sensor has shown how long it may rest
REST_FACTOR = 4.0
SHORTEST_STUCK_S = 6.0


class SignalWatch:
    """Mutable; `step` returns the kind of fault that is present, or ""."""

    __slots__ = (
        *("kind", "limits", "_values", "_bends", "_seen", "_calm_s", "_missing_s"),
        *("_jump", "_from", "_since_jump_s", "_resting_s", "_longest_s", "_watched_s"),
    )

    def __init__(self, limits: SensorLimits) -> None:
        self.limits = limits
        self.kind = ""
        self._values: deque[float] = deque(maxlen=DRIFT_STEPS + 1)
        self._bends: deque[float] = deque(maxlen=NOISE_STEPS - 2)  # |second differences|
        self._seen = False
        self._missing_s = self._resting_s = self._calm_s = 0.0
        self._watched_s = self._longest_s = 0.0
        self._since_jump_s = 1e9
        self._jump = 0.0  # size of the jump in doubt or confirmed
        self._from = 0.0  # value before it

    @property
    def doubted(self) -> bool:
        """A jump waits for its verdict."""
        return self._jump != 0.0 and self.kind != "offset"

    @property
    def jumped_lately(self) -> bool:
        """Most of the last seconds' change came in one step."""
        v = self._values
        if len(v) < 2:
            return False
        largest = max(abs(b - a) for a, b in pairwise(v))
        return largest >= 0.5 * (max(v) - min(v))

    @property
    def stuck_s(self) -> float:
        """How long this sensor may repeat one value."""
        if self._watched_s < LEARN_REST_S:
            return self.limits.stuck_s
        return min(self.limits.stuck_s, max(REST_FACTOR * self._longest_s, SHORTEST_STUCK_S))

    @property
    def resting_s(self) -> float:
        """How long the same value has been repeated."""
        return self._resting_s

    def change(self, steps: int) -> float:
        """Change over the last `steps` steps; 0 when unknown."""
        if len(self._values) <= steps:
            return 0.0
        return self._values[-1] - self._values[-1 - steps]

    def step(self, value: float, active: bool) -> str:
        """`active`: the signal should be alive now (flying, engine turning)."""
        if not isfinite(value):
            self._missing_s += STEP_S
            self._values.clear()
            self._bends.clear()
            self._jump = 0.0
            return self._set("dead" if self._seen and self._missing_s >= DEAD_S else self.kind)
        self._seen, self._missing_s = True, 0.0
        self._watch_jump(value)
        self._watch_rest(value, active)
        if len(self._values) >= 2:
            self._bends.append(abs(value - 2.0 * self._values[-1] + self._values[-2]))
        self._values.append(value)
        return self._set(self._symptom(value, active))

    def _symptom(self, value: float, active: bool) -> str:
        if active and self._resting_s >= self.stuck_s:
            return "stuck"
        if self._noise() > self.limits.noise:
            return "noisy"
        if self._offset(value):
            return "offset"
        if self._drifts() or not self.limits.low <= value <= self.limits.high:
            return "offset" if self.jumped_lately else "drift"
        return ""

    def _set(self, symptom: str) -> str:
        if symptom:
            self.kind, self._calm_s = symptom, 0.0
        elif self.kind:
            self._calm_s += STEP_S
            if self._calm_s >= CALM_S:
                self.kind = ""
        return self.kind

    def _watch_rest(self, value: float, active: bool) -> None:
        if self._values and value == self._values[-1]:
            self._resting_s += STEP_S
            return
        if active and self.kind != "stuck":
            self._watched_s += STEP_S + self._resting_s
            self._longest_s = max(self._longest_s, self._resting_s)
        self._resting_s = 0.0

    def _watch_jump(self, value: float) -> None:
        self._since_jump_s += STEP_S
        if not self._values:
            return
        step = value - self._values[-1]
        if abs(step) <= self.limits.jump:
            return
        self._since_jump_s = 0.0
        if self._jump == 0.0:
            self._jump, self._from = step, self._values[-1]
        elif self._jump * step < 0 and abs(step) > 0.6 * abs(self._jump):
            self._jump = 0.0  # back where it came from

    def _offset(self, value: float) -> bool:
        if self._jump == 0.0:
            return False
        if self.kind == "offset":
            return True
        if self._since_jump_s < CONFIRM_S:
            return False
        if abs(value - self._from) > 0.5 * abs(self._jump):
            return True
        self._jump = 0.0
        return False

    def _noise(self) -> float:
        return median(self._bends) if len(self._bends) == self._bends.maxlen else 0.0

    def _drifts(self) -> bool:
        if len(self._values) <= DRIFT_STEPS:
            return False
        far = abs(self.change(DRIFT_STEPS)) > self.limits.rate * DRIFT_STEPS * STEP_S
        return far and not self.jumped_lately

    def acquit(self) -> None:
        """The jump in doubt was no fault: others made it too. One that was judged already stays judged."""
        if self.kind != "offset":
            self._jump = 0.0
