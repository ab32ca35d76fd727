"""From batches of events to samples in the models and readings in the hold; faults, and instants for fused steps.

    bus columns -> CanDecoder -> readings ─┐
    serial columns -> AdcDecoder -> samples ┴─ Grid.align, in the order of arrival -> hold, mount sources

What comes out does not depend on how events were batched.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from thrustd.core.calibration import MountCalibration
from thrustd.core.columns import SEQUENCE, SLOT, Flags, Integers
from thrustd.core.config import Config
from thrustd.core.signals import CATALOGUE
from thrustd.core.types import Fault
from thrustd.fusion.settings import FusionSettings
from thrustd.model.compile import CompiledModel
from thrustd.mounts.source import MountSource
from thrustd.sync import align
from thrustd.sync.grid import Grid
from thrustd.sync.hold import Hold
from thrustd.wire.adc_frames import AdcDecoder
from thrustd.wire.can_decoder import CanDecoder
from thrustd.wire.can_table import CanTable
from thrustd.wire.event_batch import EventBatch

BUS = "can"  # channel of the frames that are CAN messages; all others are bytes of the ADC
LONGEST_PAUSE_S = 60.0  # of a warm restart; the models step through it when the first sample comes
NEVER = (-1, -1)
_NO_NUMBERS = np.zeros(0, np.int64)
NO_EVENTS = (_NO_NUMBERS, _NO_NUMBERS, np.zeros(0, np.uint8), _NO_NUMBERS, np.zeros(0, np.bool_))
FAULTY = (align.OTHER_EVENT, align.CAN_FAULT, align.ADC_FAULT, align.READING_OUTSIDE, align.SAMPLE_OUTSIDE)
Sensor = tuple[str, int]


class Intake:
    """Mutable. `take` is its life; between two of its words whoever listens makes the fused step that is due."""

    def __init__(
        self,
        config: Config,
        models: tuple[CompiledModel, ...],
        can_table: CanTable,
        settings: FusionSettings,
        calibrations: Sequence[MountCalibration] = (),
    ) -> None:
        self._config = config
        self._adc = AdcDecoder(config.adc.channels, config.adc.sample_hz)
        self._can = CanDecoder(can_table)
        self._no_readings = self._can.decode(*NO_EVENTS)
        self.hold = Hold(self._can.slots)
        self._listeners = _listeners(config, models)
        self._grid = self._new_grid(models)
        self._fused_ns = self._grid.state["fused_ns"]
        bridge = round(config.steps.bridge_gap_ms * 1e-3 * config.adc.sample_hz)
        known = calibrations or [MountCalibration()] * len(models)
        self.service_s = [3600.0 * mount.service_h for mount in known]  # by mount, with its engine running
        self.sources = tuple(
            MountSource(model, bridge, self._grid, number, settings, known[number])
            for number, model in enumerate(models)
        )
        self.states = self._grid.states  # MOUNT_STATE by mount, of the last fused step
        self._left_out: dict[tuple[str, ...], tuple[Flags, Flags]] = {}  # kinds not of the bus, not of the ADC
        self._resume_from = NEVER  # time and sequence of the last sample before a warm restart

    @property
    def fused_ns(self) -> int:
        """Instant of the last fused step; -1 before the first."""
        return self._fused_ns.item()

    @fused_ns.setter
    def fused_ns(self, t_ns: int) -> None:
        self._fused_ns[0] = t_ns

    @property
    def sample(self) -> list[int]:
        """Time and sequence of the last ADC sample; -1 before the first."""
        return [self._grid.state["t_ns"].item(), self._grid.state["sequence"].item()]

    @property
    def clock_rate(self) -> float:
        """By which our clock runs faster than the ADC's crystal, s/s."""
        return self._grid.clock_rate

    def next_step_ns(self) -> int:
        """When the sample of the next fused step is expected, by the ADC's own count; past while the ADC is silent."""
        state = self._grid.state
        missing: int = state["next_step"].item() - state["sequence"].item()
        t_ns: int = state["t_ns"].item()
        return t_ns + round(missing * 1e9 / self._config.adc.sample_hz)

    def take(self, batch: EventBatch) -> Iterator[Fault | int]:
        """Faults, and instants [ns] at which a fused step is due, in the order in which the events call for them."""
        not_bus, not_adc = self._left_out.get(batch.channels) or self._sort(batch.channels)
        readings, values = self._no_readings
        if BUS in batch.channels:
            readings, values = self._can.decode(batch.t_ns, batch.ident, batch.data, batch.ends, not_bus[batch.kind])
        samples = self._adc.decode(batch.t_ns, batch.data, batch.ends, not_adc[batch.kind])
        grid = self._grid
        grid.begin()
        while (stop := grid.align(batch.t_ns, batch.kind, readings, values, samples)) != align.DONE:
            if stop == align.FUSE:
                yield max(grid.state["due_ns"].item(), self.fused_ns + 1)
            elif stop in FAULTY:
                yield from self._faults(stop, batch, readings, samples)
            elif stop == align.CATCH_UP:
                *_, sample, mount = grid.place.tolist()
                self.sources[mount].catch_up(samples.item(sample, SEQUENCE), grid.state["offered_mm"].item())
            elif stop == align.RESUME:
                self._resume(*self.sample)
            else:  # no more room for samples
                for source in self.sources:
                    source.flush()

    def is_wanted(self, sensor: Sensor) -> bool:
        """Some model listens to it."""
        return sensor in self._listeners

    def tell(self, sensor: Sensor, value: float) -> None:
        """A value for the models' effects; NaN = not measured any more, they go back to the resting value."""
        for mount, position in self._listeners.get(sensor, ()):
            self.sources[mount].set_channel(position, value)

    def pass_time(self, dt_s: float, mounts: Sequence[int]) -> None:
        """The mounts' own clocks, which go on over power cycles: `dt_s` more in service for these."""
        for mount in mounts:
            self.service_s[mount] += dt_s
        for mount, position in self._listeners.get(("time_s", 0), ()):
            self.sources[mount].set_channel(position, self.service_s[mount])

    def trust(self, all_but: frozenset[Sensor]) -> None:
        """Readings that models hear from now on."""
        self.hold.held["trusted"] = [slot not in all_but for slot in self.hold.slots]

    def resume_from(self, sample: tuple[int, int], readings_at_ns: int, without: frozenset[Sensor]) -> None:
        """After a warm restart: the last sample of before, and the readings that are still good for the models."""
        self._resume_from = sample
        self._grid.state["resuming"] = 1
        self.trust(without)
        for signal, index in self._listeners:
            if (signal, index) not in without:
                self.tell((signal, index), self.hold.value(readings_at_ns, signal, index))

    def _faults(self, stop: int, batch: EventBatch, readings: Integers, samples: Integers) -> list[Fault]:
        """What alignment met just now; the places are behind it."""
        event, reading, sample, mount = self._grid.place.tolist()
        if stop == align.OTHER_EVENT:
            other = batch.event(event - 1)
            return [other] if isinstance(other, Fault) else []
        if stop == align.SAMPLE_OUTSIDE:
            return [Fault(self.sample[0], self._config.mount[mount - 1].name, "out_of_range")]
        t_ns = batch.t_ns.item(event)
        if stop == align.CAN_FAULT:
            return [self._can.fault(t_ns, readings[reading - 1])]
        if stop == align.ADC_FAULT:
            return [self._adc.fault(t_ns, samples[sample - 1])]
        return [self.hold.outside(t_ns, readings.item(reading - 1, SLOT))]

    def _resume(self, t_ns: int, sequence: int) -> None:
        """The first sample after a warm restart: how many instants nobody saw."""
        saved_ns, last = self._resume_from
        sample_hz = self._config.adc.sample_hz
        missing = max(round((t_ns - saved_ns) * 1e-9 * sample_hz) - 1, 0)
        if saved_ns >= 0 and missing <= LONGEST_PAUSE_S * sample_hz:
            for source in self.sources:
                source.resume(last, sequence - missing - 1 - last)

    def _new_grid(self, models: tuple[CompiledModel, ...]) -> Grid:
        steps, adc = self._config.steps, self._config.adc
        heard = [(self.hold.place(*sensor), *ear) for sensor, ears in self._listeners.items() for ear in ears]
        most = max(len(model.channels) - 1 for model in models)
        listeners = np.array([row for row in heard if row[0] >= 0], np.int64).reshape(-1, 3)
        grid = Grid(len(models), most, round(adc.sample_hz / steps.estimate_hz), self.hold, listeners)
        grid.state["step_ns"] = round(1e9 / steps.estimate_hz)
        for row, mount in zip(grid.mounts, self._config.mount, strict=True):
            row["channel"], row["scale_mm"], row["offset_mm"] = mount.adc_channel, mount.scale_mm, mount.offset_mm
        return grid

    def _sort(self, channels: tuple[str, ...]) -> tuple[Flags, Flags]:
        """Which kinds of events are not of the bus, and which not of the ADC."""
        of_bus, of_adc = np.zeros((2, 256), np.bool_)
        of_bus[: len(channels)] = [name == BUS for name in channels]
        of_adc[: len(channels)] = [name != BUS for name in channels]
        if len(self._left_out) < 16:  # names that fill memory would be no names
            self._left_out[channels] = ~of_bus, ~of_adc
        return ~of_bus, ~of_adc


def _listeners(config: Config, models: tuple[CompiledModel, ...]) -> Mapping[Sensor, list[tuple[int, int]]]:
    """Which mount's model wants which reading, as which of its channels."""
    engines = config.aircraft.engines
    listeners: dict[Sensor, list[tuple[int, int]]] = {}
    for number, (mount, model) in enumerate(zip(config.mount, models, strict=True)):
        for position, name in enumerate(model.channels[1:]):
            if name == "deformation_mm":  # the mount's own
                continue
            index = {"aircraft": 0, "engine": engines.index(mount.engine), "mount": number}[CATALOGUE[name].scope]
            listeners.setdefault((name, index), []).append((number, position))
    return listeners
