"""Events <-> bytes: the message encoding "thrustd.events.v1" of the log topic `/raw`.

A batch holds consecutive events in arrival order, columns first so that it packs fast and compresses well:

    u8 version (1) | u8 n channels | u16 n events | u64 number of the first event            little-endian
    n channels x (u8 length + UTF-8 name)
    n events x i64 t_ns | x u8 kind | x u32 ident | x u16 data length | data of all events, joined

    kind = channel number for a Frame; 255 = Tick (ident 0, no data);
           254 = Fault (ident = count, data = "where kind" in UTF-8, split at the last space)
"""

from collections.abc import Sequence
from functools import cache
from struct import Struct, error
from typing import Final, NamedTuple

from thrustd.errors import LogError
from thrustd.types import Event, Fault, Frame, Tick

ENCODING = "thrustd.events.v1"
VERSION = 1
MAX_EVENTS = 64  # per batch
MAX_DATA_BYTES = 0xFFFF  # per event
_TICK = 255
_FAULT = 254
_HEAD = Struct("<BBHQ")
_IDENT_MASK = 0xFFFFFFFF
_new: Final = tuple.__new__  # half the time of calling a NamedTuple


@cache
def _layout(n: int) -> Struct:
    return Struct(f"<{n}q{n}s{n}I{n}H")


class EventBatch(NamedTuple):
    first_number: int  # of the run, gapless: a jump between batches is events the recorder had to drop
    events: list[Event]


def encode_batch(first_number: int, events: Sequence[Event]) -> bytes:
    """`events` (at most 65535, each at most 64 KiB of data) as one message."""
    channels: dict[str, int] = {}
    kinds = bytearray()
    idents: list[int] = []
    data: list[bytes] = []
    for event in events:
        if type(event) is Frame:
            kinds.append(channels.setdefault(event.channel, len(channels)))
            idents.append(event.ident)
            data.append(event.data)
        elif isinstance(event, Fault):
            kinds.append(_FAULT)
            idents.append(event.count & _IDENT_MASK)
            data.append(f"{event.where} {event.kind}".encode())
        else:
            kinds.append(_TICK)
            idents.append(0)
            data.append(b"")
    n = len(events)
    names = b"".join(bytes((len(raw),)) + raw for raw in map(str.encode, channels))
    times = [event.t_ns for event in events]
    columns = _layout(n).pack(*times, bytes(kinds), *idents, *map(len, data))
    return b"".join((_HEAD.pack(VERSION, len(channels), n, first_number), names, columns, *data))


def decode_batch(payload: bytes) -> EventBatch:
    """The events of one message; LogError when the bytes are not such a batch."""
    try:
        return _decode(payload)
    except (error, IndexError, UnicodeDecodeError, ValueError) as reason:
        raise LogError(f"event batch: {reason}") from None


def _decode(payload: bytes) -> EventBatch:
    version, n_channels, n, first_number = _HEAD.unpack_from(payload)
    if version != VERSION:
        raise ValueError(f"version {version}, expected {VERSION}")
    at = _HEAD.size
    names = []
    for _ in range(n_channels):
        end = at + 1 + payload[at]
        names.append(payload[at + 1 : end].decode())
        at = end
    layout = _layout(n)
    columns = layout.unpack_from(payload, at)
    times, kinds, idents, lengths = columns[:n], columns[n], columns[n + 1 : 2 * n + 1], columns[2 * n + 1 :]
    at += layout.size
    events: list[Event] = []
    append = events.append
    for t_ns, kind, ident, length in zip(times, kinds, idents, lengths, strict=True):
        end = at + length
        if kind < _FAULT:
            append(_new(Frame, (t_ns, names[kind], ident, payload[at:end])))
        else:
            append(_not_a_frame(kind, t_ns, ident, payload[at:end]))
        at = end
    if at != len(payload):
        raise ValueError(f"{len(payload)} bytes, expected {at}")
    return EventBatch(first_number, events)


def _not_a_frame(kind: int, t_ns: int, ident: int, data: bytes) -> Event:
    if kind == _TICK:
        return Tick(t_ns)
    where, _, word = data.decode().rpartition(" ")
    return Fault(t_ns, where, word, ident)
