"""CAN messages -> catalogue readings, column by column (ICD section 2: CANaerospace 1.7, or any bus with a DBC).

    CANaerospace message = node id | data type | service code | message code | 4 bytes data       big-endian

Judged per message: length, data type, service code 0, one living sender per identifier, message code counting up by
one, finite values. What does not fit becomes a named fault. Whether a value is plausible is not judged here. The
message code has 8 bits, so "lost" counts at least so many.
"""

from math import inf, isfinite, nan
from typing import Any, Final

import numba
import numpy as np

from thrustd.core.columns import COUNT, EVENT, GOOD, KIND, PLACE, Bytes, Flags, Floats, Integers
from thrustd.core.jit import compiled, together
from thrustd.core.signals import CATALOGUE
from thrustd.core.types import Fault
from thrustd.wire.can_table import FLOAT, SIGNED, CanTable

CODE_MASK: Final = 0xFF
# faults; the kind in a row is 1 + place here
KINDS: Final = ("foreign", "contested", "late", "lost", "out_of_range")
_FOREIGN, _CONTESTED, _LATE, _LOST, _NOT_FINITE = range(1, 6)
_FIELD = np.dtype(
    [(name, np.int64) for name in ("start", "length", "little_endian", "kind", "slot")]
    + [(name, np.float64) for name in ("scale", "offset")]
)
_LINE = np.dtype(  # one identifier: how to read it, who sends it, and what it said last
    [
        ("ident", np.int64),
        ("n_bytes", np.int64),
        ("has_header", np.int64),
        ("first", np.int64),  # of its fields; the header's are the four before
        ("end", np.int64),
        ("silent_after_ns", np.int64),  # after this silence another node may take over
        ("node", np.int64),  # -1: not heard yet, like the next two
        ("data_type", np.int64),
        ("next_code", np.int64),
        ("t_ns", np.int64),
    ]
)


_Bus = tuple[Any, Any, Flags, Bytes]  # all identifiers, sorted: _LINE, _FIELD, legal data types, the message before
_Found = tuple[Integers, Floats]  # room for what a batch says: rows (n, 4), values (n,) of those that are readings


class CanDecoder:
    """Messages in, readings and faults out; identifiers the table does not know give nothing."""

    def __init__(self, table: CanTable, where: str = "can") -> None:
        messages = sorted(table.messages.values(), key=lambda message: message.ident)
        slots = dict.fromkeys((field.signal, field.index) for message in messages for field in message.fields)
        self.slots = tuple(slots)  # signal and index of every reading
        self._where, self._fault_places = where, [f"{where}[{message.name}]" for message in messages]
        places, rows = {slot: place for place, slot in enumerate(slots)}, list[tuple[float, ...]]()
        lines = np.zeros(len(messages), _LINE)
        all_legal = np.zeros((len(messages), CODE_MASK + 1), np.bool_)
        last = np.zeros((len(messages), max((message.n_bytes for message in messages), default=0)), np.uint8)
        for number, message in enumerate(messages):
            rows += [(*bits, 0, 1.0, 0.0) for bits in message.header]
            first = len(rows)
            rows += [(*f.bits, places[f.signal, f.index], f.scale, f.offset) for f in message.fields]
            stale_s = max(CATALOGUE[field.signal].stale_after_s for field in message.fields)
            silent_after_ns, heard = round(stale_s * 1e9), (-1, -1, -1, 0)
            place = message.ident, message.n_bytes, bool(message.header), first, len(rows)
            lines[number] = (*place, silent_after_ns, *heard)
            legal = [code for code in message.data_types if 0 <= code <= CODE_MASK]
            all_legal[number, legal or slice(None)] = True
        self._bus: _Bus = lines, np.array(rows, _FIELD), all_legal, last
        self._most = max((len(message.fields) for message in messages), default=0) + 1  # rows from one message
        self._found: _Found = np.empty((0, COUNT + 1), np.int64), np.empty(0)

    def decode(
        self, t_ns: Integers, ident: Integers, data: Bytes, ends: Integers, left_out: Flags
    ) -> tuple[Integers, Floats]:
        """What messages say; message i ends before data[ends[i]] and is not of this bus when left out. Never raises.

        -> rows (n, 4) in the order of the messages and the values (n,) of those that are readings, good until the
        next call.
        """
        most = len(ends) * self._most
        if most > len(self._found[1]):
            self._found = np.empty((most, COUNT + 1), np.int64), np.empty(most)
        n = _decode(
            t_ns, ident, data, ends, left_out, self._bus, self._found
        )  # fmt: skip
        return self._found[0][:n], self._found[1][:n]

    def fault(self, t_ns: int, row: Integers) -> Fault:
        """A row of `decode` that is no reading."""
        _, kind, place, count = row.tolist()
        if kind == _NOT_FINITE:
            signal, index = self.slots[place]
            return Fault(t_ns, f"{signal}[{index}]", KINDS[kind - 1])
        where = self._where if kind == _LATE else self._fault_places[place]  # what comes twice, a bus repeats
        return Fault(t_ns, where, KINDS[kind - 1], count=count)


@compiled
def _line_of(lines: Any, ident: int) -> int:
    """By bisection; -1 when nobody needs it."""
    low, high = 0, len(lines)
    while low < high:
        middle = (low + high) // 2
        if lines[middle].ident < ident:
            low = middle + 1
        else:
            high = middle
    return low if low < len(lines) and lines[low].ident == ident else -1


