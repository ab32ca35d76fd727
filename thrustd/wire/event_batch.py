"""Events in columns, and as bytes: the message encoding "thrustd.events.v1" of the log topic `/raw`.

A batch holds consecutive events in arrival order, columns first so that it packs fast and compresses well:

    u8 version (1) | u8 n channels | u16 n events | u64 number of the first event            little-endian
    n channels x (u8 length + UTF-8 name)
    n events x i64 t_ns | x u8 kind | x u32 ident | x u16 data length | data of all events, joined

    kind = channel number for a Frame; 255 = Tick (ident 0, no data);
           254 = Fault (ident = count, its highest bit set when it is over; data = "where kind" in UTF-8)
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from struct import Struct, error
from typing import Any, Final

import numba
import numpy as np

from thrustd.core.columns import FAULT, TICK, Bytes, Integers
from thrustd.core.errors import LogError
from thrustd.core.jit import compiled, together
from thrustd.core.types import Event, Fault, Frame, Tick

ENCODING = "thrustd.events.v1"
VERSION = 1
MAX_EVENTS = 64  # per message of a log
_HEAD = Struct("<BBHQ")
_EVENT_BYTES = 15  # of the columns
_OVER: Final = 1 << 31  # bit of a fault that is over
_new: Final = tuple.__new__  # half the time of calling a NamedTuple


@dataclass(frozen=True, slots=True, eq=False)
class EventBatch:
    """Consecutive events, (n,) per column; event i has data[ends[i - 1] : ends[i]]."""

    channels: tuple[str, ...]  # names of the kinds below FAULT
    t_ns: Integers
    kind: Bytes
    ident: Integers
    ends: Integers
    data: Bytes
    made_of: Sequence[Event] | None = None  # when they are at hand

    def __len__(self) -> int:
        return len(self.t_ns)

    @classmethod
    def of(cls, events: Sequence[Event]) -> "EventBatch":
        """`events`, each at most 64 KiB of data."""
        rows = [event if type(event) is Frame else _as_row(event) for event in events]
        t_ns, names, idents, data = zip(*rows, strict=True) if rows else ((), (), (), ())
        channels = tuple(name for name in dict.fromkeys(names) if isinstance(name, str))
        number = {name: i for i, name in enumerate(channels)} | {TICK: TICK, FAULT: FAULT}
        return cls(
            channels,
            np.array(t_ns, np.int64),
            np.frombuffer(bytearray([number[name] for name in names]), np.uint8),
            np.array(idents, np.int64),
            np.array(list(accumulate(map(len, data))), np.int64),
            np.frombuffer(bytearray().join(data), np.uint8),
            events,
        )

    def event(self, i: int) -> Event:
        """The i-th event as it was."""
        kind, t_ns = self.kind.item(i), self.t_ns.item(i)
        data = self.data[self.ends.item(i - 1) if i else 0 : self.ends.item(i)].tobytes()
        return _event(self.channels, kind, t_ns, self.ident.item(i), data)

    def events(self) -> Sequence[Event]:
        """All of them as they were."""
        if self.made_of is not None:
            return self.made_of
        data, channels, ends = self.data.tobytes(), self.channels, self.ends.tolist()
        columns = zip(  # noqa: B905 - the last end begins nothing
            self.t_ns.tolist(), self.kind.tolist(), self.ident.tolist(), [0, *ends], ends
        )
        return [
            _new(Frame, (t_ns, channels[kind], ident, data[begin:end]))
            if kind < FAULT
            else _event(channels, kind, t_ns, ident, data[begin:end])
            for t_ns, kind, ident, begin, end in columns
        ]

    def part(self, begin: int, end: int) -> "EventBatch":
        """Events begin to end - 1."""
        first = self.ends.item(begin - 1) if begin else 0
        rows = slice(begin, end)
        return EventBatch(
            self.channels,
            self.t_ns[rows],
            self.kind[rows],
            self.ident[rows],
            self.ends[rows] - first,
            self.data[first:],
        )

    def encode(self, first_number: int) -> bytes:
        """At most 65535 events as one message; `first_number` of the run."""
        names = b"".join(bytes((len(raw),)) + raw for raw in map(str.encode, self.channels))
        lengths = self.ends.copy()
        lengths[1:] -= self.ends[:-1]
        n_bytes = self.ends.item(-1) if len(self) else 0
        columns = (self.t_ns, self.kind, self.ident.astype("<u4"), lengths.astype("<u2"), self.data[:n_bytes])
        head = _HEAD.pack(VERSION, len(self.channels), len(self), first_number)
        return b"".join((head, names, *(column.tobytes() for column in columns)))


def _as_row(event: Event) -> tuple[int, int, int, bytes]:
    """An event that is no frame, in a frame's columns: its kind instead of a channel's name."""
    if isinstance(event, Fault):
        ident = event.count & _OVER - 1 | (0 if event.active else _OVER)
        return event.t_ns, FAULT, ident, f"{event.where} {event.kind}".encode()
    return event.t_ns, TICK, 0, b""


def _event(channels: tuple[str, ...], kind: int, t_ns: int, ident: int, data: bytes) -> Event:
    if kind < FAULT:
        return Frame(t_ns, channels[kind], ident, data)
    if kind == TICK:
        return Tick(t_ns)
    where, _, word = data.decode().rpartition(" ")
    return Fault(t_ns, where, word, ident < _OVER, ident % _OVER)


def _kinds_of(names: bytes, channels: dict[str, int]) -> Bytes:
    """Channel numbers of a message (names as it has them) -> numbers of all messages' `channels`, which may grow."""
    row, number, at = np.full(FAULT, FAULT, np.uint8), 0, 0
    while at < len(names):
        end = at + 1 + names[at]
        if len(channels) >= FAULT:
            raise ValueError(f"more than {FAULT} channels")
        row[number] = channels.setdefault(names[at + 1 : end].decode(), len(channels))
        number, at = number + 1, end
    return row


