"""An MCAP file, read front to back: memory flat, every checksum judged, files that were cut off still read.

Writers die; a log that ends in the middle of a record is read up to the last closed chunk (our chunks close at least
every half second; zstd holds such a chunk as one block, so its torn half has nothing to give). A file with a record
that does not fit or a wrong checksum before its end is damaged: walked to its end all the same, then LogError with the
account of what is lost; with `salvage` that account is in `gaps` and what is whole is handed out. A file that is still
written is read as far as it is whole, and on from there when more has come.
Reference: MCAP format specification, version 0 (https://mcap.dev/spec).
"""

import zlib
from collections.abc import Callable, Iterator
from os import SEEK_END
from struct import Struct, error
from typing import Any, BinaryIO, Final, NamedTuple

import numba
import numpy as np
import zstandard
from mcap.opcode import Opcode

from thrustd.core.columns import Bytes, Integers
from thrustd.core.errors import LogError
from thrustd.core.jit import compiled
from thrustd.sources.mcap_damage import Gap, account, looks_like_chunk, next_chunk
from thrustd.sources.mcap_record import MAX_RECORD_BYTES, expect_crc, inflated, text_at

MAGIC = b"\x89MCAP0\r\n"
_HEAD = Struct("<BQ")
_MESSAGE_BYTES: Final = 31  # record head, channel, sequence, log and publish time
_OP_MESSAGE, _OP_FOOTER = int(Opcode.MESSAGE), int(Opcode.FOOTER)
_new: Final = tuple.__new__  # half the time of calling a NamedTuple


class LogMessage(NamedTuple):
    topic: str
    log_ns: int
    data: bytes


