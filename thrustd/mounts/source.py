"""One mount in flight: its samples through the compiled model, gaps bridged or restarted, its error beside its force.

bridged    up to `bridge_samples` missing: the model steps through them on a straight line
doubted    up to LONGEST_GAP_S: the same, and the band says how wrong the slow modes may be
restarted  longer, and the first sample of all: see `mounts.start`
zero       before the engine runs for the first time: what its transducer shows is taken off its samples
"""

from math import hypot, inf, isfinite, isnan, nan, sqrt

import numpy as np

from thrustd.core.calibration import MountCalibration
from thrustd.core.columns import Floats
from thrustd.core.signals import CATALOGUE
from thrustd.fusion.settings import FusionSettings
from thrustd.model.artifact import FORCE_RATE_TAU_S
from thrustd.model.compile import CompiledModel
from thrustd.model.region_error import cells, region_std_n
from thrustd.mounts.start import CRUISE, LOAD_AGE_S, Past, Unseen, chords, resting_n, unmeasured_std, zero_of
from thrustd.mounts.step import EXTRAPOLATION_STD, IN_SHEAR_STD, MEANS, TERMS, Cells, Held, Samples, add, fuse, terms_n
from thrustd.sync.grid import Grid

BEYOND = 0.5  # of the identified range on either side of it: no load of this engine brings the mount there
COMMON = "start_n"  # of `core.types.Terms`: the one that both mounts of an engine have to the same side
ZERO_SIGMAS = 3.0  # more is no zero
HEARD_S, JUST_S = 1.0, 2.0  # a bus has said all once; found so lately: what is known by now was known then
LEAST_SHARE = 0.2  # of one of two mounts
LONGEST_GAP_S = 10.0  # what the mount was like before is better than rest; stepped through in 0.1 s at 1 kHz
NO_STATE = np.zeros(0)  # before the first sample
NOTHING_MEASURED = MountCalibration()