_Columns = tuple[Integers, Bytes, Integers, Integers, Bytes]  # t_ns, kind, ident, ends, data of many messages


class Messages:
    """Consecutive messages of a log, taken apart together."""

    def __init__(self, payloads: Sequence[bytes]) -> None:
        """LogError when one of them is no batch of events."""
        self.first_numbers, self.n_events = list[int](), list[int]()  # by message
        channels: dict[str, int] = {}
        known: dict[bytes, Bytes] = {}  # names as a message has them -> its row of `kinds`
        places = np.zeros((len(payloads), 3), np.int64)  # begin, columns, end of each message
        kinds = np.zeros((len(payloads), FAULT), np.uint8)  # channel number of the message -> of all
        end = 0
        try:
            for i, payload in enumerate(payloads):
                columns = self._take_head(payload)
                names = payload[_HEAD.size : columns]
                row = known.get(names)
                if row is None:
                    row = known[names] = _kinds_of(names, channels)
                kinds[i] = row
                begin, end = end, end + len(payload)
                places[i] = begin, begin + columns, end
            self.batch = self._columns(bytearray().join(payloads), tuple(channels), places, kinds)
        except (error, IndexError, UnicodeDecodeError, ValueError) as reason:
            raise LogError(f"event batch: {reason}") from None

    def _take_head(self, payload: bytes) -> int:
        """-> where the columns begin, behind the names of the channels."""
        version, n_channels, n, first_number = _HEAD.unpack_from(payload)
        if version != VERSION:
            raise ValueError(f"version {version}, expected {VERSION}")
        at: int = _HEAD.size
        for _ in range(n_channels):
            at += 1 + payload[at]
        if at + _EVENT_BYTES * n > len(payload):
            raise ValueError(f"{len(payload)} bytes, expected at least {at + _EVENT_BYTES * n}")
        self.first_numbers.append(first_number)
        self.n_events.append(n)
        return at

    def _columns(self, raw: bytearray, channels: tuple[str, ...], places: Integers, kinds: Bytes) -> EventBatch:
        n = sum(self.n_events)
        t_ns, ident, ends = (np.empty(n, np.int64) for _ in range(3))
        room = np.empty(max(len(raw) - _EVENT_BYTES * n, 0), np.uint8)
        kind, counts = np.empty(n, np.uint8), np.array(self.n_events, np.int64)
        out = t_ns, kind, ident, ends, room
        bytes_used = _take_apart(np.frombuffer(raw, np.uint8), places, counts, kinds, out)
        if bytes_used < 0:
            raise ValueError(
                f"data of {-1 - bytes_used} bytes or an unknown channel, in a message that does not hold it"
            )
        batch = EventBatch(channels, t_ns, kind, ident, ends, room[:bytes_used])
        for i in np.flatnonzero(kind == FAULT).tolist():
            batch.event(i)  # its words must be text
        return batch


@compiled
def _number(raw: Bytes, at: int, n: int) -> Any:
    value = np.int64(0)
    for i in range(n):
        value |= np.int64(raw[at + i]) << 8 * i
    return value


def _take_columns(raw: Bytes, places: Integers, n_events: Integers, kinds: Bytes, out: _Columns) -> int:
    """-> bytes of data; -1 - (bytes that were to be there) when a message has other bytes or a channel without name."""
    t_ns, kind, ident, ends, data = out
    at = end = 0
    for message in range(len(n_events)):
        n, columns, message_end = n_events[message], places[message, 1], places[message, 2]
        after = columns + 15 * n
        for i in range(n):
            t_ns[at] = _number(raw, columns + 8 * i, 8)
            number = raw[columns + 8 * n + i]
            kind[at] = number if number >= FAULT else kinds[message, number]
            ident[at] = _number(raw, columns + 9 * n + 4 * i, 4)
            length = _number(raw, columns + 13 * n + 2 * i, 2)
            if after + length > message_end or (number < FAULT and kind[at] == FAULT):
                return -1 - length
            data[end : end + length] = raw[after : after + length]
            after, end = after + length, end + length
            ends[at] = end
            at += 1
        if after != message_end:
            return -1 - (message_end - after)
    return end


_ROW, _BYTES, _TABLE = numba.int64[::1], numba.uint8[::1], numba.int64[:, ::1]
_take_apart: Any = compiled(
    _take_columns,
    numba.int64(_BYTES, _TABLE, _ROW, numba.uint8[:, ::1], together(_ROW, _BYTES, _ROW, _ROW, _BYTES)),
)
