"""A twin's flight as it is on the wire, kept in columns so that a fault can be written into it from any moment on."""

from collections.abc import Iterator
from heapq import merge
from struct import Struct
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from benchmarks.fusion_flights import FLIGHTS, part
from benchmarks.integrity_edits import Changing, Channel, Edit, Surroundings
from tests.wire.one_by_one import AdcSample, adc_items
from thrustd.core.atmosphere import dynamic_pressure_pa
from thrustd.core.columns import CHANNEL_FAULT, Floats
from thrustd.core.types import Event, Frame, Tick
from thrustd.installation.installation import Installation
from thrustd.records.recording import Recording
from thrustd.twin.airframe import Airframe
from thrustd.twin.flight import Rates, Truth, fly, recorded_flight, scripted_flight
from thrustd.twin.sensors import COUNT_LIMIT, COUNT_MM
from thrustd.wire.adc_frames import AdcDecoder, encode
from thrustd.wire.can_frames import CanEncoder

Integers = npt.NDArray[np.int64]
S = 1_000_000_000
RATES = Rates()
VALUE = Struct(">f")
GROUND_S = 200.0  # before the aircraft flies, behind an engine start
FLYING_MACH, AIRBORNE_MACH = 0.12, 0.2
IDLE_N1_PCT, HIGH_N1_PCT = 45.0, 70.0
MOMENTS = ("begin", "started", "ground idle", "take-off roll", "cruise", "flight idle", "throttle up")


class Wire(NamedTuple):
    """Events in the order of their arrival, what is in them as numbers."""

    t_ns: Integers  # (n_events,)
    kind: npt.NDArray[np.int8]  # 0 tick, 1 ADC, 2 bus
    adc: Integers  # (n_samples, 2 + channels): sequence, device time, counts
    bus: list[Frame]


class Flight(NamedTuple):
    name: str
    profile: Recording
    wire: Wire
    idents: dict[Channel, int]  # of the bus
    moments_s: dict[str, float]  # time of the profile


def flight(place: Installation, number: int, seed: int, seconds: float) -> Flight:
    """A recording flown by one twin aircraft behind an engine start; scripted when it is not at hand."""
    record = part(FLIGHTS[number], GROUND_S, seconds)
    if record is not None:
        profile, airframe = recorded_flight(record, seed, engine_start=True)
    else:
        profile, airframe = scripted_flight(seconds, seed)
    return on_the_wire(place, profile, airframe, seed)


def on_the_wire(place: Installation, profile: Recording, airframe: Airframe, seed: int, rates: Rates = RATES) -> Flight:
    table = place.parts().can_table
    encoder = CanEncoder(table, 0)
    idents = {
        (field.signal, field.index): encoder.encode(field.signal, field.index, 1.0)[0]
        for message in table.messages.values()
        for field in message.fields
    }
    events = (event for event in fly(profile, airframe, table, seed, rates) if not isinstance(event, Truth))
    return Flight(profile.name, profile, _columns(events), idents, moments(profile))


def _columns(events: Iterator[Event]) -> Wire:
    """Frames in pieces are put together again, at the arrival of their end."""
    decoder, times, kinds, samples, bus = AdcDecoder(4, 100.0), [], [], [], []
    for event in events:
        match event:
            case Tick():
                kinds.append(0)
            case Frame(channel="adc"):
                found = [
                    sample for sample in adc_items(decoder, event.t_ns, event.data) if isinstance(sample, AdcSample)
                ]
                if not found:
                    continue
                kinds.append(1)
                samples.append((found[0].sequence, found[0].device_time_us, *found[0].counts))
            case Frame():
                kinds.append(2)
                bus.append(event)
        times.append(event.t_ns)
    return Wire(np.array(times), np.array(kinds, np.int8), np.array(samples), bus)


def moments(profile: Recording) -> dict[str, float]:
    """When in the profile the moments of the campaign are; those that this flight does not have are left out."""
    time_s, mach = profile.time_s, profile["mach"]
    n1_pct = np.minimum(profile["n1_pct_left"], profile["n1_pct_right"])
    flying = mach > AIRBORNE_MACH
    running_s = float(time_s[int(np.argmax(n1_pct > 0.9 * np.median(n1_pct[mach < FLYING_MACH][-600:])))])
    roll_s = float(time_s[int(np.argmax((n1_pct > HIGH_N1_PCT) & (time_s > running_s)))])
    found = {"begin": float(time_s[0]) + 1.0, "started": running_s + 30.0, "take-off roll": roll_s}
    found["ground idle"] = max(roll_s - 60.0, running_s + 60.0)
    airborne_s = float(time_s[int(np.argmax(flying))])
    found["cruise"] = airborne_s + 420.0
    idle = flying & (n1_pct < IDLE_N1_PCT) & (time_s > airborne_s + 60.0)
    if idle.any():
        found["flight idle"] = float(time_s[int(np.argmax(idle))])
    up = flying & (n1_pct > HIGH_N1_PCT) & (time_s > found.get("flight idle", airborne_s + 500.0))
    if up.any():
        found["throttle up"] = float(time_s[int(np.argmax(up))]) - 4.0
    return {name: found[name] for name in MOMENTS if name in found}