class MountSource:
    """Steps one mount's model over the samples that the grid has gathered. Mutable."""

    def __init__(
        self,
        model: CompiledModel,
        bridge_samples: int,
        grid: Grid,
        number: int,
        settings: FusionSettings,
        measured: MountCalibration = NOTHING_MEASURED,
    ) -> None:
        """Mount `number` of `grid`; `measured`: what is known of it in this aircraft."""
        self.model = model
        self.signals = model.channels[1:]
        mine = number, slice(len(self.signals))
        self._mount, self._row = grid.mounts[number], grid.mounts[number : number + 1]
        self._channels, self._own, self._unmeasured_s = grid.channels[mine], grid.own[mine], grid.unmeasured_s[mine]
        self._channels[:] = [CATALOGUE[name].rest for name in self.signals]
        self._own[:] = [name == "deformation_mm" for name in self.signals]  # hysteresis, damping, ...
        self._unmeasured_s[~self._own] = inf
        self._never = ~self._own  # heard of yet
        self._lagged = np.stack([self._channels] * 2)  # and what they were one fused step ago
        self._state: Floats | None = None
        self._found = False  # under a load of which nothing at all was known
        self._fell_from: float | None = None  # see `Unseen.start`
        self._longest_samples = max(bridge_samples, round(LONGEST_GAP_S * model.rate_hz))
        self._bridge_samples, self._period_s = bridge_samples, 1.0 / model.rate_hz
        low_mm, high_mm = model.spec.valid.deformation_mm
        margin_mm, catalogue = BEYOND * (high_mm - low_mm), CATALOGUE["deformation_mm"]
        self._mount["low_mm"] = max(low_mm - margin_mm, catalogue.low)
        self._mount["high_mm"] = min(high_mm + margin_mm, catalogue.high)
        self._means, self._zero_mm, self._engine_off_std_n = np.zeros(1, MEANS), 0.0, settings.engine_off_std_n
        self._begin_means(settings, measured)
        waiting_u, waiting_mm = grid.waiting_u[number], grid.waiting_mm[number]
        self.state, said = grid.states[number], grid.states[number : number + 1]  # at the last fused step
        self._samples = Samples(self._row, self._means, waiting_u, waiting_mm, np.empty_like(waiting_mm), model.chain)
        self._held = Held(self._channels, self._lagged, self._unmeasured_s)
        self._unseen = Unseen(model)
        self._cells, self._said = Cells(*cells(model.spec.error)), said
        self._resuming = False  # state taken over from before a restart: the whole pause is stepped through

    def _begin_means(self, settings: FusionSettings, measured: MountCalibration) -> None:
        """What the band is made of before the first sample."""
        means = self._means
        means["lagged_n"], means["period_s"] = nan, self._period_s
        means["stiffness_std"] = measured.gain_std or settings.mount_stiffness_std
        self._under_load = measured.gain_std is not None  # a tethered run has found its zero
        self._shift(measured.zero_mm, measured.zero_std_mm or settings.mount_zero_std_mm)
        means["friction_std_n"] = settings.mount_friction_std_n
        means["low_mm"], means["high_mm"] = low_mm, high_mm = self.model.spec.valid.deformation_mm
        means["below_std"] = (measured.beyond_std or IN_SHEAR_STD) if self.model.spec.pressed_mm else EXTRAPOLATION_STD
        run_mm = min(max(low_mm, 0.0), high_mm) if self._under_load else 0.0  # by a run through its range
        means["told_mm"] = run_mm if measured.told_mm is None else measured.told_mm
        means["stiffness_n_mm"] = chords(self.model, self._inputs)[1]

    def set_channel(self, position: int, value: float) -> None:
        """A new value of `signals[position]`; NaN = not measured any more.

        It is held where it was lately: a second's mean that leaves out the last fused step, because what made somebody
        stop trusting it came at once.
        """
        if isfinite(value):
            self._channels[position], self._unmeasured_s[position] = value, nan
        elif isnan(self._unmeasured_s[position]):
            self._channels[position], self._unmeasured_s[position] = self._lagged[0, position], 0.0

    def rests_at_n(self, deformation_mm: float) -> float:
        """Thrust share that the model says of a mount at rest, with the channels as they are."""
        return resting_n(self.model, self._inputs(deformation_mm))

    def flush(self) -> None:
        """Run the model over the samples that wait."""
        add(self._samples, self._present())

    def fuse(self, dt_s: float) -> None:
        """`state` of now: means since the last call, dt_s ago, and their one sigma."""
        self._hear_first()
        doubts = self._unseen.doubts
        complete = fuse(dt_s, self._samples, self._present(), self._held, doubts, self._cells, self._said)
        if not complete:
            self._doubt(*self._unmeasured())
        if self._unseen.branched and isfinite(deformation_mm := self.state["deformation_mm"].item()):
            self._doubt(self._unseen.friction_std_n(self._inputs(deformation_mm)))

    def terms_n(self) -> dict[str, float]:
        """What `state` may be wrong by, term by term, one sigma each, N; their squares add up to its `std_n`."""
        means, state = self._means[0], self.state
        force_n, rate_n_s = float(state["force_n"]), abs(float(state["force_n"] - means["lagged_n"])) / FORCE_RATE_TAU_S
        model_n = region_std_n(*self._cells, force_n, rate_n_s)
        known = dict(zip(TERMS, terms_n(means, model_n, float(state["deformation_mm"]), force_n), strict=True))
        return known | {COMMON: float(state["common_n"])}

    def calibrate(self) -> bool:
        """The engine stands and has not run: what the mount's transducer shows is its zero.

        As good a measurement of it as the model is without a load; what it says is taken off every sample from now on:
        g = P / (P + R),   zero += g shown,   P <- (1 - g) P     (scalar Kalman filter)
        Far more than a zero may be what the friction holds since the last flight, and nothing tells which: it is not
        taken and stays in the band. -> whether it was taken. A zero that was found under load is none of that: what is
        shown beyond it is what the friction holds.
        """
        shown_n = float(self._means["lagged_n"][0])
        if self._state is None or not isfinite(shown_n):
            return False
        k_n_mm = self._means["stiffness_n_mm"].item(0)
        row = self._inputs(self._deformation_mm)
        if self._unseen.branched:  # it began between two branches: what a mount at rest would have shown
            shown_n += resting_n(self.model, row) - self.model.step(self._state.copy(), row[1:], row.item(0))
        shown_mm = zero_of(self.model, self._inputs, self._deformation_mm, shown_n)
        if self._under_load and isfinite(shown_mm):
            self.rest()
            return True
        if not k_n_mm > 0.0:  # a curve that is flat at rest says nothing of a zero
            return False
        model_n, half_n = cells(self.model.spec.error)[2].item(0), self._engine_off_std_n / 2.0  # two mounts carry it
        known_mm = hypot(model_n, half_n) / k_n_mm
        std_mm = self._means["zero_std_mm"].item(0)
        plausible = abs(shown_mm) <= ZERO_SIGMAS * hypot(std_mm, known_mm)
        if plausible:
            gain = std_mm**2 / (std_mm**2 + known_mm**2)
            self._shift(self._zero_mm + gain * shown_mm, sqrt(1.0 - gain) * std_mm)
            self._mount["deformation_mm"] -= gain * shown_mm
        else:
            self._means["zero_std_mm"] = hypot(std_mm, shown_mm if isfinite(shown_mm) else self._deformation_mm)
            if shown_mm > 0.0:  # NaN, a deformation that is no zero at all, is not
                self._fell_from = 0.0
        self._begin_anew(rested=self._fell_from is None)
        return plausible

    def _hear_first(self) -> None:
        """A signal that speaks for the first time has not jumped from its resting value (500 N): it was as it is."""
        heard = np.flatnonzero(self._never & np.isnan(self._unmeasured_s))
        self._never[heard] = False
        if len(heard) and self._state is not None and self._since_restart_s() < HEARD_S:
            self._samples.u[:, heard] = self._lagged[:, heard] = self._channels[heard]
            self._begin_anew(rested=False)

    def hear_again(self) -> None:
        """Its transducer says something again: what it said meanwhile has moved the model and not the mount."""
        if self._state is not None:
            self._begin_anew(rested=False)

    def rest(self) -> None:
        """Its engine is off and nothing is left of an earlier load: begin anew from there."""
        if self._state is not None:
            self._begin_anew(rested=True)

    def snapshot(self) -> dict[str, list[float]]:
        """Everything a warm restart needs, as plain numbers; empty before the first sample."""
        self.flush()
        if self._state is None:
            return {}
        place = [self._deformation_mm, float(self._mount["sequence"]), float(self._means["since_restart"][0])]
        zero = [self._zero_mm, float(self._means["zero_std_mm"][0])]
        return {"state": self._state.tolist(), "place": place, "zero": zero, **self._unseen.snapshot()}

    def restore(self, snapshot: dict[str, list[float]]) -> bool:
        """Take over a snapshot of the same model; False (and nothing changed) when it is not one."""
        if not snapshot:
            return True
        keys = "state", "place", "zero", "doubts", "branches"
        state, place, zero, doubts, branches = (snapshot.get(key, []) for key in keys)
        size = self.model.start(self._inputs(0.0)).size
        if (len(state), len(place), len(zero)) != (size, 3, 2) or not all(map(isfinite, [*state, *place, *zero])):
            return False
        if not self._unseen.restore(doubts, branches, size):
            return False
        self._state = np.array(state)
        self._shift(*zero)
        self._mount["deformation_mm"], self._mount["sequence"] = place[0], int(place[1])
        self._means["since_restart"] = int(place[2])
        return True

    def resume(self, last: int, shift: int) -> None:
        """After `restore`: the ADC's last sample instant before the restart counts as `last` + `shift` from now on."""
        self._resuming = last - int(self._mount["sequence"]) <= self._bridge_samples
        self._mount["sequence"] += shift

    def fly(self) -> None:
        """The aircraft flies: a mount that was found at idle just now has carried more."""
        self._fell_from = CRUISE
        if self._found and self._since_restart_s() < JUST_S:
            self._state = None
            self._start(self._deformation_mm, 0)

    def catch_up(self, sequence: int, deformation_mm: float) -> None:
        """Bring the state to just before sample `sequence`: started, restarted, or stepped through the gap."""
        self.flush()
        self._channels[self._own] = deformation_mm
        missing = max(sequence - int(self._mount["sequence"]) - 1, 0)
        self._means["since_restart"] += missing
        if self._state is None or (missing > self._longest_samples and not self._resuming):
            self._start(deformation_mm, missing)
        elif missing > 0:
            before = self._state.copy()
            self._bridge(missing, deformation_mm)
            if missing > self._bridge_samples:
                self._unseen.doubt(before, self._state, 0.5 * missing * self._period_s, self._since_restart_s())
                self._means["since_restart"], self._found = 0, False
        self._mount["sequence"], self._mount["watchful"] = sequence - 1, 0
        self._resuming = False

    def _shift(self, zero_mm: float, std_mm: float) -> None:
        """Take another zero off the samples from now on."""
        self._mount["offset_mm"] -= zero_mm - self._zero_mm
        self._zero_mm, self._means["zero_std_mm"] = zero_mm, std_mm

    def _doubt(self, *stds_n: float) -> None:
        """`state` may be wrong by these, too, and the other mount as well."""
        self.state["std_n"] = hypot(self.state["std_n"], *stds_n)
        self.state["common_n"] = hypot(self.state["common_n"], *stds_n)

    def _begin_anew(self, rested: bool) -> None:
        self._state, self._means["lagged_n"] = None, nan
        self._start(self._deformation_mm, 0, rested=rested)

    def _present(self) -> Floats:
        return NO_STATE if self._state is None else self._state

    @property
    def _deformation_mm(self) -> float:
        return float(self._mount["deformation_mm"])

    def _start(self, deformation_mm: float, missing: int, rested: bool = False) -> None:
        before, self._means["gap"] = self._state, self._state is not None
        age_s = LOAD_AGE_S if before is None else min(0.5 * missing * self._period_s, LOAD_AGE_S)
        past = Past(before, age_s, self._since_restart_s(), self._fell_from, rested, rested and self._under_load)
        self._state = self._unseen.start(self._inputs, deformation_mm, past)
        self._means["since_restart"], self._found = 0, before is None

    def _since_restart_s(self) -> float:
        return int(self._means["since_restart"][0]) * self._period_s

    def _inputs(self, deformation_mm: float) -> Floats:
        """A row of the model's inputs with the channels as they are now."""
        return np.concatenate(([deformation_mm], np.where(self._own, deformation_mm, self._channels)))

    def _bridge(self, missing: int, deformation_mm: float) -> None:
        assert self._state is not None
        slope = (deformation_mm - self._deformation_mm) / (missing + 1)
        between_mm: Floats = self._deformation_mm + np.arange(1.0, missing + 1.0) * slope
        channels = np.tile(self._channels, (missing, 1))
        channels[:, self._own] = between_mm[:, None]
        self.model.run(self._state, channels, between_mm)
        self._means["gap"] = 1

    def _unmeasured(self) -> list[float]:
        """What channels that are not measured may do to the force, one sigma each."""
        assert self._state is not None
        parts = []
        for position in np.flatnonzero(~np.isnan(self._unmeasured_s)).tolist():
            spread = unmeasured_std(CATALOGUE[self.signals[position]], self._unmeasured_s.item(position))
            held = self._inputs(self._deformation_mm)[1:]
            moved = held.copy()
            moved[position] += spread
            there = self.model.step(self._state.copy(), moved, self._deformation_mm)
            here = self.model.step(self._state.copy(), held, self._deformation_mm)
            parts.append(abs(there - here))
        return parts


def upper_share(upper: MountSource, lower: MountSource) -> float:
    """What the upper mount carries of their load, by the models: both move together."""
    together_mm = 0.5 * min(source.model.spec.valid.deformation_mm[1] for source in (upper, lower))
    upper_n, lower_n = (source.rests_at_n(together_mm) for source in (upper, lower))
    return min(max(upper_n / (upper_n + lower_n), LEAST_SHARE), 1.0 - LEAST_SHARE) if upper_n + lower_n > 0.0 else 0.5
