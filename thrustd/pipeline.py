"""The one pipeline: events in, outputs out; live flight, replay and hardware in the loop differ only in who feeds it.

    Frame "adc" -> ADC samples -> one model step per mount and sample (load-factor corrections inside)
    Frame "can" -> readings, held until the next one
    every fused step (ADC instants, or ticks while the ADC is silent):
        readings -> brochure deck -> monitor: who is believed -> thrust filter per engine -> estimates

Time is data: the pipeline reads only `event.t_ns`. Nothing that arrives can stop it.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from math import isfinite, nan
from typing import Any, Final, NamedTuple

import numpy as np

from thrustd.brochure.deck import Deck
from thrustd.brochure_route import BrochureRoute
from thrustd.columns import Floats
from thrustd.config import Config, section
from thrustd.fault_book import FaultBook
from thrustd.fault_status import FaultStatus
from thrustd.fusion.fusion_inputs import INPUTS, FusionInputs
from thrustd.fusion.limits import FLYING_MACH
from thrustd.fusion.monitor import Monitor, MonitorVerdict
from thrustd.fusion.monitor_inputs import Layout, MonitorInputs
from thrustd.fusion.settings import FusionSettings, check_settings
from thrustd.fusion.smoother import Tape
from thrustd.fusion.thrust_filter import ThrustFilter
from thrustd.intake import Intake
from thrustd.model.compile import CompiledModel
from thrustd.snapshot import plain, read_memory
from thrustd.step_inputs import StepInputs, dynamic_pressure_pa
from thrustd.types import Event, Fault, MountOutput, Output
from thrustd.wire.can_table import CanTable
from thrustd.wire.event_batch import EventBatch

DERIVED = ("time_s", "dynamic_pressure_Pa")  # channels the pipeline makes itself
EARLY_SAMPLES = 1.5
_new: Final = tuple.__new__  # half the time of calling a NamedTuple
TOGETHER = 256  # events that `follow` takes at once


@dataclass(frozen=True, slots=True)
class Parts:
    """What a pipeline is built from, besides the configuration."""

    models: tuple[CompiledModel, ...]  # by mount
    deck: Deck
    can_table: CanTable


class Held(NamedTuple):
    """What is known at one fused step when the filters are asked."""

    t_ns: int
    dt_s: float  # since the last one of this process
    readings: Floats  # of the sensors that are believed, see `StepInputs`
    ages_s: Floats
    beyond: Sequence[bool]  # by mount: outside the range of its model
    gaps: Sequence[bool]  # by mount: samples were lost
    unloaded: bool  # a load factor is missing
    troubles: int  # Status bits of the installation
    verdict: MonitorVerdict


class Pipeline:
    """Mutable; `feed` is its whole life, `snapshot` / `restore` its memory across a restart."""

    def __init__(self, config: Config, parts: Parts) -> None:
        engines = config.aircraft.engines
        settings = section(config.fusion, FusionSettings, "fusion")
        check_settings(settings, "fusion")
        self._intake = Intake(config, parts.models, parts.can_table, settings.installation_std_n)
        self._hold, self._routes = self._intake.hold, self._intake.routes
        self._layout = Layout(
            tuple(mount.name for mount in config.mount), tuple(config.mounts_of(engine) for engine in engines)
        )
        self._inputs = StepInputs(self._layout, self._hold)
        self._monitor = Monitor(self._layout)
        self._filters = tuple(
            ThrustFilter(settings, e, name, 0.5 / config.steps.estimate_hz) for e, name in enumerate(engines)
        )
        place, numbers = self._inputs.place, range(len(engines))
        self._brochures = tuple(BrochureRoute(parts.deck, e, place) for e in numbers)
        self._pressure_wanted = self._intake.is_wanted(("dynamic_pressure_Pa", 0))
        self._air = place("mach", 0), place("pressure_altitude_m", 0)
        self._loads = place("accel_x_g", 0), place("accel_z_g", 0)
        self._rows = [np.zeros(1, INPUTS) for _ in engines]  # what the filters are told
        self._hand_overs = tuple(route.hand_over for route in self._brochures)
        self._readings_every_ns = round(1e9 / config.steps.reading_hz)
        self._early_ns = round(EARLY_SAMPLES * 1e9 / config.adc.sample_hz)
        self._read_ns = self._start_ns = self._looked_ns = -1
        self._flying = False
        self._excluded: frozenset[tuple[str, int]] = frozenset()  # sensors the monitor does not believe
        self._book = FaultBook()
        self._troubles = FaultStatus()

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

    def follow(self, events: Iterable[Event]) -> Iterator[Output]:
        """Outputs of a stream of events that may wait for a few more; `take` costs less for many."""
        stream = iter(events)
        while together := tuple(islice(stream, TOGETHER)):
            yield from self.take(EventBatch.of(together))

    def tapes(self) -> tuple[Tape, ...]:
        """One per engine: every fused step from now on, for `fusion.smoother.smooth`."""
        return tuple(thrust_filter.keep() for thrust_filter in self._filters)

    def snapshot(self) -> dict[str, Any]:
        """Everything a warm restart needs, JSON-able."""
        memory: dict[str, Any] = {
            "t_ns": [self._intake.fused_ns, self._start_ns],
            "sample": self._intake.sample,
            "mounts": [route.snapshot() for route in self._routes],
            "filters": [thrust_filter.snapshot() for thrust_filter in self._filters],
            "hand_overs": [hand_over.snapshot() for hand_over in self._hand_overs],
            "monitor": self._monitor.snapshot(),
            "hold": self._hold.snapshot(),
        }
        return plain(memory)

    def restore(self, snapshot: Mapping[str, Any], shift_ns: int = 0) -> bool:
        """Take over a snapshot made with the same models, its times moved by `shift_ns`.

        Only for a fresh pipeline; False when it is no such snapshot: throw this pipeline away then.
        """
        memory = read_memory(snapshot, len(self._routes), len(self._filters), shift_ns)
        if memory is None:
            return False
        self._intake.fused_ns, self._start_ns = memory.t_ns
        restored = all([route.restore(state) for route, state in zip(self._routes, memory.mounts, strict=True)])
        restored &= all([part.restore(state) for part, state in zip(self._filters, memory.filters, strict=True)])
        restored &= all([part.restore(state) for part, state in zip(self._hand_overs, memory.hand_overs, strict=True)])
        restored &= self._monitor.restore(memory.monitor, shift_ns) and self._hold.restore(memory.hold, shift_ns)
        self._excluded = self._monitor.excluded
        self._intake.resume_from(memory.sample, self._intake.fused_ns, self._excluded)
        return restored

    def _report(self, fault: Fault, outputs: list[Output]) -> None:
        self._troubles.take(fault)
        due = self._book.take(fault)
        if due is not None:
            outputs.append(due)

    def _fuse(self, t_ns: int, outputs: list[Output]) -> None:
        if self._start_ns < 0:
            self._start_ns = self._intake.fused_ns = t_ns
        since_ns, self._intake.fused_ns = self._intake.fused_ns, t_ns
        dt_s = (t_ns - self._looked_ns) * 1e-9 if self._looked_ns >= 0 else 0.0
        self._looked_ns = t_ns
        changed, readings, ages_s = self._inputs.at(t_ns)
        self._refresh(t_ns, changed, readings, outputs)
        states = [route.fused((t_ns - since_ns) * 1e-9) for route in self._routes]
        for route in self._brochures:
            route.look(dt_s, readings)
        deformations_mm, forces_n, stds_n, commons_n, beyond, gaps = zip(*states, strict=True)
        routes_n = [route.routes_n for route in self._brochures]
        fused_n = [thrust_filter.thrust_n for thrust_filter in self._filters]
        seen = [*deformations_mm, *readings.tolist()]
        verdict = self._monitor.step(MonitorInputs(t_ns, seen, forces_n, stds_n, commons_n, routes_n, fused_n))
        self._exclude(verdict, t_ns, outputs)
        unloaded = not all([isfinite(readings[place]) for place in self._loads])
        believed, bits = self._inputs.believed(readings, verdict.excluded), self._troubles.bits(t_ns)
        held = Held(t_ns, dt_s, believed, ages_s, beyond, gaps, unloaded, bits, verdict)
        for e, thrust_filter in enumerate(self._filters):
            outputs.append(thrust_filter.step(self._told(held, e)))
            for fault in thrust_filter.take_faults():
                self._report(fault, outputs)
        outputs.extend([_new(MountOutput, (t_ns, i, *state[:3])) for i, state in enumerate(states)])
        outputs.extend(self._book.due(t_ns))

    def _refresh(self, t_ns: int, changed: bool, readings: Floats, outputs: list[Output]) -> None:
        """Staleness, derived channels, and the readings for the log."""
        for place, fault in self._hold.changes(t_ns) if changed else ():
            self._report(fault, outputs)
            if fault.kind == "stale":
                self._intake.tell(self._hold.slots[place], nan)
        self._intake.tell(("time_s", 0), (t_ns - self._start_ns) * 1e-9)
        if self._pressure_wanted:
            air = [readings.item(place) for place in self._air]
            self._intake.tell(("dynamic_pressure_Pa", 0), dynamic_pressure_pa(*air))
        if not self._flying and readings[self._air[0]] > FLYING_MACH:
            self._flying = True
            for route in self._routes:
                route.fly()
        if t_ns - self._read_ns >= self._readings_every_ns:
            outputs.extend(self._hold.readings(self._read_ns))
            self._read_ns = t_ns

    def _exclude(self, verdict: MonitorVerdict, t_ns: int, outputs: list[Output]) -> None:
        for fault in verdict.faults:
            self._report(fault, outputs)
        if verdict.excluded != self._excluded:
            for sensor in verdict.excluded - self._excluded:
                self._intake.tell(sensor, nan)
            self._excluded = verdict.excluded
            self._intake.believe(verdict.excluded)

    def _told(self, held: Held, engine: int) -> Any:
        """What the filter of this engine is told, a row of INPUTS."""
        mounts, mine = held.verdict.mounts[engine], self._layout.mounts_of_engine[engine]
        inputs = FusionInputs(
            held.t_ns, mounts.force_n, mounts.std_n, nan, nan, nan, nan,
            push_n=mounts.push_n,
            load_share=mounts.load_share,
            mount_extrapolating=any([held.beyond[i] for i in mine]),
            gap=any([held.gaps[i] for i in mine]),
            one_mount=mounts.one_mount,
            load_factor_stale=held.unloaded,
            status=held.verdict.status[engine] | held.troubles,
        )  # fmt: skip
        told, fewer = self._rows[engine], bool(held.verdict.excluded)
        told[0] = inputs
        self._brochures[engine].tell(held.dt_s, held.readings, held.ages_s, fewer, told)
        return told
