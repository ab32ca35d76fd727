"""One mount in flight: its samples through the compiled model, gaps bridged or restarted, its error beside its force.

bridged    up to `bridge_samples` missing: the model steps through them on a straight line of deformation
doubted    up to LONGEST_GAP_S: the same, and the band says by how much the slow modes may be wrong
restarted  longer: the model starts again at rest, with the same doubt
"""

from collections.abc import Sequence
from math import exp, hypot, inf, isfinite, nan, sqrt
from typing import NamedTuple

import numpy as np

from thrustd.model.artifact import FORCE_RATE_TAU_S, ErrorMap
from thrustd.model.compile import CompiledModel
from thrustd.model.stage import Floats
from thrustd.signals import CATALOGUE, Signal

THESIS_STD_N = 56.0  # HW-PWL on validation data (thesis table 14.1): for an artifact without an error map
EXTRAPOLATION_STD = 0.2  # outside the identified range the local stiffness is trusted to 20 %
BEYOND = 0.5  # of the identified range on either side of it: no load of this engine brings the mount there
HELD_TAU_S = 1.0
LONGEST_GAP_S = 10.0  # what the mount was like before is better than rest; stepped through in 0.1 s at 1 kHz


class MountState(NamedTuple):
    """One mount at one fused step, means over the samples since the last; NaN = no sample."""

    deformation_mm: float
    force_n: float
    std_n: float
    extrapolating: bool
    gap: bool


