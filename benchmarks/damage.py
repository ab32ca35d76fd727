"""A good log made bad: every fault an installation may have, as an edit of its events between two instants.

Each edit takes the events of a flight and a window [begin_ns, end_ns) and hands out the damaged flight. ADC frames in
pieces are whole again first (`whole_frames`), so that an edit may count and change them.
"""

from collections.abc import Callable, Iterable, Iterator
from struct import pack, unpack
from typing import NamedTuple

from cobs import cobs

from thrustd.core.columns import CHANNEL_FAULT
from thrustd.core.types import Event, Fault, Frame, Status
from thrustd.wire.adc_frames import encode

Edit = Callable[[list[Event], int, int], Iterator[Event]]
_ADC_HEAD = 8
N1_LEFT, FUEL_LEFT, MACH, ACCEL_X = 500, 524, 318, 300


class Case(NamedTuple):
    """One fault of the matrix and what must be seen of it."""

    name: str
    edit: Edit
    lasts_s: float
    kinds: frozenset[str]  # fault kinds of which at least one is reported
    status: Status  # bits of which at least one is on during the fault
    engines: tuple[int, ...] = (0, 1)  # whose status is looked at


def whole_frames(events: Iterable[Event]) -> list[Event]:
    """The same events with every ADC frame in one piece."""
    out: list[Event] = []
    rest = b""
    for event in events:
        if not (isinstance(event, Frame) and event.channel == "adc"):
            out.append(event)
            continue
        *frames, rest = (rest + event.data).split(b"\0")
        out += [event._replace(data=data + b"\0") for data in frames]
    return out


def is_adc(event: Event) -> bool:
    return isinstance(event, Frame) and event.channel == "adc"


def is_can(event: Event, *idents: int) -> bool:
    return isinstance(event, Frame) and event.channel == "can" and (not idents or event.ident in idents)


def fields(event: Event) -> tuple[int, int, tuple[int, ...]]:
    """(sequence, device time, counts) of a whole ADC frame."""
    assert isinstance(event, Frame)
    payload = cobs.decode(event.data[:-1])
    n = payload[1]
    counts = [
        int.from_bytes(payload[_ADC_HEAD + 4 * i : _ADC_HEAD + 4 * i + 4], "little", signed=True) for i in range(n)
    ]
    return int.from_bytes(payload[2:4], "little"), int.from_bytes(payload[4:8], "little"), tuple(counts)


def each(change: Callable[[int, Frame], list[Event]], which: Callable[[Event], bool]) -> Edit:
    """An edit that replaces every chosen event in the window; `change(n, event)` counts them from 0."""

    def edit(events: list[Event], begin_ns: int, end_ns: int) -> Iterator[Event]:
        n = 0
        for event in events:
            if begin_ns <= event.t_ns < end_ns and which(event):
                assert isinstance(event, Frame)
                yield from change(n, event)
                n += 1
            else:
                yield event

    return edit


def drop_every(n: int, which: Callable[[Event], bool]) -> Edit:
    return each(lambda k, event: [] if k % n == 0 else [event], which)


def told(where: str, begins: tuple[str, ...], ends: str, edit: Edit) -> Edit:  # `ends`: that one is over afterwards
    """The edit, with the faults that the source itself reports before and after."""

    def both(events: list[Event], begin_ns: int, end_ns: int) -> Iterator[Event]:
        waiting = [Fault(begin_ns, where, kind) for kind in begins]
        after = [Fault(end_ns, where, ends, active=False)] if ends else []
        for event in edit(events, begin_ns, end_ns):
            while waiting and event.t_ns >= waiting[0].t_ns:
                yield waiting.pop(0)
            while after and event.t_ns >= after[0].t_ns:
                yield after.pop(0)
            yield event

    return both


def recount(change: Callable[[int, tuple[int, ...]], tuple[int, ...]]) -> Edit:
    """Other counts on the wire, every frame valid."""

    def frame(n: int, event: Frame) -> list[Event]:
        sequence, time_us, counts = fields(event)
        return [event._replace(data=encode(sequence, time_us, change(n, counts)))]

    return each(frame, is_adc)