def whole(flight: Flight, first: int, last: int) -> list[Event]:
    """Events [first, last) as they came."""
    wire = flight.wire
    samples, messages = int(np.sum(wire.kind[:first] == 1)), int(np.sum(wire.kind[:first] == 2))
    out: list[Event] = []
    for t_ns, kind in zip(wire.t_ns[first:last].tolist(), wire.kind[first:last].tolist(), strict=True):
        if kind == 0:
            out.append(Tick(t_ns))
        elif kind == 1:
            out.append(_adc_frame(t_ns, wire.adc[samples]))
            samples += 1
        else:
            out.append(wire.bus[messages])
            messages += 1
    return out


def _adc_frame(t_ns: int, row: Integers) -> Frame:
    sequence, device_us, *counts = row.tolist()
    return Frame(t_ns, "adc", 0, encode(sequence, device_us, tuple(counts)))


def damaged(flight: Flight, edit: Edit, first: int, last: int) -> list[Event]:
    """Events [first, last) with the fault in them from the first on."""
    events = whole(flight, first, last)
    begin_ns = int(flight.wire.t_ns[first])
    if edit.mounts is not None or edit.slow or edit.restarts:
        events = _edit_adc(flight, edit, events, begin_ns)
    for channel, change in edit.bus.items():
        _edit_bus(flight, events, flight.idents[channel], begin_ns, change, edit.lasts_s)
    if edit.swapped is not None:
        one, other = (flight.idents[channel] for channel in edit.swapped)
        names = {one: other, other: one}
        events = [
            event._replace(ident=names[event.ident])
            if isinstance(event, Frame) and event.channel == "can" and event.ident in names
            else event
            for event in events
        ]
    if edit.stream is not None:
        events = list(edit.stream(events, begin_ns, begin_ns + round(edit.lasts_s * S)))
    return events


def _around(flight: Flight, time_s: Floats) -> Surroundings:
    columns = flight.profile
    mach, altitude_m, accel_g, sat_degc = (
        np.interp(time_s, columns.time_s, columns[name])
        for name in ("mach", "pressure_altitude_m", "accel_z_g", "sat_degC")
    )
    pressure_pa = np.array([dynamic_pressure_pa(*air) for air in zip(mach.tolist(), altitude_m.tolist(), strict=True)])
    return Surroundings(pressure_pa, accel_g, sat_degc + 273.15 + 40.0, mach)


def _edit_adc(flight: Flight, edit: Edit, events: list[Event], begin_ns: int) -> list[Event]:
    """A fast crystal takes later samples into the same time, up to the last of the flight."""
    of_adc, end_ns = flight.wire.kind == 1, events[-1].t_ns
    until_ns = max(end_ns, begin_ns + round((end_ns - begin_ns) / (1.0 + edit.slow)))
    first, last = np.searchsorted(flight.wire.t_ns[of_adc], (begin_ns, until_ns + 1)).tolist()
    times_ns, rows = flight.wire.t_ns[of_adc][first:last], flight.wire.adc[first:last].copy()
    mm, time_s = np.asarray(rows[:, 2:] * COUNT_MM, np.float64), (times_ns - begin_ns) / S
    if edit.slow:
        late_s = time_s * (1.0 + edit.slow)
        mm = np.stack([np.interp(late_s, time_s, column) for column in mm.T], axis=1)
        times_ns, time_s = begin_ns + np.rint(late_s * S).astype(np.int64), late_s
    if edit.mounts is not None:
        said_mm = edit.mounts(time_s, mm, _around(flight, np.asarray(times_ns / S, np.float64)))
        mm = np.where(time_s[:, None] < edit.lasts_s, said_mm, mm)
    counts = np.clip(np.rint(mm / COUNT_MM), -COUNT_LIMIT - 1, COUNT_LIMIT)
    rows[:, 2:] = np.where(np.isnan(mm), CHANNEL_FAULT, counts).astype(np.int64)
    if edit.restarts:
        rows[:, :2] -= rows[0, :2]
    frames = [_adc_frame(t_ns, row) for t_ns, row in zip(times_ns.tolist(), rows, strict=True)]
    others = [event for event in events if not isinstance(event, Frame) or event.channel != "adc"]
    end_ns = min(end_ns, frames[-1].t_ns)
    return [event for event in merge(others, frames, key=lambda event: event.t_ns) if event.t_ns <= end_ns]


def _edit_bus(flight: Flight, events: list[Event], ident: int, begin_ns: int, change: Changing, lasts_s: float) -> None:
    mine = [
        (i, event)
        for i, event in enumerate(events)
        if isinstance(event, Frame) and event.channel == "can" and event.ident == ident
    ]
    time_ns = np.array([event.t_ns for _, event in mine])
    values = np.array([VALUE.unpack(event.data[4:])[0] for _, event in mine])
    time_s = (time_ns - begin_ns) / S
    said = change(time_s, values, _around(flight, np.asarray(time_ns / S, np.float64)))
    for (i, event), value in zip(mine, np.where(time_s < lasts_s, said, values).tolist(), strict=True):
        events[i] = event._replace(data=event.data[:4] + VALUE.pack(value))
