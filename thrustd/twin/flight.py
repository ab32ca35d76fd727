"""A simulated flight on the real wire: serial frames of the ADC, CAN messages and ticks in order of arrival.

`fly` turns a profile (see `aircraft`) and an airframe into events block by block, so memory stays flat however long
the flight; `Truth` values travel between them for the log. Samples are taken on time; what arrives is late by the
wire and by a jittering reader, frames now and then come in two pieces, and the ADC's crystal runs 20 ppm fast.
"""

from bisect import bisect_left
from collections.abc import Iterator
from operator import itemgetter
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator

from thrustd.core.atmosphere import dynamic_pressure_pa
from thrustd.core.columns import Floats
from thrustd.core.types import Event, Frame
from thrustd.records.recording import MOST_FLIGHT_S, Recording
from thrustd.sinks.mcap_log import new_log
from thrustd.twin.aircraft import as_flown, scripted
from thrustd.twin.airframe import (
    ENGINES,
    MOUNTS,
    Airframe,
    carried_n,
    draw_airframe,
    mount_temperature_degc,
    rigged_mm,
    settled,
    thrust_shares_n,
)
from thrustd.twin.installation import PLAIN, Knobs, felt_g, seen_mm
from thrustd.twin.mount import advance
from thrustd.twin.sensors import lvdt_reading, to_counts
from thrustd.twin.streams import AdcStream, CanStream, TickStream
from thrustd.wire.can_frames import CanEncoder
from thrustd.wire.can_table import CanTable
from thrustd.wire.log_layout import LogHeader

BLOCK_S = 10.0
NODE_ID = 10
ACCEL_SIGNALS = ("accel_x_g", "accel_y_g", "accel_z_g")
RATE_SIGNALS = ("pitch_rate_deg_s", "roll_rate_deg_s", "yaw_rate_deg_s")  # where the aircraft's table has them
AIR_SIGNALS = ("mach", "pressure_altitude_m", "sat_degC", "tat_degC", "pitch_deg", "mark")
ENGINE_SIGNALS = ("n1_pct", "n2_pct", "fuel_flow_kg_s")
MOUNT_SIGNALS = ("temperature_degC", "vibration_mm_s")
NOISE = {  # one sigma of the sensor
    "mark": 0.0,  # a number that somebody types
    "accel_x_g": 0.002,
    "accel_y_g": 0.002,
    "accel_z_g": 0.003,
    "pitch_deg": 0.05,
    "pitch_rate_deg_s": 0.05,
    "roll_rate_deg_s": 0.05,
    "yaw_rate_deg_s": 0.05,
    "mach": 0.0004,
    "pressure_altitude_m": 1.0,
    "sat_degC": 0.1,
    "tat_degC": 0.1,
    "n1_pct": 0.05,
    "n2_pct": 0.05,
    "fuel_flow_kg_s": 0.0003,
    "temperature_degC": 0.2,
    "vibration_mm_s": 0.2,
}


class Rates(NamedTuple):
    """Samples per second."""

    adc_hz: float = 100.0
    accel_hz: float = 100.0
    engine_hz: float = 10.0
    air_hz: float = 10.0
    mount_hz: float = 1.0
    tick_hz: float = 20.0
    truth_hz: float = 20.0


class Truth(NamedTuple):
    """What really happened: thrust of an engine, or thrust share of a mount."""

    t_ns: int
    name: str
    value_n: float


RATES = Rates()


def scripted_flight(seconds: float, seed: int, knobs: Knobs = PLAIN) -> tuple[Recording, Airframe]:
    """Profile and airframe of a scripted flight."""
    airframe = draw_airframe(seed, knobs)
    return scripted(seconds, seed, airframe.healths), airframe


def recorded_flight(
    record: Recording, seed: int, engine_start: bool = False, knobs: Knobs = PLAIN
) -> tuple[Recording, Airframe]:
    """Profile and airframe of a flight along a real recording, or from the start of its engines on."""
    airframe = draw_airframe(seed, knobs)
    return as_flown(record.at_most(MOST_FLIGHT_S), airframe.healths, engine_start), airframe


def fly(
    profile: Recording,
    airframe: Airframe,
    table: CanTable,
    seed: int,
    rates: Rates = RATES,
    *,
    origin_ns: int = 0,
    flown: bool = False,
) -> Iterator[Event | Truth]:
    """Events and truths in order of arrival, the same for the same arguments.

    Monotonic time = `origin_ns` + the profile's own seconds.
    `flown`: on mounts that are not new, see `airframe.settled`.
    """
    encoder = CanEncoder(table, NODE_ID)
    yield from _Flight(profile, airframe, encoder, rates, _Start(seed, origin_ns, flown)).events()