def reset(events: list[Event], begin_ns: int, end_ns: int) -> Iterator[Event]:
    """The ADC starts again: sequence and device time from 0, for the rest of the flight."""
    first: tuple[int, int] | None = None
    for event in events:
        if event.t_ns < begin_ns or not is_adc(event):
            yield event
            continue
        assert isinstance(event, Frame)
        sequence, time_us, counts = fields(event)
        first = first or (sequence, time_us)
        yield event._replace(data=encode(sequence - first[0], time_us - first[1], counts))


def late(events: list[Event], begin_ns: int, end_ns: int) -> Iterator[Event]:
    """Every tenth frame comes again three frames later."""
    held: list[tuple[int, bytes]] = []
    n = 0
    for event in events:
        yield event
        if begin_ns <= event.t_ns < end_ns and isinstance(event, Frame) and is_adc(event):
            n += 1
            if n % 10 == 0:
                held.append((n + 3, event.data))
            if held and held[0][0] == n:
                yield event._replace(data=held.pop(0)[1])


def flip(n: int, event: Frame) -> list[Event]:
    """Every fifth frame with one bit changed."""
    if n % 5:
        return [event]
    at = 3 + n % (len(event.data) - 5)
    return [event._replace(data=event.data[:at] + bytes([event.data[at] ^ 0x10]) + event.data[at + 1 :])]


def noise(n: int, event: Frame) -> list[Event]:
    """Junk between the frames."""
    junk = bytes((7 * n + 13 * k) % 256 for k in range(n % 40))
    return [event._replace(data=junk), event]


def value(event: Frame, number: float) -> Frame:
    return event._replace(data=event.data[:4] + pack(">f", number))


def moved(ident: int, factor: float, offset: float = 0.0) -> Edit:
    """A message whose value is believable and wrong."""

    def change(n: int, event: Frame) -> list[Event]:
        (right,) = unpack(">f", event.data[4:8])
        return [value(event, right * factor + offset)]

    return each(change, lambda event: is_can(event, ident))


def frozen(ident: int) -> Edit:
    """A message that repeats its first value, its counter running on."""
    kept: list[float] = []

    def change(n: int, event: Frame) -> list[Event]:
        if n == 0:
            kept[:] = unpack(">f", event.data[4:8])
        return [value(event, kept[0])]

    return each(change, lambda event: is_can(event, ident))


def impostor(n: int, event: Frame) -> list[Event]:
    """Another node says something else under the same identifier."""
    other = bytes([event.data[0] ^ 0x55]) + event.data[1:4] + pack(">f", 0.9)
    return [event, event._replace(data=other)]


def scaled(factor: float) -> Callable[[int, tuple[int, ...]], tuple[int, ...]]:
    return lambda n, counts: tuple(min(round(c * factor), 2**23 - 1) for c in counts)


def stuck(which: int) -> Edit:
    kept: dict[int, int] = {}

    def hold(n: int, counts: tuple[int, ...]) -> tuple[int, ...]:
        if n == 0:
            kept[0] = counts[which]
        return (*counts[:which], kept[0], *counts[which + 1 :])

    return recount(hold)


def open_channel(which: int) -> Edit:
    return recount(lambda n, counts: (*counts[:which], CHANNEL_FAULT, *counts[which + 1 :]))


def unchanged(events: list[Event], begin_ns: int, end_ns: int) -> Iterator[Event]:
    yield from events


def shed(events: list[Event], begin_ns: int, end_ns: int) -> Iterator[Event]:
    """What a full queue throws away, and its count."""
    gone = 0
    for event in events:
        if begin_ns <= event.t_ns < end_ns:
            gone += 1
            continue
        if gone:
            yield Fault(event.t_ns, "queue", "overrun", count=gone)
            gone = 0
        yield event


def kinds(*names: str) -> frozenset[str]:
    return frozenset(names)