class McapWalk:
    """One pass over `stream`, named `name` in errors."""

    def __init__(
        self,
        stream: BinaryIO,
        name: str,
        keep: Callable[[str], bool] = lambda topic: True,
        salvage: bool = False,
    ) -> None:
        """`keep` says which topics' messages are wanted; `salvage`: damage is no error."""
        self.name = name
        self.gaps: list[Gap] = []  # what is damaged, as far as it was read
        self.position_bytes = 0
        self.cut = False  # known after `records` is exhausted
        self.encodings: dict[str, str] = {}  # by topic; grows while walking
        self.metadata: dict[str, dict[str, str]] = {}
        self._keep = keep
        self._kept: dict[int, str] = {}  # channel id -> wanted topic
        self._growing = self._over = False
        self._look(stream)
        self._crc = 0
        self._summary_crc: int | None = None  # None while in the data section
        self._salvage = salvage
        self._in_gap = False  # since the last messages something was lost
        self._rows: Integers | None = None  # of the last messages
        self._origin_ns: int | None = None

    def records(self) -> Iterator[list[LogMessage]]:
        """The wanted messages, record by record of the file, often none; `encodings` and `metadata` grow."""
        self._start()
        for messages in self._all_records():
            if self._salvage or not self.gaps:  # else only the account is still wanted
                yield messages
        if self.gaps and not self._salvage:
            raise LogError(f"{self.name}: {self.account()}; replay and convert read the rest with --salvage")

    def grown(self, stream: BinaryIO) -> Iterator[list[LogMessage]]:
        """`records` of a file that is still written: the whole ones so far; called again, those since. See `gaps`."""
        self._growing = True
        self._look(stream)
        if self.position_bytes == 0:
            self._start()
        if not self._over:
            yield from self._all_records()

    def account(self) -> str:
        """What the gaps cost, in words."""
        return account(self.gaps, self._origin_ns)

    def _all_records(self) -> Iterator[list[LogMessage]]:
        while True:
            at = self.position_bytes
            head = self._read(_HEAD.size)
            opcode, length = _HEAD.unpack(head) if len(head) == _HEAD.size else (0, 0)
            content = self._read(length) if length <= MAX_RECORD_BYTES else b""
            if len(head) < _HEAD.size or len(content) < length:
                if self._growing and not self._ends_well and length <= MAX_RECORD_BYTES:
                    self.position_bytes = at  # its rest is still to come
                    return
                if self._goes_on_behind(at, length):
                    continue
                return
            try:
                messages = self._record(opcode, head, content)
            except (error, IndexError, UnicodeDecodeError, ValueError, zstandard.ZstdError) as why:
                self._lose(at, str(why) or "a record that does not fit", opcode)
                messages = []
            yield messages
            if opcode == _OP_FOOTER:
                self._finish()
                return

    def _look(self, stream: BinaryIO) -> None:
        """How long the file is by now, and whether it was closed; then on from where it was left."""
        self._stream = stream
        self.size_bytes = stream.seek(0, SEEK_END)
        stream.seek(max(0, self.size_bytes - len(MAGIC)))
        self._ends_well = stream.read() == MAGIC and self.size_bytes >= 2 * len(MAGIC)
        stream.seek(self.position_bytes)

    def _start(self) -> None:
        magic = self._stream.read(len(MAGIC))
        if not magic:
            raise LogError(f"{self.name}: empty file, expected an MCAP flight log")
        if magic != MAGIC:
            raise LogError(f"{self.name}: starts with {magic!r}, expected an MCAP flight log ({MAGIC!r})")
        self._crc = zlib.crc32(magic)
        self.position_bytes = len(magic)

    def _read(self, n_bytes: int) -> bytes:
        data = self._stream.read(n_bytes)
        self.position_bytes += len(data)
        return data

    def _goes_on_behind(self, at: int, length: int) -> bool:
        """The file ran out at a record: cut off, or a length that cannot be. Whether whole chunks follow."""
        behind = next_chunk(self._stream, at + 1)
        if behind is not None or self._ends_well or length > MAX_RECORD_BYTES:
            self._lose(at, f"a record of {length} bytes does not fit")
        self.cut = behind is None and not self._ends_well
        self.position_bytes = self.size_bytes if behind is None else self._stream.seek(behind)
        return behind is not None

    def _finish(self) -> None:
        self._over = True
        tail = self._read(len(MAGIC) + 1)
        self.cut = MAGIC.startswith(tail) and tail != MAGIC
        if tail != MAGIC and not self.cut:
            self._lose(self.position_bytes - len(tail), f"ends with {tail!r}, expected {MAGIC!r}", _OP_FOOTER)

    def _lose(self, at: int, why: str, opcode: int = 0) -> None:
        """A record that gives nothing: of a new gap, or of the one that is open; reading goes on behind it."""
        why = " ".join(why.split())[:120]
        if opcode in (Opcode.DATA_END, Opcode.FOOTER):  # a checksum over all that was read
            self.gaps += [] if self.gaps else [Gap(at, why, 0)]
            return
        behind = next_chunk(self._stream, at + 1)
        if behind is not None and behind < self.position_bytes:  # the length was wrong, too
            self.position_bytes = behind
        self._stream.seek(self.position_bytes)
        if self._in_gap:
            self.gaps[-1] = self.gaps[-1]._replace(n_records=self.gaps[-1].n_records + 1)
            return
        from_ns = None if self._rows is None else int(self._rows[:, _LOG_NS].max())
        self.gaps.append(Gap(at, why, 1, from_ns))
        self._in_gap = True

    def _tell_times(self, rows: Integers) -> None:
        """Of the first messages, and of those behind a gap."""
        times_ns = rows[rows[:, _CHANNEL] >= 0, _LOG_NS]
        if len(times_ns) == 0:
            return
        first_ns = int(times_ns.min())
        if self._origin_ns is None:
            self._origin_ns = first_ns
        if self._in_gap:
            self.gaps[-1], self._in_gap = self.gaps[-1]._replace(to_ns=first_ns), False

    def _record(self, opcode: int, head: bytes, content: bytes) -> list[LogMessage]:
        self._judge_checksums(opcode, head, content)
        if opcode == Opcode.CHUNK:
            return self._messages(inflated(content))
        if opcode == _OP_MESSAGE:
            return self._messages(head + content)
        self._note(opcode, content)
        return []

    def _judge_checksums(self, opcode: int, head: bytes, content: bytes) -> None:
        if opcode == Opcode.DATA_END:
            expect_crc("data section", int.from_bytes(content, "little"), self._crc)
            self._summary_crc = 0
        elif opcode == Opcode.FOOTER and self._summary_crc is not None:
            crc = zlib.crc32(head + content[:16], self._summary_crc)
            expect_crc("summary", int.from_bytes(content[16:20], "little"), crc)
        elif self._summary_crc is not None:
            self._summary_crc = zlib.crc32(head + content, self._summary_crc)
        else:
            self._crc = zlib.crc32(content, zlib.crc32(head, self._crc))

    def _messages(self, records: bytes) -> list[LogMessage]:
        """The wanted messages among the records inside a chunk."""
        rows = _records(np.frombuffer(records, np.uint8))
        if len(rows) and rows[-1, _END] > len(records):
            raise ValueError("record longer than its chunk")
        for opcode, _, _, start, end in rows[rows[:, _CHANNEL] < 0].tolist():
            if opcode == _OP_MESSAGE:
                raise ValueError(f"message of {end - start - _HEAD.size} bytes")
            self._note(opcode, records[start + _HEAD.size : end])
        if self._in_gap or self._origin_ns is None:
            self._tell_times(rows)
        self._rows = rows if len(rows) else self._rows
        kept = self._kept
        return [
            _new(LogMessage, (kept[channel_id], log_ns, records[start + _MESSAGE_BYTES : end]))
            for _, channel_id, log_ns, start, end in rows.tolist()
            if channel_id in kept
        ]

    def _note(self, opcode: int, content: bytes) -> None:
        if looks_like_chunk(content):
            raise ValueError(f"a chunk under opcode {opcode}")
        if opcode == Opcode.MESSAGE_INDEX and int.from_bytes(content[2:6], "little") != len(content) - 6:
            raise ValueError(f"an index of {len(content)} bytes")
        if opcode == Opcode.CHANNEL:
            topic, at = text_at(content, 4)
            channel_id = int.from_bytes(content[:2], "little")
            self.encodings[topic] = text_at(content, at)[0]
            if self._keep(topic):
                self._kept[channel_id] = topic
        elif opcode == Opcode.METADATA:
            name, at = text_at(content, 0)
            end = at + 4 + int.from_bytes(content[at : at + 4], "little")
            at, values = at + 4, {}
            while at < end:
                key, at = text_at(content, at)
                values[key], at = text_at(content, at)
            self.metadata[name] = values