def write_flight(
    path: Path,
    profile: Recording,
    airframe: Airframe,
    table: CanTable,
    header: LogHeader,
    seed: int,
    rates: Rates = RATES,
) -> None:
    """The flight as a log: raw events and truth, no outputs. Written whole or not at all."""
    with new_log(path, header) as log:
        for item in fly(profile, airframe, table, seed, rates):
            if isinstance(item, Truth):
                log.write_truth(item.name, item.t_ns, item.value_n)
            else:
                log.write_event(item)


class _Start(NamedTuple):
    """How a flight begins."""

    seed: int
    origin_ns: int
    flown: bool


class _Flight:
    """State of a flight under way: mounts, streams, what waits for the next block."""

    def __init__(
        self, profile: Recording, airframe: Airframe, encoder: CanEncoder, rates: Rates, start: _Start
    ) -> None:
        origin_ns = start.origin_ns
        self._airframe, self._rates, self._origin_ns = airframe, rates, origin_ns
        self._start_s = float(profile.time_s[0])
        self._duration_s = profile.duration_s
        self._lines = _lines(profile, airframe.knobs)
        self._rng = np.random.default_rng([start.seed, 5])
        self._adc = AdcStream(origin_ns, self._rng)
        self._ticks = TickStream(origin_ns, self._rng)
        self._can = [
            (quantity, CanStream(quantity.signal, quantity.number, encoder, origin_ns, self._rng))
            for quantity in _quantities(rates, self._lines)
            if encoder.says(quantity.signal, quantity.number)
        ]
        self._turning = np.random.default_rng([start.seed, 9])  # apart: what else is drawn is the same without rates
        self._can += [
            (Quantity(name, 0, name, rates.air_hz), CanStream(name, 0, encoder, origin_ns, self._turning))
            for name in RATE_SIGNALS
            if encoder.says(name, 0)
        ]
        self._states = settled(airframe, self._loads_n(profile.time_s[:1])[:, 0], start.flown)
        self._rigged_mm = rigged_mm(airframe)

    def events(self) -> Iterator[Event | Truth]:
        """Block by block; what arrives after a block's end waits for the next."""
        waiting: list[Event | Truth] = []
        for begin_s in np.arange(0.0, self._duration_s, BLOCK_S).tolist():
            end_s = min(begin_s + BLOCK_S, self._duration_s)
            items = waiting + self._block(begin_s, end_s)
            items.sort(key=itemgetter(0))
            cut = bisect_left(items, self._origin_ns + round((self._start_s + end_s) * 1e9), key=itemgetter(0))
            yield from items[:cut]
            waiting = items[cut:]
        yield from waiting

    def _block(self, begin_s: float, end_s: float) -> list[Event | Truth]:
        items: list[Event | Truth] = []
        items += self._mounts(self._grid(begin_s, end_s, self._rates.adc_hz))
        items += self._ticks.block(self._grid(begin_s, end_s, self._rates.tick_hz))
        for quantity, stream in self._can:
            sample_s = self._grid(begin_s, end_s, quantity.rate_hz, quantity.phase)
            values = self._line(f"felt_{quantity.line}" if quantity.line in ACCEL_SIGNALS else quantity.line, sample_s)
            rng = self._turning if quantity.signal in RATE_SIGNALS else self._rng
            values = values + NOISE[quantity.signal] * rng.standard_normal(len(sample_s))
            items += stream.block(sample_s, values)
        return items + self._truths(self._grid(begin_s, end_s, self._rates.truth_hz))

    def _grid(self, begin_s: float, end_s: float, rate_hz: float, phase: float = 0.0) -> Floats:
        """Sample times of one rate in [begin, end) of the flight; `phase` in samples."""
        first, last = (int(np.ceil(round(edge_s * rate_hz - phase, 6))) for edge_s in (begin_s, end_s))
        return np.asarray(self._start_s + (np.arange(first, last) + phase) / rate_hz, dtype=np.float64)

    def _line(self, name: str, sample_s: Floats) -> Floats:
        return np.asarray(self._lines[name](sample_s), dtype=np.float64)

    def _thrust_n(self, sample_s: Floats) -> Floats:
        return np.stack([self._line(f"thrust_N_{engine}", sample_s) for engine in ENGINES])

    def _loads_n(self, sample_s: Floats) -> Floats:
        accel_g = np.stack([self._line(name, sample_s) for name in ACCEL_SIGNALS])
        pressure_pa = self._line("dynamic_pressure_Pa", sample_s)
        return carried_n(self._airframe, self._thrust_n(sample_s), accel_g, pressure_pa)

    def _mounts(self, sample_s: Floats) -> list[Frame]:
        """Load the mounts, read the LVDTs, send the frames."""
        accel_z_g, loads_n = self._line("accel_z_g", sample_s), self._loads_n(sample_s)
        counts = np.empty((len(sample_s), len(MOUNTS)), dtype=np.int32)
        for number, mount in enumerate(self._airframe.mounts):
            warm_degc = self._line(f"temperature_degC_{ENGINES[number // 2]}", sample_s)
            true_mm = advance(
                mount, self._states[number], loads_n[number], 1 / self._rates.adc_hz, warm_degc, accel_z_g
            )
            lvdt = self._airframe.lvdts[number]
            seen = seen_mm(number, true_mm - self._rigged_mm[number], warm_degc, self._airframe.knobs)
            counts[:, number] = to_counts(lvdt, lvdt_reading(lvdt, seen, self._rng))
        return self._adc.block(sample_s, counts)

    def _truths(self, sample_s: Floats) -> list[Truth]:
        thrust_n = self._thrust_n(sample_s)
        rows = dict(zip(ENGINES, thrust_n, strict=True))
        rows |= dict(zip(MOUNTS, thrust_shares_n(self._airframe, thrust_n), strict=True))
        times_ns = (self._origin_ns + np.rint(sample_s * 1e9).astype(np.int64)).tolist()
        return [
            Truth(t_ns, name, value_n)
            for name, row in rows.items()
            for t_ns, value_n in zip(times_ns, row.tolist(), strict=True)
        ]