CASES = (
    Case("serial unplugged and back", told("adc", ("unplugged",), "unplugged", drop_every(1, is_adc)), 5.0,
         kinds("unplugged"), Status.LINK_LOST),
    Case("ADC silent", drop_every(1, is_adc), 5.0, kinds("lost"), Status.MOUNT_LOST),
    Case("ADC reset", reset, 1.0, kinds("reset"), Status.WIRE_FAULT),
    Case("frames lost", drop_every(5, is_adc), 5.0, kinds("lost"), Status.WIRE_FAULT),
    Case("frames repeated", each(lambda n, e: [e, e], is_adc), 5.0, kinds("late"), Status.WIRE_FAULT),
    Case("frames late", late, 5.0, kinds("late"), Status.WIRE_FAULT),
    Case("bits flipped (CRC)", each(flip, is_adc), 5.0, kinds("damaged"), Status.WIRE_FAULT),
    Case("junk between frames", each(noise, is_adc), 5.0, kinds("damaged"),
         Status.WIRE_FAULT),
    Case("channel open", open_channel(1), 5.0, kinds("open"), Status.CHANNEL_OPEN),
    Case("all channels open", recount(lambda n, c: (CHANNEL_FAULT,) * len(c)), 5.0, kinds("open"),
         Status.CHANNEL_OPEN),
    Case("LVDT stuck", stuck(0), 8.0, kinds("stuck", "drift", "offset"), Status.STUCK | Status.MOUNTS_DISAGREE, (0,)),
    Case("CAN bus-off and back", told("can", ("bus_error", "unplugged"), "unplugged", drop_every(1, is_can)), 5.0,
         kinds("unplugged"), Status.LINK_LOST),
    Case("N1 missing", drop_every(1, lambda e: is_can(e, N1_LEFT)), 5.0, kinds("stale"), Status.SIGNAL_STALE),
    Case("accelerations missing", drop_every(1, lambda e: is_can(e, 300, 301, 302)), 5.0, kinds("stale"),
         Status.LOAD_FACTOR_STALE),
    Case("N1 out of range", each(lambda n, e: [value(e, 30_000.0)], lambda e: is_can(e, N1_LEFT)), 5.0,
         kinds("out_of_range"), Status.OUT_OF_RANGE),
    Case("Mach not a number", each(lambda n, e: [value(e, float("nan"))], lambda e: is_can(e, MACH)), 5.0,
         kinds("out_of_range"), Status.OUT_OF_RANGE),
    Case("CAN messages lost", drop_every(3, is_can), 5.0, kinds("lost"), Status.WIRE_FAULT),
    Case("two nodes, one identifier", each(impostor, lambda e: is_can(e, MACH)), 5.0, kinds("contested"),
         Status.WIRE_FAULT),
    Case("calendar clock steps", told("clock", ("clock_step",), "", unchanged), 1.0, kinds("clock_step"),
         Status.CLOCK_STEP),
    Case("disk refuses", told("log", ("not_recorded",), "not_recorded", unchanged), 5.0, kinds("not_recorded"),
         Status.NOT_RECORDING),
    Case("disk too slow", told("log", ("overrun",), "", unchanged), 1.0, kinds("overrun"), Status.OVERLOAD),
    Case("live view fails", told("live_view", ("not_sent",), "", unchanged), 1.0, kinds("not_sent"),
         Status.OUTPUT_FAULT),
    Case("queue overrun", shed, 2.0, kinds("overrun"), Status.OVERLOAD),
    Case("outside the model's range", recount(scaled(40.0)), 5.0, kinds("offset", "failed", "out_of_range"),
         Status.MODEL_EXTRAPOLATING),
)  # fmt: skip

DOUBTED = (
    Status.MOUNT_REJECTED | Status.BROCHURE_REJECTED | Status.MOUNT_FAILED | Status.BROCHURE_FAILED | Status.STUCK
    | Status.MOUNTS_DISAGREE | Status.SENSOR_EXCLUDED
)  # fmt: skip
WRONG = kinds("offset", "drift", "stuck", "noisy", "failed")
# valid messages inside every range that contradict the other sensors: believable one by one
CONTRADICTIONS = (
    Case("N1 frozen", frozen(N1_LEFT), 20.0, WRONG, DOUBTED, (0,)),
    Case("N1 8 % high", moved(N1_LEFT, 1.08), 20.0, WRONG, DOUBTED, (0,)),
    Case("fuel flow 20 % high", moved(FUEL_LEFT, 1.2), 20.0, WRONG, DOUBTED, (0,)),
    Case("Mach 0.3 high", moved(MACH, 1.0, 0.3), 20.0, WRONG, DOUBTED),
    Case("acceleration 0.3 g high", moved(ACCEL_X, 1.0, 0.3), 20.0, WRONG, DOUBTED),
)