@compiled
def _bits(data: Bytes, begin: int, field: Any) -> Any:
    """Raw bits of a field, the first bit of the message at bit 0 of data[begin]."""
    raw, bit = np.uint64(0), field.start
    for i in range(field.length):
        one = np.uint64(data[begin + (bit >> 3)] >> (bit & 7) & 1)
        if field.little_endian:
            raw |= one << np.uint64(i)
            bit += 1
        else:
            raw = raw << np.uint64(1) | one
            bit += -1 if bit & 7 else 15  # down the byte, then to the top of the next
    return raw


@compiled
def _float(raw: Any, length: int) -> float:
    """IEEE 754 of 16, 32 or 64 bits."""
    if length == 64:
        return float(np.uint64(raw).view(np.float64))
    if length == 32:
        return float(np.uint32(raw).view(np.float32))
    fraction, exponent = float(raw & np.uint64(0x3FF)), int(raw >> np.uint64(10) & np.uint64(0x1F))
    size = fraction * 2.0**-24 if exponent == 0 else (1024.0 + fraction) * 2.0 ** (exponent - 25)
    if exponent == 0x1F:
        size = nan if fraction else inf
    return -size if raw >> np.uint64(15) else size


@compiled
def _value(data: Bytes, begin: int, field: Any) -> float:
    """The field in the catalogue's unit."""
    raw = _bits(data, begin, field)
    if field.kind == FLOAT:
        value = _float(raw, field.length)
    elif field.kind == SIGNED and raw >> np.uint64(field.length - 1):
        value = float(np.int64(raw | ~np.uint64(0) << np.uint64(field.length - 1)))
    else:
        value = float(raw)
    return value * field.scale + field.offset


@compiled
def _tell(found: Integers, n: int, message: int, kind: int, place: int, count: int) -> int:
    found[n, EVENT], found[n, KIND], found[n, PLACE], found[n, COUNT] = message, kind, place, count
    return n + 1


@compiled
def _same(data: Bytes, begin: int, last: Bytes, n_bytes: int) -> bool:
    different = 0
    for i in range(n_bytes):
        different |= data[begin + i] ^ last[i]
    return different == 0


@compiled
def _judge(line: Any, legal: Flags, t_ns: int, node: int, data_type: int, service: int) -> int:
    """The sender of a message: 0 when it is the living one, else the kind of fault, or -1 for a new sender."""
    if service or not 0 <= data_type < len(legal) or not legal[data_type]:
        return _FOREIGN
    line.data_type = data_type
    if line.node == node:
        return 0
    if line.node == -1 or t_ns - line.t_ns > line.silent_after_ns:
        line.node = node
        return -1
    return _CONTESTED


@compiled
def _header(bus: _Bus, number: int, data: Bytes, begin: int, t_ns: int) -> tuple[int, int, bool]:
    """Fault kind or 0, its count, and whether the message is taken nevertheless."""
    lines, fields, all_legal, all_last = bus
    line, legal, last = lines[number], all_legal[number], all_last[number]
    first = line.first - 4
    node, data_type = np.int64(_bits(data, begin, fields[first])), np.int64(_bits(data, begin, fields[first + 1]))
    service, code = np.int64(_bits(data, begin, fields[first + 2])), np.int64(_bits(data, begin, fields[first + 3]))
    kind, count, taken = _judge(line, legal, t_ns, node, data_type, service), 1, True
    if kind > 0:
        return kind, count, False
    if kind == 0:
        lost = (code - line.next_code) & CODE_MASK
        if lost == CODE_MASK:
            taken = not _same(data, begin, last, line.n_bytes)
            kind = _CONTESTED if taken else _LATE
        elif lost:
            kind, count = _LOST, lost
    if taken:
        line.next_code, line.t_ns = code + 1 & CODE_MASK, t_ns
        last[: line.n_bytes] = data[begin : begin + line.n_bytes]
    return max(kind, 0), count, taken


def _decode_messages(
    t_ns: Integers, ident: Integers, data: Bytes, ends: Integers, left_out: Flags, bus: _Bus, out: _Found
) -> int:
    found, values = out
    lines, fields, _, _ = bus
    n, end = 0, np.int64(0)  # a plain 0 has numba compile the header a second time, for messages that begin there
    for i in range(len(ends)):
        begin, end = end, ends[i]
        number = -1 if left_out[i] else _line_of(lines, ident[i])
        if number < 0:
            continue
        line, taken = lines[number], end - begin == lines[number].n_bytes
        if not taken:
            n = _tell(found, n, i, _FOREIGN, number, 1)
        elif line.has_header:
            kind, count, taken = _header(bus, number, data, begin, t_ns[i])
            if kind:
                n = _tell(found, n, i, kind, number, count)
        if taken:
            for k in range(line.first, line.end):
                values[n] = _value(data, begin, fields[k])
                n = _tell(found, n, i, GOOD if isfinite(values[n]) else _NOT_FINITE, fields[k].slot, 1)
    return n


_ROW, _BYTES, _FLAGS = numba.int64[::1], numba.uint8[::1], numba.boolean[::1]
_BUS = together(numba.from_dtype(_LINE)[::1], numba.from_dtype(_FIELD)[::1], numba.boolean[:, ::1], numba.uint8[:, ::1])
_FOUND = together(numba.int64[:, ::1], numba.float64[::1])
_decode: Any = compiled(_decode_messages, numba.int64(_ROW, _ROW, _BYTES, _ROW, _FLAGS, _BUS, _FOUND))
