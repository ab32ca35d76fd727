"""One mount in flight: its samples through the compiled model, gaps bridged or restarted, its error beside its force.

bridged    up to `bridge_samples` missing: the model steps through them on a straight line of deformation
doubted    up to LONGEST_GAP_S: the same, and the band says by how much the slow modes may be wrong
restarted  longer: the model starts again at rest, with the same doubt
"""

from collections.abc import Sequence
from math import exp, hypot, inf, isfinite, isnan, nan, sqrt
from typing import NamedTuple

import numpy as np

from thrustd.model.artifact import FORCE_RATE_TAU_S, ErrorMap
from thrustd.model.compile import CompiledModel
from thrustd.model.stage import Floats
from thrustd.signals import CATALOGUE, Signal
from thrustd.sync.grid import Grid

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
    """Steps one mount's model over the samples that the grid has gathered. Mutable."""

    def __init__(
        self, model: CompiledModel, bridge_samples: int, grid: Grid, number: int, installation_std_n: float = 0.0
    ):
        """Mount `number` of `grid`. `installation_std_n`: one sigma of what the bench could not show, see
        `fusion.settings`.
        """
        self.model = model
        self._installation_std_n = installation_std_n
        self.signals = model.channels[1:]
        mine = number, slice(len(self.signals))
        self._mount, self._waiting_u, self._waiting_mm = (
            grid.mounts[number],
            grid.waiting_u[number],
            grid.waiting_mm[number],
        )
        self._channels, self._own, self._unmeasured_s = grid.channels[mine], grid.own[mine], grid.unmeasured_s[mine]
        self._channels[:] = [CATALOGUE[name].rest for name in self.signals]
        self._own[:] = [name == "deformation_mm" for name in self.signals]  # hysteresis, damping, ...
        self._unmeasured_s[~self._own] = inf
        self._lagged = self._channels.copy()
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
        self._mount["low_mm"] = max(low_mm - margin_mm, catalogue.low)
        self._mount["high_mm"] = min(high_mm + margin_mm, catalogue.high)
        self._n_doubts = 2 * len(model.spec.linear.real_modes)
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
            self._channels[position], self._unmeasured_s[position] = value, nan
        elif isnan(self._unmeasured_s[position]):
            self._channels[position], self._unmeasured_s[position] = self._lagged[position], 0.0

    def flush(self) -> None:
        """Run the model over the samples that wait."""
        n = int(self._mount["waiting"])
        if n == 0:
            return
        assert self._state is not None
        force_n = self._waiting_mm[:n].copy()
        self.model.run(self._state, self._waiting_u[:n], force_n)
        for mm, part_n in zip(self._waiting_mm[:n].tolist(), force_n.tolist(), strict=True):
            self._sum_mm += mm
            self._sum_n += part_n
        self._count += n
        self._since_restart += n
        self._mount["waiting"] = 0

    def fused(self, dt_s: float) -> MountState:
        """Means since the last call, dt_s ago, and their one sigma."""
        self.flush()
        self._lagged += (1.0 - exp(-dt_s / HELD_TAU_S)) * (self._channels - self._lagged)
        self._unmeasured_s += dt_s
        beyond = bool(self._mount["beyond"])
        self._mount["beyond"] = 0
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
        self.flush()
        if self._state is None:
            return {}
        doubts = [value for doubt in self._restart for value in doubt]
        place = [self._deformation_mm, float(self._mount["sequence"]), float(self._since_restart)]
        return {"state": self._state.tolist(), "place": place, "restart": doubts}

    def restore(self, snapshot: dict[str, list[float]]) -> bool:
        """Take over a snapshot of the same model; False (and nothing changed) when it is not one."""
        if not snapshot:
            return True
        state, place, doubts = (snapshot.get(key, []) for key in ("state", "place", "restart"))
        expected = self.model.start(np.concatenate(([0.0], self._channels))).size
        if len(state) != expected or len(place) != 3 or len(doubts) not in (0, self._n_doubts):
            return False
        if not all(map(isfinite, [*state, *place, *doubts])) or not all(tau_s > 0 for tau_s in doubts[1::2]):
            return False
        self._state = np.array(state)
        self._mount["deformation_mm"], self._mount["sequence"] = place[0], int(place[1])
        self._since_restart = int(place[2])
        self._restart = tuple(zip(doubts[::2], doubts[1::2], strict=True))
        return True

    def resume(self, last: int, shift: int) -> None:
        """After `restore`: the ADC's last sample instant before the restart counts as `last` + `shift` from now on."""
        self._resuming = last - int(self._mount["sequence"]) <= self._bridge_samples
        self._mount["sequence"] += shift

    def catch_up(self, sequence: int, deformation_mm: float) -> None:
        """Bring the state to just before sample `sequence`: started, restarted, or stepped through the gap."""
        self.flush()
        self._channels[self._own] = deformation_mm
        missing = max(sequence - int(self._mount["sequence"]) - 1, 0)
        if self._state is None or (missing > self._longest_samples and not self._resuming):
            self._start(deformation_mm)
        elif missing > 0:
            before = self._state.copy()
            self._bridge(missing, deformation_mm)
            if missing > self._bridge_samples:
                self._doubt(before)
            self._since_restart += missing
        self._mount["sequence"], self._mount["watchful"] = sequence - 1, 0
        self._resuming = False

    @property
    def _deformation_mm(self) -> float:
        return float(self._mount["deformation_mm"])

    def _start(self, deformation_mm: float) -> None:
        state = self.model.start(np.concatenate(([deformation_mm], self._channels)))
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
        between_mm: Floats = self._deformation_mm + np.arange(1.0, missing + 1.0) * slope
        channels = np.tile(self._channels, (missing, 1))
        channels[:, self._own] = between_mm[:, None]
        self.model.run(self._state, channels, between_mm)
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
        return sqrt(variance + sum(part_n * part_n for part_n in self._unmeasured()))

    def _unmeasured(self) -> list[float]:
        """What channels that are not measured may do to the force, one sigma each."""
        assert self._state is not None
        parts = []
        for position in np.flatnonzero(~np.isnan(self._unmeasured_s)).tolist():
            spread = unmeasured_std(CATALOGUE[self.signals[position]], self._unmeasured_s.item(position))
            held = self._channels.copy()
            held[self._own] = self._deformation_mm
            moved = held.copy()
            moved[position] += spread
            there = self.model.step(self._state.copy(), moved, self._deformation_mm)
            here = self.model.step(self._state.copy(), held, self._deformation_mm)
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
