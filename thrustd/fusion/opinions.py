"""Five opinions on one engine's thrust check each other: two mounts, fuel flow, N1 and N2.

    consensus  c   = median of (o_i - b_i s),          s = max(|c|, 2500 N)
    deviation  d_i = (o_i - c) / s - b_i               b_i = what opinion i usually deviates by (slow average)

One opinion that stands alone outside its tolerance for a second, twice as far out as any other, is the faulty one:
the median of the others cannot be pulled by it. Tolerances open with the throttle, because fuel flow leads and spools
lag the thrust. When several opinions deviate at once the cause is something they share (air data, accelerations): see
`common_mode`.
"""

from math import isfinite, nan
from statistics import median

from thrustd.fusion.signal_watch import STEP_S

UPPER, LOWER, FUEL_FLOW, N1, N2 = range(5)
TOLERANCE = (0.14, 0.14, 0.15, 0.14, 0.16)  # of the scale, steady: usual deviations change by 8 % with the throttle
LAG_S = (0.4, 0.4, 8.0, 1.5, 2.5)  # tolerance per relative thrust rate
SCALE_FLOOR_N = 2500.0
RATE_MEMORY_S = 8.0
C_PART = 0.2  # per step, of the consensus' low pass
ALONE_S = 1.0
ALONE_FACTOR = 2.0
AGREE_S = 10.0
LEARN_S = 20.0  # quick averages first
SLOW_S = 120.0
CALM_RATE = 0.02  # relative thrust rate below which the usual deviations are learnt, 1/s


class Opinions:
    """Mutable memory of one engine."""

    def __init__(self) -> None:
        self.usual = [0.0] * 5
        self.age_s = [0.0] * 5
        self.deviation = [nan] * 5
        self.faulty = [False] * 5
        self._outside_s = [0.0] * 5
        self._agree_s = [0.0] * 5
        self._last_c = nan
        self._rate = 0.0  # recent largest |dc/dt| / s

    def step(self, opinions_n: tuple[float, ...], believed: list[bool], frozen: bool) -> None:
        """`believed`: not excluded by the sensor's own watch; `frozen`: shared inputs are in doubt, judge nothing."""
        usable = [i for i in range(5) if believed[i] and not self.faulty[i] and isfinite(opinions_n[i])]
        if len(usable) < 3:
            self._last_c = nan
            self.deviation = [nan] * 5
            return
        rough = median(opinions_n[i] for i in usable)
        scale = max(abs(rough), SCALE_FLOOR_N)
        c = median(opinions_n[i] - self.usual[i] * scale for i in usable)
        self._track_rate(c, scale)
        self.deviation = [(opinions_n[i] - c) / scale - self.usual[i] for i in range(5)]
        if frozen:
            self._outside_s = [0.0] * 5
            return
        outside = [self._is_outside(i, believed[i]) for i in range(5)]
        self._judge(outside)
        if not any(outside) and self._rate < CALM_RATE:
            self._learn(usable)

    def tolerance(self, i: int) -> float:
        young = 0.25 if self.age_s[i] < LEARN_S else 0.0
        return TOLERANCE[i] + young + LAG_S[i] * self._rate

    def _is_outside(self, i: int, believed: bool) -> bool:
        return believed and isfinite(self.deviation[i]) and abs(self.deviation[i]) > self.tolerance(i)

    def _track_rate(self, c: float, scale: float) -> None:
        if not isfinite(self._last_c):
            self._last_c = c
        moved_n = C_PART * (c - self._last_c)  # low-passed: sensor noise is no throttle movement
        self._last_c += moved_n
        rate = abs(moved_n) / STEP_S / scale
        # one step of noise is not a throttle movement: rise over a few steps, fall slowly
        if rate > self._rate:
            self._rate += 0.3 * (rate - self._rate)
        else:
            self._rate -= self._rate * STEP_S / RATE_MEMORY_S

    def _judge(self, outside: list[bool]) -> None:
        alone = self._alone([i for i in range(5) if outside[i] and not self.faulty[i]])
        for i in range(5):
            self._outside_s[i] = self._outside_s[i] + STEP_S if i == alone else 0.0
            if self.faulty[i]:
                self._agree_s[i] = 0.0 if outside[i] or not isfinite(self.deviation[i]) else self._agree_s[i] + STEP_S
                if self._agree_s[i] >= AGREE_S:
                    self.faulty[i], self._agree_s[i] = False, 0.0
            elif self._outside_s[i] >= ALONE_S - 1e-9:
                self.faulty[i], self._agree_s[i] = True, 0.0

    def _alone(self, suspects: list[int]) -> int:
        if len(suspects) != 1:
            return -1
        sizes = [abs(d) if isfinite(d) and not self.faulty[i] else 0.0 for i, d in enumerate(self.deviation)]
        largest = sizes.pop(suspects[0])
        return suspects[0] if largest > ALONE_FACTOR * max(sizes) else -1

    def _learn(self, usable: list[int]) -> None:
        # at idle the deviations are zeros of transducers and the foot of the deck: they say little of other powers
        step_s = STEP_S * min(abs(self._last_c) / SCALE_FLOOR_N, 1.0) ** 2
        for i in usable:
            self.age_s[i] += step_s
            tau_s = min(max(self.age_s[i], 2.0), SLOW_S)
            self.usual[i] += step_s / tau_s * self.deviation[i]
