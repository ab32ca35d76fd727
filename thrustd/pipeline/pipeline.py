"""The one pipeline: events in, outputs out; live flight, replay and hardware in the loop differ only in who feeds it.

    Frame "adc" -> ADC samples -> one model step per mount and sample (load-factor corrections inside)
    Frame "can" -> readings, held until the next one
    every fused step (ADC instants, or ticks while the ADC is silent):
        readings -> brochure deck -> monitor: who is trusted -> thrust filter per engine -> estimates

Time is data: the pipeline reads only `event.t_ns`. Nothing that arrives can stop it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import nan
from typing import Any, Final

import numpy as np

from thrustd.brochure.deck import Deck
from thrustd.brochure.source import BrochureSource
from thrustd.core.aircraft import NO_MOUNT, AircraftData, places
from thrustd.core.atmosphere import dynamic_pressure_pa
from thrustd.core.calibration import MountCalibration
from thrustd.core.config import Config, section
from thrustd.core.signals import RUNS_PCT
from thrustd.core.types import Event, Fault, MountOutput, Output, Terms
from thrustd.fusion.fusion_inputs import INPUTS
from thrustd.fusion.mixture import Weighed
from thrustd.fusion.settings import FusionSettings, check_settings
from thrustd.fusion.smoother import Tape
from thrustd.fusion.thrust_filter import ThrustFilter
from thrustd.model.compile import CompiledModel
from thrustd.mounts.source import COMMON, upper_share
from thrustd.pipeline.fault_book import FaultBook
from thrustd.pipeline.fault_status import FaultStatus
from thrustd.pipeline.intake import Intake
from thrustd.pipeline.snapshot import plain, read_memory
from thrustd.pipeline.step_inputs import StepInputs, tell_filters
from thrustd.pipeline.wires import Wires, engines_of, wires_of
from thrustd.sensors.bank import BY_MOUNTS
from thrustd.sensors.cross_check import cross_checks
from thrustd.sensors.limits import FLYING_MACH
from thrustd.sensors.monitor import Monitor, MonitorVerdict
from thrustd.sensors.monitor_inputs import Layout, MonitorInputs
from thrustd.sensors.onsets import AIR_OFF, BROCHURE_OFF
from thrustd.wire.can_table import CanTable
from thrustd.wire.event_batch import EventBatch

DERIVED = ("time_s", "dynamic_pressure_Pa")  # channels the pipeline makes itself
EARLY_SAMPLES = 1.5
CLOCK_OFF = 0.005  # a crystal that is this far off is broken; its samples are good
CHECK_EVERY_NS = 1_000_000_000  # what ages takes flights
_new: Final = tuple.__new__  # half the time of calling a NamedTuple


@dataclass(frozen=True, slots=True)
class Parts:
    """What a pipeline is built from, besides the configuration."""

    models: tuple[CompiledModel, ...]  # by mount
    deck: Deck
    can_table: CanTable
    aircraft: AircraftData
    calibrations: tuple[MountCalibration, ...] = ()  # by mount; empty: nothing was measured


class Pipeline:
    """Mutable; `feed` is its whole life, `snapshot` / `restore` its memory across a restart."""

    def __init__(self, config: Config, parts: Parts) -> None:
        engines = config.aircraft.engines
        settings = section(config.fusion, FusionSettings, "fusion")
        check_settings(settings, "fusion")
        self._intake = Intake(config, parts.models, parts.can_table, settings, parts.calibrations)
        self._hold, self._sources = self._intake.hold, self._intake.sources
        self._layout = Layout(
            tuple(mount.name for mount in config.mount),
            places(config, parts.aircraft),
            tuple(engines),
        )
        self._mounts_of_engine = self._layout.mounts_of_engine
        self._states = self._intake.states
        self._inputs = StepInputs(self._layout, self._hold, self._states)
        aircraft = parts.aircraft
        shares = [self._first_share(row, aircraft) for row in self._layout.places]
        self._monitor = Monitor(self._layout, aircraft, shares)
        self._filters = tuple(ThrustFilter(settings, e, 0.5 / config.steps.estimate_hz) for e in range(len(engines)))
        place, numbers = self._inputs.place, range(len(engines))
        self._brochures = tuple(BrochureSource(parts.deck, e, place, aircraft.windmilling) for e in numbers)
        self._pressure_wanted = self._intake.is_wanted(("dynamic_pressure_Pa", 0))
        self._spools = [place("n1_pct", e) for e in numbers]
        self._air = place("mach", 0), place("pressure_altitude_m", 0)
        dynamic_pressure_pa(0.0, 0.0)  # compiled now, not in flight
        self._loads = np.array([place("accel_x_g", 0), place("accel_z_g", 0)])
        self._deck_n, self._fuel_std = np.zeros((len(engines), 6)), aircraft.fuel.heat  # see `BrochureSource.look`
        self._told = np.zeros(len(engines), INPUTS)  # what the filters are told
        self._told_of = [self._told[e : e + 1] for e in numbers]
        self._mounts_said = self._states.view(np.float64).reshape(len(self._states), -1)[:, :3]  # as MountOutput has it
        self._mounts_of = self._monitor.combiner.mounts
        self._hand_overs = tuple(source.hand_over for source in self._brochures)
        self._readings_every_ns = round(1e9 / config.steps.reading_hz)
        self._early_ns = round(EARLY_SAMPLES * 1e9 / config.adc.sample_hz)
        self._read_ns = self._start_ns = self._looked_ns = self._read_due_ns = self._checked_ns = -1
        self._flying = self._clock_off = False
        self._excluded: frozenset[tuple[str, int]] = frozenset()  # sensors the monitor excludes
        self._book = FaultBook()
        self._troubles = FaultStatus(len(engines), engines_of(config))
        self._wires = Wires(wires_of(config, self._hold.slots))
        self._terms(0)  # compiled now, too

    def _first_share(self, row: tuple[int, int], aircraft: AircraftData) -> float:
        """What the mount in the first place carries of an engine's thrust: both models say it, or the file."""
        upper, lower = row
        if aircraft.rigid_body or NO_MOUNT in row:
            return aircraft.share(0)
        return upper_share(self._sources[upper], self._sources[lower])

    def feed(self, event: Event) -> Sequence[Output]:
        """`take` for one event."""
        return self.take(EventBatch.of((event,)))

    def take(self, batch: EventBatch) -> list[Output]:
        """Outputs that these events complete, whatever batches they come in. Never raises on what comes over a wire."""
        outputs: list[Output] = []
        for due in self._intake.take(batch):
            if isinstance(due, Fault):
                self._report(due, outputs)
            else:
                self._fuse(due, outputs)
        return outputs

    def quiet_until_ns(self) -> int:
        """Frames that arrive before this complete no fused step: whoever feeds may hand them over with later ones.

        The sample before the one that does is not waited with: then only that one is left to work on.
        """
        return self._intake.next_step_ns() - self._early_ns

    def tapes(self) -> tuple[Tape, ...]:
        """One per engine: every fused step from now on, for `fusion.smoother.smooth`."""
        return tuple(thrust_filter.keep() for thrust_filter in self._filters)

    def snapshot(self) -> dict[str, Any]:
        """Everything a warm restart needs, JSON-able."""
        memory: dict[str, Any] = {
            "t_ns": [self._intake.fused_ns, self._start_ns],
            "sample": self._intake.sample,
            "mounts": [source.snapshot() for source in self._sources],
            "filters": [thrust_filter.snapshot() for thrust_filter in self._filters],
            "hand_overs": [hand_over.snapshot() for hand_over in self._hand_overs],
            "monitor": self._monitor.snapshot(),
            "hold": self._hold.snapshot(),
            "service_s": self._intake.service_s,
        }
        return plain(memory)

    def restore(self, snapshot: Mapping[str, Any], shift_ns: int = 0) -> bool:
        """Take over a snapshot made with the same models, its times moved by `shift_ns`.

        Only for a fresh pipeline; False when it is no such snapshot: throw this pipeline away then.
        """
        memory = read_memory(snapshot, len(self._sources), len(self._filters), shift_ns)
        if memory is None:
            return False
        self._intake.fused_ns, self._start_ns = memory.t_ns
        self.serve_from(memory.service_s)
        restored = all([source.restore(state) for source, state in zip(self._sources, memory.mounts, strict=True)])
        restored &= all([part.restore(state) for part, state in zip(self._filters, memory.filters, strict=True)])
        restored &= all([part.restore(state) for part, state in zip(self._hand_overs, memory.hand_overs, strict=True)])
        restored &= self._monitor.restore(memory.monitor, shift_ns) and self._hold.restore(memory.hold, shift_ns)
        self._excluded = self._monitor.excluded
        self._intake.resume_from(memory.sample, self._intake.fused_ns, self._excluded)
        return restored

    @property
    def service_s(self) -> list[float]:
        """Of the mounts, with their engine running."""
        return list(self._intake.service_s)

    def serve_from(self, service_s: Sequence[float]) -> None:
        """What the mounts had served when the power came."""
        self._intake.service_s = list(service_s)

    def _report(self, fault: Fault, outputs: list[Output]) -> None:
        self._troubles.take(fault)
        self._say(self._wires.take(fault), outputs)

    def _say(self, faults: Sequence[Fault], outputs: list[Output]) -> None:
        outputs.extend([due for fault in faults if (due := self._book.take(fault)) is not None])

    def _fuse(self, t_ns: int, outputs: list[Output]) -> None:
        if self._start_ns < 0:
            self._start_ns = self._intake.fused_ns = t_ns
        since_ns, self._intake.fused_ns = self._intake.fused_ns, t_ns
        dt_s = (t_ns - self._looked_ns) * 1e-9 if self._looked_ns >= 0 else 0.0
        self._looked_ns = t_ns
        self._refresh(t_ns, self._inputs.look(t_ns), outputs)
        for spool, mounts in zip(self._spools, self._mounts_of_engine, strict=True):
            self._intake.pass_time(dt_s, mounts if self._inputs.readings[spool] > RUNS_PCT else ())
        for source in self._sources:
            source.fuse((t_ns - since_ns) * 1e-9)
        self._inputs.measure()
        readings, deck_n = self._inputs.readings, self._deck_n
        for e, brochure in enumerate(self._brochures):
            brochure.look(dt_s, readings, ("n1_pct", e) not in self._excluded, deck_n[e])
        verdict = self._monitor.step(MonitorInputs(t_ns, readings, self._states, deck_n))
        self._exclude(verdict, t_ns, outputs)
        self._tell(t_ns, dt_s, verdict)
        estimates, bank = [], self._monitor.bank
        if verdict.changed >= 0:
            thrust_n, std_n, _ = bank.leading[verdict.changed].tolist()
            self._filters[verdict.changed].begin_anew(thrust_n, std_n, self._told_of[verdict.changed])
        for e, thrust_filter in enumerate(self._filters):
            said = bank.rows[e], bank.found.item(e), self._monitor.uncorrected_n(e), BY_MOUNTS
            weighed = Weighed(*said, bank.leading.item(e, 0))
            estimates.append(thrust_filter.step(self._told_of[e], weighed))
            outputs.append(estimates[e])
            if thrust_filter.calibrates:
                self._calibrate(e, t_ns, outputs)
        outputs.extend([_new(MountOutput, (t_ns, i, *said)) for i, said in enumerate(self._mounts_said.tolist())])
        if t_ns - self._checked_ns >= CHECK_EVERY_NS:
            self._checked_ns = t_ns
            self._check_clock(t_ns, outputs)
            outputs.extend(cross_checks(estimates))
            outputs.extend(self._terms(t_ns))
        outputs.extend(self._book.due(t_ns))

    def _terms(self, t_ns: int) -> list[Terms]:
        combine, mine = self._monitor.combiner.terms_n, self._mounts_of_engine
        of_mounts = [[self._sources[i].terms_n() for i in mounts] for mounts in mine]
        fuels_n = (self._fuel_std * abs(self._deck_n[:, 4])).tolist()
        others = [{"installation_n": self._monitor.uncorrected_n(e), "fuel_n": n} for e, n in enumerate(fuels_n)]
        return [Terms(t_ns, e, **combine(e, of_mounts[e], COMMON), **other) for e, other in enumerate(others)]

    def _check_clock(self, t_ns: int, outputs: list[Output]) -> None:
        off = abs(self._intake.clock_rate) > CLOCK_OFF
        if off != self._clock_off:
            self._clock_off = off
            self._report(Fault(t_ns, "adc_clock", "rate", off), outputs)

    def _refresh(self, t_ns: int, changed: bool, outputs: list[Output]) -> None:
        """Wires, staleness, derived channels, and the readings for the log."""
        if t_ns >= self._wires.next_ns:
            for fault in self._wires.look(t_ns, self._intake.sample[0], self._hold.newest_ns()):
                self._report(fault, outputs)
            self._say(self._wires.due(t_ns), outputs)
        for place, fault in self._hold.changes(t_ns) if changed else ():
            self._report(fault, outputs)
            if fault.active:
                self._intake.tell(self._hold.slots[place], nan)
        if self._pressure_wanted:
            air = [self._inputs.readings.item(place) for place in self._air]
            self._intake.tell(("dynamic_pressure_Pa", 0), dynamic_pressure_pa(*air))
        if not self._flying and self._inputs.readings[self._air[0]] > FLYING_MACH:
            self._flying = True
            for source in self._sources:
                source.fly()
        every_ns = self._readings_every_ns
        if t_ns >= self._read_due_ns - every_ns // 4:  # steps at this rate jitter
            outputs.extend(self._hold.readings(self._read_ns))
            self._read_ns, self._read_due_ns = t_ns, max(self._read_due_ns + every_ns, t_ns + every_ns // 2)

    def _exclude(self, verdict: MonitorVerdict, t_ns: int, outputs: list[Output]) -> None:
        for fault in verdict.faults:
            self._report(fault, outputs)
        if verdict.excluded != self._excluded:
            for sensor in verdict.excluded - self._excluded:
                self._intake.tell(sensor, nan)
            self._excluded = verdict.excluded
            self._intake.trust(verdict.excluded)
        for mount in verdict.again:
            self._sources[mount].hear_again()

    def _calibrate(self, engine: int, t_ns: int, outputs: list[Output]) -> None:
        mounts = self._mounts_of_engine[engine]
        heard = [mount for mount in mounts if ("deformation_mm", mount) not in self._excluded]
        refused = [mount for mount in heard if not self._sources[mount].calibrate()]
        if len(refused) < len(heard):
            self._report(Fault(t_ns, self._layout.engine_names[engine], "zero"), outputs)
        for mount in refused:
            self._report(Fault(t_ns, self._layout.mount_names[mount], "zero_refused"), outputs)

    def _tell(self, t_ns: int, dt_s: float, verdict: MonitorVerdict) -> None:
        """What the filters are told, a row of INPUTS each."""
        told, readings, trusted = self._told, self._inputs.readings, self._inputs.trusted(verdict.excluded)
        troubles = self._troubles.bits(t_ns)
        tell_filters(told, t_ns, troubles, verdict.mounts, self._mounts_of, self._states, readings[self._loads])
        for e, brochure in enumerate(self._brochures):
            brochure.tell(dt_s, trusted, self._inputs.ages_s, bool(verdict.excluded), self._told_of[e])
            told["installed_n"][e] = self._monitor.uncorrected_n(e)
            if verdict.status[e]:
                told["status"][e] |= verdict.status[e]
            if self._monitor.bank.found.item(e) in (BROCHURE_OFF, AIR_OFF):
                told["brochure_n"][e] = nan
