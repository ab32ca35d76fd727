"""The one pipeline: events in, outputs out; live flight, replay and hardware in the loop differ only in who feeds it.

    Frame "adc" -> ADC samples -> one model step per mount and sample (load-factor corrections inside)
    Frame "can" -> readings, held until the next one
    every fused step (ADC instants, or ticks while the ADC is silent):
        readings -> brochure deck -> monitor: who is believed -> thrust filter per engine -> estimates

Time is data: the pipeline reads only `event.t_ns`. Nothing that arrives can stop it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, nan
from typing import Any

from thrustd.brochure.deck import Deck, DeckEstimate
from thrustd.brochure.hand_over import HandOver
from thrustd.config import Config, section
from thrustd.fault_book import FaultBook
from thrustd.fault_status import FaultStatus
from thrustd.fusion.fusion_inputs import FusionInputs
from thrustd.fusion.monitor import Monitor, MonitorVerdict
from thrustd.fusion.monitor_inputs import Layout
from thrustd.fusion.settings import FusionSettings, check_settings
from thrustd.fusion.smoother import Tape
from thrustd.fusion.thrust_filter import ThrustFilter
from thrustd.model.compile import CompiledModel
from thrustd.mount_route import MountRoute, MountState
from thrustd.signals import CATALOGUE
from thrustd.snapshot import plain, read_memory
from thrustd.step_inputs import Latest, deck_inputs, dynamic_pressure_pa, latest, monitor_inputs
from thrustd.sync import ClockMap, Hold, SmoothRate
from thrustd.types import Estimate, Event, Fault, Frame, MountOutput, Output, Reading, Tick
from thrustd.wire.adc_frames import CHANNEL_FAULT, AdcDecoder, AdcSample
from thrustd.wire.can_frames import CanDecoder
from thrustd.wire.can_table import CanTable

DERIVED = ("time_s", "dynamic_pressure_Pa")  # channels the pipeline makes itself
LONGEST_PAUSE_S = 60.0  # of a warm restart; the models step through it when the first sample comes
NEVER = (-1, -1)
ENGINE_READINGS = ("n1_pct", "fuel_flow_kg_s")  # what the brochure thrust is made of
SILENT_AFTER_PERIODS = 2.5  # no ADC sample for so many fused periods: ticks take over


@dataclass(frozen=True, slots=True)
class Parts:
    """What a pipeline is built from, besides the configuration."""

    models: tuple[CompiledModel, ...]  # by mount
    deck: Deck
    can_table: CanTable


class Pipeline:
    """Mutable; `feed` is its whole life, `snapshot` / `restore` its memory across a restart."""

    def __init__(self, config: Config, parts: Parts) -> None:
        engines = config.aircraft.engines
        settings = section(config.fusion, FusionSettings, "fusion")
        check_settings(settings, "fusion")
        self._deck = parts.deck
        self._adc = AdcDecoder(config.adc.channels, config.adc.sample_hz)
        self._can = CanDecoder(parts.can_table)
        self._clock = ClockMap()
        self._hold = Hold()
        bridge = round(config.steps.bridge_gap_ms * 1e-3 * config.adc.sample_hz)
        self._routes = tuple(MountRoute(model, bridge, settings.installation_std_n) for model in parts.models)
        wires = ((mount.name, mount.adc_channel, mount.scale_mm, mount.offset_mm) for mount in config.mount)
        self._wired = tuple(zip(self._routes, wires, strict=True))
        self._engine_of = tuple(engines.index(mount.engine) for mount in config.mount)
        self._listeners = self._listen()
        self._layout = Layout(
            tuple(mount.name for mount in config.mount), tuple(config.mounts_of(engine) for engine in engines)
        )
        self._monitor = Monitor(self._layout)
        self._filters = tuple(ThrustFilter(settings, e, name) for e, name in enumerate(engines))
        self._n1_rates = tuple(SmoothRate() for _ in engines)
        self._hand_overs = tuple(HandOver() for _ in engines)
        self._samples_per_step = round(config.adc.sample_hz / config.steps.estimate_hz)
        self._step_ns = round(1e9 / config.steps.estimate_hz)
        self._readings_every_ns = round(1e9 / config.steps.reading_hz)
        self._sample_hz = config.adc.sample_hz
        self._sampled_ns = self._sequence = -1  # of the last sample
        self._resume_from = NEVER  # time and sequence of the last sample before a warm restart
        self._next_step = 0  # ADC sequence of the next fused step
        self._fused_ns = self._read_ns = self._start_ns = -1
        self._excluded: frozenset[tuple[str, int]] = frozenset()  # sensors the monitor does not believe
        self._believed = self._listeners  # without the excluded ones
        self._book = FaultBook()
        self._troubles = FaultStatus()

    def feed(self, event: Event | Fault) -> Sequence[Output]:
        """Outputs that this event completes. Never raises on anything that comes over the wire."""
        outputs: list[Output] = []
        if type(event) is Frame:
            (self._take_can if event.channel == "can" else self._take_adc)(event, outputs)
        elif type(event) is Tick:
            self._tick(event.t_ns, outputs)
        elif isinstance(event, Fault):
            self._report(event, outputs)
        return outputs

    def tapes(self) -> tuple[Tape, ...]:
        """One per engine: every fused step from now on, for `fusion.smoother.smooth`."""
        return tuple(thrust_filter.keep() for thrust_filter in self._filters)

    def snapshot(self) -> dict[str, Any]:
        """Everything a warm restart needs, JSON-able."""
        memory: dict[str, Any] = {
            "t_ns": [self._fused_ns, self._start_ns],
            "sample": [self._sampled_ns, self._sequence],
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
        self._fused_ns, self._start_ns = memory.t_ns
        self._resume_from = memory.sample
        restored = all([route.restore(state) for route, state in zip(self._routes, memory.mounts, strict=True)])
        restored &= all([part.restore(state) for part, state in zip(self._filters, memory.filters, strict=True)])
        restored &= all([part.restore(state) for part, state in zip(self._hand_overs, memory.hand_overs, strict=True)])
        restored &= self._monitor.restore(memory.monitor, shift_ns) and self._hold.restore(memory.hold, shift_ns)
        self._believe(self._monitor.excluded)
        for (signal, index), listeners in self._believed.items():
            for route, position in listeners:
                route.set_channel(position, self._hold.value(self._fused_ns, signal, index))
        return restored

    def _listen(self) -> dict[tuple[str, int], list[tuple[MountRoute, int]]]:
        """Which mount's model wants which reading."""
        listeners: dict[tuple[str, int], list[tuple[MountRoute, int]]] = {}
        for mount, route in enumerate(self._routes):
            for position, name in enumerate(route.signals):
                if name == "deformation_mm":  # the route's own
                    continue
                index = {"aircraft": 0, "engine": self._engine_of[mount], "mount": mount}[CATALOGUE[name].scope]
                listeners.setdefault((name, index), []).append((route, position))
        return listeners

    def _report(self, fault: Fault, outputs: list[Output]) -> None:
        self._troubles.take(fault)
        due = self._book.take(fault)
        if due is not None:
            outputs.append(due)

    def _take_can(self, frame: Frame, outputs: list[Output]) -> None:
        for item in self._can.feed(frame):
            fault = self._take_reading(item) if isinstance(item, Reading) else item
            if fault is not None:
                self._report(fault, outputs)

    def _take_reading(self, reading: Reading) -> Fault | None:
        fault = self._hold.take(reading)
        if fault is None:
            _, signal, index, value = reading
            for route, position in self._believed.get((signal, index), ()):
                route.set_channel(position, value)
        return fault

    def _take_adc(self, frame: Frame, outputs: list[Output]) -> None:
        for item in self._adc.feed(frame.t_ns, frame.data):
            if isinstance(item, Fault):
                self._report(item, outputs)
            else:
                self._sample(item, outputs)

    def _resume(self, t_ns: int, sequence: int) -> None:
        """The first sample after a warm restart: how many instants nobody saw."""
        saved_ns, last = self._resume_from
        self._resume_from = NEVER
        missing = max(round((t_ns - saved_ns) * 1e-9 * self._sample_hz) - 1, 0)
        if saved_ns >= 0 and missing <= LONGEST_PAUSE_S * self._sample_hz:
            for route in self._routes:
                route.resume(last, sequence - missing - 1 - last)

    def _sample(self, sample: AdcSample, outputs: list[Output]) -> None:
        t_ns = self._clock.to_ns(sample.t_ns, sample.device_time_us)
        sequence, counts = sample.sequence, sample.counts
        if self._resume_from is not NEVER:
            self._resume(t_ns, sequence)
        self._sampled_ns, self._sequence = t_ns, sequence
        for route, (name, channel, scale_mm, offset_mm) in self._wired:
            if counts[channel] == CHANNEL_FAULT:
                continue
            deformation_mm = counts[channel] * scale_mm + offset_mm
            if route.believable(deformation_mm):
                route.take(sequence, deformation_mm)
            else:
                self._report(Fault(t_ns, name, "out_of_range"), outputs)
        if sequence >= self._next_step or sequence < self._next_step - 2 * self._samples_per_step:
            self._next_step = sequence - sequence % self._samples_per_step + self._samples_per_step
            self._fuse(max(t_ns, self._fused_ns + 1), outputs)

    def _tick(self, t_ns: int, outputs: list[Output]) -> None:
        if self._fused_ns < 0 or t_ns - self._fused_ns >= SILENT_AFTER_PERIODS * self._step_ns:
            self._fuse(max(t_ns, self._fused_ns + 1), outputs)

    def _fuse(self, t_ns: int, outputs: list[Output]) -> None:
        if self._start_ns < 0:
            self._start_ns = self._fused_ns = t_ns
        dt_s = (t_ns - self._fused_ns) * 1e-9
        self._fused_ns = t_ns
        engines = range(len(self._filters))
        now = latest(self._hold, t_ns, engines)
        self._refresh(t_ns, now, outputs)
        states = tuple([route.fused(dt_s) for route in self._routes])
        rates = [self._n1_rates[e].step(t_ns, now.n1_pct[e]) for e in engines]
        raw = [self._deck.estimate(deck_inputs(now, e, rates[e]), e) for e in engines]
        fused_n = tuple([thrust_filter.thrust_n for thrust_filter in self._filters])
        verdict = self._monitor.step(monitor_inputs(now, t_ns, states, raw, fused_n))
        self._exclude(verdict, t_ns, outputs)
        for e in engines:
            deck = raw[e]
            if verdict.excluded:
                deck = self._deck.estimate(deck_inputs(now, e, rates[e], verdict.excluded), e)
            outputs.append(self._estimate(t_ns, e, now, states, verdict, deck, rates[e]))
            for fault in self._filters[e].take_faults():
                self._report(fault, outputs)
        for i, state in enumerate(states):
            outputs.append(MountOutput(t_ns, i, state.deformation_mm, state.force_n, state.std_n))
        outputs.extend(self._book.due(t_ns))

    def _refresh(self, t_ns: int, now: Latest, outputs: list[Output]) -> None:
        """Staleness, derived channels, and the readings for the log."""
        for fault in self._hold.changes(t_ns):
            self._report(fault, outputs)
            if fault.kind == "stale":
                signal, _, index = fault.where.rstrip("]").partition("[")
                self._tell((signal, int(index)), nan)
        self._tell(("time_s", 0), (t_ns - self._start_ns) * 1e-9)
        self._tell(("dynamic_pressure_Pa", 0), dynamic_pressure_pa(now))
        if t_ns - self._read_ns >= self._readings_every_ns:
            outputs.extend(self._hold.readings(self._read_ns))
            self._read_ns = t_ns

    def _exclude(self, verdict: MonitorVerdict, t_ns: int, outputs: list[Output]) -> None:
        for fault in verdict.faults:
            self._report(fault, outputs)
        if verdict.excluded != self._excluded:
            for sensor in verdict.excluded - self._excluded:
                self._tell(sensor, nan)
            self._believe(verdict.excluded)

    def _believe(self, all_but: frozenset[tuple[str, int]]) -> None:
        self._excluded = all_but
        self._believed = {sensor: routes for sensor, routes in self._listeners.items() if sensor not in all_but}

    def _tell(self, sensor: tuple[str, int], value: float) -> None:
        """A value for the models' effects; NaN = not measured any more, they go back to the resting value."""
        for route, position in self._listeners.get(sensor, ()):
            route.set_channel(position, value)

    def _estimate(
        self,
        t_ns: int,
        engine: int,
        now: Latest,
        states: tuple[MountState, ...],
        verdict: MonitorVerdict,
        deck: DeckEstimate,
        n1_rate: float,
    ) -> Estimate:
        mounts = verdict.mounts[engine]
        mine = [states[i] for i in self._layout.mounts_of_engine[engine]]
        n1_known = ("n1_pct", engine) not in verdict.excluded
        n1_pct = now.n1_pct[engine] if n1_known else nan
        n1_rate = n1_rate if n1_known else nan
        brochure = self._hand_overs[engine].step(t_ns, deck, n1_pct, n1_rate)
        return self._filters[engine].step(
            FusionInputs(
                t_ns=t_ns,
                mount_n=mounts.force_n,
                mount_std_n=mounts.std_n,
                brochure_n=brochure.thrust_n,
                brochure_std_n=brochure.std_n,
                n1_pct=n1_pct,
                n1_rate_pct_s=n1_rate,
                brochure_lag_n=brochure.lag_n,
                brochure_age_s=self._hold.age_s(t_ns, ENGINE_READINGS, engine),
                load_share=mounts.load_share,
                mount_extrapolating=any([state.extrapolating for state in mine]),
                brochure_extrapolating=deck.extrapolating,
                transient=deck.transient,
                gap=any([state.gap for state in mine]),
                one_mount=mounts.one_mount,
                load_factor_stale=not (isfinite(now.accel_x_g) and isfinite(now.accel_z_g)),
                status=verdict.status[engine] | self._troubles.bits(t_ns),
            )
        )
