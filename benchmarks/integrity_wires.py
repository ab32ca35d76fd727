"""The campaign's faults of wires, bus and machine: frames and messages that do not come, come wrong or come twice.

They end after some seconds; the flight is watched until the estimate is back. Each must be reported by its kind and
show its status bit.
"""

from collections.abc import Callable, Iterator
from struct import pack

import numpy as np

from benchmarks.integrity_cases import Case
from benchmarks.integrity_edits import BOTH_ENGINES, Edit, Speaking, Stream, gain, opened, says, scattered
from thrustd.core.columns import Floats
from thrustd.core.types import Event, Fault, Frame, Status

ENDS_S, BACK_S = 5.0, 15.0  # of a fault; afterwards
MOMENTS = ("take-off roll", "cruise", "throttle up")
N1_LEFT, MACH, ACCELERATIONS = 500, 318, (300, 301, 302)  # identifiers of the ICD


def _is_adc(event: Event) -> bool:
    return isinstance(event, Frame) and event.channel == "adc"


def _is_can(event: Event, *idents: int) -> bool:
    return isinstance(event, Frame) and event.channel == "can" and (not idents or event.ident in idents)


def _each(change: Callable[[int, Frame], list[Event]], which: Callable[[Event], bool]) -> Stream:
    """Replaces every chosen event in the window; `change(n, event)` counts them from 0."""

    def edit(events: list[Event], begin_ns: int, end_ns: int) -> Iterator[Event]:
        n = 0
        for event in events:
            if event.t_ns < end_ns and which(event):
                assert isinstance(event, Frame)
                yield from change(n, event)
                n += 1
            else:
                yield event

    return edit


def _less(one_in: int, which: Callable[[Event], bool]) -> Stream:
    return _each(lambda n, event: [] if n % one_in == 0 else [event], which)


def _told(where: str, begins: tuple[str, ...], ends: str, edit: Stream) -> Stream:
    """The edit, with the faults that the source itself reports before and after; `ends`: that one is over then."""

    def both(events: list[Event], begin_ns: int, end_ns: int) -> Iterator[Event]:
        yield from (Fault(begin_ns, where, kind) for kind in begins)
        after = [Fault(end_ns, where, ends, active=False)] if ends else []
        for event in edit(events, begin_ns, end_ns):
            if after and event.t_ns >= end_ns:
                yield after.pop()
            yield event

    return both


def _late(events: list[Event], begin_ns: int, end_ns: int) -> Iterator[Event]:
    """Every tenth frame comes again three frames later."""
    held: list[tuple[int, bytes]] = []
    n = 0
    for event in events:
        yield event
        if event.t_ns < end_ns and isinstance(event, Frame) and _is_adc(event):
            n += 1
            if n % 10 == 0:
                held.append((n + 3, event.data))
            if held and held[0][0] == n:
                yield event._replace(data=held.pop(0)[1])


def _flip(n: int, event: Frame) -> list[Event]:
    """Every fifth frame with one bit changed."""
    if n % 5:
        return [event]
    at = 3 + n % (len(event.data) - 5)
    return [event._replace(data=event.data[:at] + bytes([event.data[at] ^ 0x10]) + event.data[at + 1 :])]


def _noise(n: int, event: Frame) -> list[Event]:
    """Junk between the frames."""
    junk = bytes((7 * n + 13 * k) % 256 for k in range(n % 40))
    return [event._replace(data=junk), event]


def _impostor(_: int, event: Frame) -> list[Event]:
    """Another node says something else under the same identifier."""
    other = bytes([event.data[0] ^ 0x55]) + event.data[1:4] + pack(">f", 0.9)
    return [event, event._replace(data=other)]


def _unchanged(events: list[Event], begin_ns: int, end_ns: int) -> Iterator[Event]:
    yield from events


def _shed(events: list[Event], begin_ns: int, end_ns: int) -> Iterator[Event]:
    """What a full queue throws away, and its count."""
    gone = sum(event.t_ns < end_ns for event in events)
    yield Fault(end_ns, "queue", "overrun", count=gone)
    yield from events[gone:]


def _all(value: float) -> Speaking:
    return lambda _, values: np.full_like(values, value)