class MountRoute:
    """Steps one mount's model sample by sample. Mutable."""

    def __init__(self, model: CompiledModel, bridge_samples: int, installation_std_n: float = 0.0) -> None:
        """`installation_std_n`: one sigma of what the bench could not show, see `fusion.settings`."""
        self.model = model
        self._installation_std_n = installation_std_n
        self.signals = model.channels[1:]
        self.channels = np.array([CATALOGUE[name].rest for name in self.signals], float)
        self._lagged = self.channels.copy()
        self._own = [i for i, name in enumerate(self.signals) if name == "deformation_mm"]  # hysteresis, damping, ...
        self._unknown = {i: inf for i in range(len(self.signals)) if i not in self._own}  # not measured: how long, s
        valid = model.spec.valid
        self._stiffness_n_mm = (valid.force_n[1] - valid.force_n[0]) / (
            valid.deformation_mm[1] - valid.deformation_mm[0]
        )
        self._state: Floats | None = None
        self._bridge_samples = bridge_samples
        self._longest_samples = max(bridge_samples, round(LONGEST_GAP_S * model.rate_hz))
        self._period_s = 1.0 / model.rate_hz
        low_mm, high_mm = valid.deformation_mm
        margin_mm, catalogue = BEYOND * (high_mm - low_mm), CATALOGUE["deformation_mm"]
        self._low_mm = max(low_mm - margin_mm, catalogue.low)
        self._high_mm = min(high_mm + margin_mm, catalogue.high)
        self._beyond = False  # a sample was since the last call
        self._n_doubts = 2 * len(model.spec.linear.real_modes)
        self._sequence = -1
        self._deformation_mm = nan
        self._sum_mm = self._sum_n = 0.0
        self._count = 0
        self._gap = False
        self._restart: tuple[tuple[float, float], ...] = ()
        self._since_restart = 0  # samples
        self._lagged_n = nan
        self._resuming = False  # state taken over from before a restart: the whole pause is stepped through

    def set_channel(self, position: int, value: float) -> None:
        """A new value of `signals[position]`; NaN = not measured any more.

        It is held where it was lately: a second's mean, because what made somebody stop believing it came at once.
        """
        if isfinite(value):
            self.channels[position] = value
            self._unknown.pop(position, None)
        elif position not in self._unknown:
            self.channels[position] = self._lagged[position]
            self._unknown[position] = 0.0

    def take(self, sequence: int, deformation_mm: float) -> None:
        """One good sample of deformation; `sequence` counts sample instants, missing ones included."""
        for position in self._own:
            self.channels[position] = deformation_mm
        if sequence != self._sequence + 1 or self._state is None:
            self._catch_up(sequence, deformation_mm)
        self._sequence, self._deformation_mm = sequence, deformation_mm
        self._resuming = False
        assert self._state is not None
        self._sum_mm += deformation_mm
        self._sum_n += self.model.step(self._state, self.channels, deformation_mm)
        self._count += 1
        self._since_restart += 1

    def believable(self, deformation_mm: float) -> bool:
        """Within what this mount can be brought to; what is not is not taken, and the model counts as left."""
        if self._low_mm <= deformation_mm <= self._high_mm:
            return True
        self._beyond = True
        return False

    def fused(self, dt_s: float) -> MountState:
        """Means since the last call, dt_s ago, and their one sigma."""
        self._lagged += (1.0 - exp(-dt_s / HELD_TAU_S)) * (self.channels - self._lagged)
        for position in self._unknown:
            self._unknown[position] += dt_s
        beyond, self._beyond = self._beyond, False
        if self._count == 0:
            self._lagged_n = nan
            return MountState(nan, nan, nan, beyond, self._take_gap())
        deformation_mm, force_n = self._sum_mm / self._count, self._sum_n / self._count
        self._sum_mm = self._sum_n = 0.0
        self._count = 0
        if not isfinite(self._lagged_n):
            self._lagged_n = force_n
        self._lagged_n += (1.0 - exp(-dt_s / FORCE_RATE_TAU_S)) * (force_n - self._lagged_n)
        rate_n_s = (force_n - self._lagged_n) / FORCE_RATE_TAU_S
        excess_mm = self._outside(deformation_mm)
        std_n = self._std(force_n, abs(rate_n_s), excess_mm)
        return MountState(deformation_mm, force_n, std_n, excess_mm > 0 or beyond, self._take_gap())

    def snapshot(self) -> dict[str, list[float]]:
        """Everything a warm restart needs, as plain numbers; empty before the first sample."""
        if self._state is None:
            return {}
        doubts = [value for doubt in self._restart for value in doubt]
        place = [self._deformation_mm, float(self._sequence), float(self._since_restart)]
        return {"state": self._state.tolist(), "place": place, "restart": doubts}

    def restore(self, snapshot: dict[str, list[float]]) -> bool:
        """Take over a snapshot of the same model; False (and nothing changed) when it is not one."""
        if not snapshot:
            return True
        state, place, doubts = (snapshot.get(key, []) for key in ("state", "place", "restart"))
        expected = self.model.start(np.concatenate(([0.0], self.channels))).size
        if len(state) != expected or len(place) != 3 or len(doubts) not in (0, self._n_doubts):
            return False
        if not all(map(isfinite, [*state, *place, *doubts])) or not all(tau_s > 0 for tau_s in doubts[1::2]):
            return False
        self._state = np.array(state)
        self._deformation_mm, self._sequence, self._since_restart = place[0], int(place[1]), int(place[2])
        self._restart = tuple(zip(doubts[::2], doubts[1::2], strict=True))
        return True

    def resume(self, last: int, shift: int) -> None:
        """After `restore`: the ADC's last sample instant before the restart counts as `last` + `shift` from now on."""
        self._resuming = last - self._sequence <= self._bridge_samples
        self._sequence += shift

    def _catch_up(self, sequence: int, deformation_mm: float) -> None:
        """Bring the state to just before sample `sequence`: started, restarted, or stepped through the gap."""
        missing = max(sequence - self._sequence - 1, 0)
        if self._state is None or (missing > self._longest_samples and not self._resuming):
            self._start(deformation_mm)
        elif missing > 0:
            before = self._state.copy()
            self._bridge(missing, deformation_mm)
            if missing > self._bridge_samples:
                self._doubt(before)
            self._since_restart += missing

    def _start(self, deformation_mm: float) -> None:
        state = self.model.start(np.concatenate(([deformation_mm], self.channels)))
        before = np.zeros_like(state) if self._state is None else self._state
        self._gap = self._state is not None
        self._state = state
        self._doubt(before)

    def _doubt(self, before: Floats) -> None:
        """The slow modes are somewhere between the states before and after what was not seen: the band says so."""
        assert self._state is not None
        new = self.model.restart_uncertainty(before, self._state)
        age_s = self._since_restart * self._period_s
        old = [std_n * exp(-age_s / tau_s) for std_n, tau_s in self._restart] or [0.0] * len(new)
        self._restart = tuple((hypot(std_n, was), tau_s) for (std_n, tau_s), was in zip(new, old, strict=True))
        self._since_restart = 0

    def _bridge(self, missing: int, deformation_mm: float) -> None:
        assert self._state is not None
        slope = (deformation_mm - self._deformation_mm) / (missing + 1)
        channels = self.channels.copy()
        for i in range(1, missing + 1):
            between_mm = self._deformation_mm + i * slope
            channels[self._own] = between_mm
            self.model.step(self._state, channels, between_mm)
        self._gap = True

    def _take_gap(self) -> bool:
        gap, self._gap = self._gap, False
        return gap

    def _outside(self, deformation_mm: float) -> float:
        low, high = self.model.spec.valid.deformation_mm
        return max(low - deformation_mm, deformation_mm - high, 0.0)

    def _std(self, force_n: float, rate_n_s: float, excess_mm: float) -> float:
        variance = region_std(self.model.spec.error, force_n, rate_n_s) ** 2 + self._installation_std_n**2
        variance += (EXTRAPOLATION_STD * self._stiffness_n_mm * excess_mm) ** 2
        age_s = self._since_restart * self._period_s
        for std_n, tau_s in self._restart:
            variance += (std_n * exp(-age_s / tau_s)) ** 2
        if self._unknown:
            variance += sum(part_n * part_n for part_n in self._unmeasured())
        return sqrt(variance)

    def _unmeasured(self) -> list[float]:
        """What channels that are not measured may do to the force, one sigma each."""
        assert self._state is not None
        parts = []
        for position, age_s in self._unknown.items():
            spread = unmeasured_std(CATALOGUE[self.signals[position]], age_s)
            moved = self.channels.copy()
            moved[position] += spread
            there = self.model.step(self._state.copy(), moved, self._deformation_mm)
            here = self.model.step(self._state.copy(), self.channels, self._deformation_mm)
            parts.append(abs(there - here))
        return parts


def unmeasured_std(signal: Signal, age_s: float) -> float:
    """One sigma of a signal that was last seen `age_s` ago and is held; infinity = never seen, it is at rest.

    A Gauss-Markov signal of spread s moves by  s sqrt(2 (1 - e^(-age / memory)))  (Gelb, Applied Optimal Estimation).
    """
    return signal.spread if age_s == inf else signal.spread * sqrt(2.0 * (1.0 - exp(-age_s / signal.memory_s)))


def region_std(error: ErrorMap | None, force_n: float, rate_n_s: float) -> float:
    """One sigma of a model in the region of force and |force rate|."""
    if error is None:
        return THESIS_STD_N
    row = _cell(error.force_edges_n, force_n)
    return error.std_n[row][_cell(error.rate_edges_n_s, rate_n_s)]


def _cell(edges: Sequence[float], value: float) -> int:
    cell = 0
    for edge in edges[1:-1]:
        if value >= edge:
            cell += 1
    return cell