_OPCODE, _CHANNEL, _LOG_NS, _BEGIN, _END = range(5)  # columns of `_records`


@compiled
def _number(raw: Bytes, at: int, n: int) -> Any:
    value = np.uint64(0)
    for i in range(n):
        value |= np.uint64(raw[at + i]) << np.uint64(8 * i)
    return value


@compiled
def _end_of(raw: Bytes, at: int) -> Any:
    """Of the record at `at`; beyond the chunk when it does not fit."""
    longest = np.uint64(len(raw))
    length = min(_number(raw, at + 1, 8), longest) if at + 9 <= len(raw) else longest
    return at + 9 + np.int64(length)


def _find_records(raw: Bytes) -> Integers:
    """Rows (n, 5): opcode, channel (-1: no whole message), log time, begin and end of each record of a chunk."""
    n = at = 0
    while at < len(raw):
        n, at = n + 1, _end_of(raw, at)
    rows = np.empty((n, 5), np.int64)
    at = 0
    for i in range(n):
        end = _end_of(raw, at)
        rows[i, _OPCODE], rows[i, _CHANNEL], rows[i, _LOG_NS], rows[i, _BEGIN], rows[i, _END] = raw[at], -1, 0, at, end
        if raw[at] == _OP_MESSAGE and at + _MESSAGE_BYTES <= end <= len(raw):
            rows[i, _CHANNEL] = np.int64(_number(raw, at + 9, 2))
            rows[i, _LOG_NS] = np.int64(_number(raw, at + 15, 8))
        at = end
    return rows


_records: Any = compiled(_find_records, numba.int64[:, ::1](numba.types.Array(numba.uint8, 1, "C", readonly=True)))