def _scattered(_: Floats, values: Floats) -> Floats:
    """Anything between nothing and three times what it was."""
    return np.random.default_rng(7).uniform(0.0, 3.0 * values.mean(), len(values))


def _case(fault: str, edit: Edit | Stream, kinds: str, bits: Status, lasts_s: float = ENDS_S) -> list[Case]:
    """One case at each moment."""
    whole = (edit if isinstance(edit, Edit) else Edit(stream=edit))._replace(lasts_s=lasts_s)
    return [
        Case(fault, moment, whole, (), lasts_s + BACK_S, kinds=frozenset(kinds.split()), bits=bits)
        for moment in MOMENTS
    ]


WIRES: tuple[Case, ...] = (
    *_case("serial unplugged and back", _told("adc", ("unplugged",), "unplugged", _less(1, _is_adc)),
           "unplugged", Status.LINK_LOST),
    *_case("ADC silent", _less(1, _is_adc), "silent lost", Status.MOUNT_LOST),
    *_case("ADC reset", Edit(restarts=True), "reset", Status.WIRE_FAULT),
    *_case("frames lost", _less(5, _is_adc), "lost", Status.WIRE_FAULT),
    *_case("frames repeated", _each(lambda _, event: [event, event], _is_adc), "late", Status.WIRE_FAULT),
    *_case("frames late", _late, "late", Status.WIRE_FAULT),
    *_case("bits flipped (CRC)", _each(_flip, _is_adc), "damaged", Status.WIRE_FAULT),
    *_case("junk between frames", _each(_noise, _is_adc), "damaged", Status.WIRE_FAULT),
    *_case("channel open", opened((1,)), "open", Status.CHANNEL_OPEN),
    *_case("all channels open", opened(BOTH_ENGINES), "open", Status.CHANNEL_OPEN),
    *_case("one transducer scatters", scattered((1,), -1.0, 2.0), "noisy", Status.SENSOR_EXCLUDED, 60.0),
    *_case("all transducers scatter", scattered(BOTH_ENGINES, -1.0, 2.0), "noisy", Status.SENSOR_EXCLUDED, 60.0),
    *_case("fuel flow scatters", says("fuel_flow_kg_s", 0, _scattered), "noisy", Status.SENSOR_EXCLUDED, 60.0),
    *_case("outside the model's range", gain(BOTH_ENGINES, 40.0), "offset failed out_of_range",
           Status.MODEL_EXTRAPOLATING),
    *_case("CAN bus-off and back", _told("can", ("bus_error", "unplugged"), "unplugged", _less(1, _is_can)),
           "unplugged", Status.LINK_LOST),
    *_case("N1 missing", _less(1, lambda event: _is_can(event, N1_LEFT)), "stale", Status.SIGNAL_STALE),
    *_case("accelerations missing", _less(1, lambda event: _is_can(event, *ACCELERATIONS)), "stale",
           Status.LOAD_FACTOR_STALE),
    *_case("N1 out of range", says("n1_pct", 0, _all(30_000.0)), "out_of_range", Status.OUT_OF_RANGE),
    *_case("Mach not a number", says("mach", 0, _all(np.nan)), "out_of_range", Status.OUT_OF_RANGE),
    *_case("CAN messages lost", _less(3, _is_can), "lost", Status.WIRE_FAULT),
    *_case("two nodes, one identifier", _each(_impostor, lambda event: _is_can(event, MACH)), "contested",
           Status.WIRE_FAULT),
    *_case("calendar clock steps", _told("clock", ("clock_step",), "", _unchanged), "clock_step", Status.CLOCK_STEP),
    *_case("disk refuses", _told("log", ("not_recorded",), "not_recorded", _unchanged), "not_recorded",
           Status.NOT_RECORDING),
    *_case("disk too slow", _told("log", ("overrun",), "", _unchanged), "overrun", Status.OVERLOAD),
    *_case("live view fails", _told("live_view", ("not_sent",), "", _unchanged), "not_sent", Status.OUTPUT_FAULT),
    *_case("queue overrun", _shed, "overrun", Status.OVERLOAD, 2.0),
)  # fmt: skip