class Quantity(NamedTuple):
    """One signal on the bus."""

    signal: str
    number: int  # of the engine or mount
    line: str  # which column of the profile it follows
    rate_hz: float
    phase: float = 0.0  # of a sample, so that not everything is sent at once


def _lines(profile: Recording, knobs: Knobs) -> dict[str, PchipInterpolator]:
    """Every column as a smooth, monotone line between its samples, the mounts' surroundings added."""
    columns = {name: column for name, column in profile.channels.items() if np.isfinite(column).all()}
    air = zip(profile["mach"].tolist(), profile["pressure_altitude_m"].tolist(), strict=True)
    columns["dynamic_pressure_Pa"] = np.array([dynamic_pressure_pa(*each) for each in air])
    accel_g = np.stack([columns[name] for name in ACCEL_SIGNALS])
    rates_deg_s = body_rates_deg_s(profile)
    columns |= dict(zip(RATE_SIGNALS, rates_deg_s, strict=True))
    felt = felt_g(accel_g, rates_deg_s, profile.time_s, knobs)
    columns |= {f"felt_{name}": row for name, row in zip(ACCEL_SIGNALS, felt, strict=True)}
    for engine in ENGINES:
        columns[f"temperature_degC_{engine}"] = mount_temperature_degc(profile, engine)
        columns[f"vibration_mm_s_{engine}"] = vibration_mm_s(profile, engine)
    return {name: PchipInterpolator(profile.time_s, column) for name, column in columns.items()}


def vibration_mm_s(profile: Recording, engine: str) -> Floats:
    """At the mounts of an engine (n,): of its fan, without an effect on them."""
    return 1.0 + 9.0 * np.clip(profile[f"n1_pct_{engine}"] / 100, 0, 1.2) ** 2


def body_rates_deg_s(profile: Recording) -> Floats:
    """Pitch, roll and yaw rate (3, n): as recorded, else pitch's own slope and none."""
    still = np.zeros(len(profile))
    pitching = np.gradient(profile["pitch_deg"], profile.time_s) if "pitch_deg" in profile else still
    derived = zip(RATE_SIGNALS, (pitching, still, still), strict=True)
    return np.stack([profile.channels.get(name, column) for name, column in derived])


def _quantities(rates: Rates, lines: dict[str, PchipInterpolator]) -> list[Quantity]:
    """The bus schedule of ICD section 2, without what the profile does not know."""
    rows = [(signal, 0, signal, rates.accel_hz) for signal in ACCEL_SIGNALS]
    rows += [(signal, 0, signal, rates.air_hz) for signal in AIR_SIGNALS]
    for number, engine in enumerate(ENGINES):
        rows += [(signal, number, f"{signal}_{engine}", rates.engine_hz) for signal in ENGINE_SIGNALS]
    for number in range(len(MOUNTS)):
        engine = ENGINES[number // 2]
        rows += [(signal, number, f"{signal}_{engine}", rates.mount_hz) for signal in MOUNT_SIGNALS]
    known = [row for row in rows if row[2] in lines]
    return [Quantity(*row, phase=number / len(known)) for number, row in enumerate(known)]
