"""An MCAP file, written: messages into zstd chunks with indexes, checksums everywhere.

The `mcap` package's own writer takes several us per message, as much as a replay at 200 x real time has for
everything. So messages and their indexes are packed here, a chunk at once; the rare records come from the package.
Every byte is under a checksum: chunks, data section and summary have one each.
Reference: MCAP format specification, version 0 (https://mcap.dev/spec).
"""

import zlib
from collections.abc import Sequence
from struct import Struct, pack
from typing import Any, BinaryIO, Final

import numba
import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    ChunkIndex,
    DataEnd,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from thrustd.core.columns import Bytes, Integers
from thrustd.core.jit import compiled

MAGIC = b"\x89MCAP0\r\n"
CHUNK_BYTES = 64 * 1024  # closing a chunk of this size stalls about 0.5 ms
ZSTD_LEVEL = 1
COMPRESSION = b"zstd"
_OP_MESSAGE, _OP_INDEX = int(Opcode.MESSAGE), int(Opcode.MESSAGE_INDEX)
_MESSAGE_BYTES: Final = 31  # opcode, length, channel, sequence and two times
_INDEX_BYTES: Final = 15  # opcode, length, channel and size of the entries, which are time and offset
_CHUNK = Struct(f"<BQQQQII{len(COMPRESSION)}sQ")
_CHUNK_FIXED_BYTES = _CHUNK.size - 9
_CHANNEL, _TIME, _LENGTH = range(3)  # columns of what is pending


class McapFile:
    """Writes to `stream`, which stays the caller's. OSError of the stream goes through to the caller."""

    def __init__(self, stream: BinaryIO, library: str, chunk_bytes: int = CHUNK_BYTES) -> None:
        self.bytes_written = 0
        self._stream = stream
        self._chunk_bytes = chunk_bytes
        self._compress = zstandard.ZstdCompressor(level=ZSTD_LEVEL).compress
        self._crc = 0
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._metadata: list[MetadataIndex] = []
        self._n_chunks = 0
        self._index = bytearray()  # packed ChunkIndex records: 2.7 MB per hour in one piece, not in thousands
        self._counts = np.zeros(1, np.int64)  # messages by channel id
        self._first_ns: int | None = None
        self._last_ns = 0
        self._open_chunk()
        self._write(MAGIC + _packed(Header("", library)))

    def add_schema(self, name: str, data: bytes) -> int:
        """A JSON schema; returns its id."""
        schema = Schema(id=len(self._schemas) + 1, data=data, encoding="jsonschema", name=name)
        self._schemas.append(schema)
        self._write(_packed(schema))
        return schema.id

    def add_channel(self, topic: str, encoding: str, schema_id: int) -> int:
        """A topic; returns its id. Schema 0 = none."""
        number = len(self._channels) + 1
        channel = Channel(id=number, topic=topic, message_encoding=encoding, metadata={}, schema_id=schema_id)
        self._channels.append(channel)
        self._counts = np.append(self._counts, 0)
        self._write(_packed(channel))
        return number

    def add_metadata(self, name: str, values: dict[str, str]) -> None:
        record = _packed(Metadata(name, values))
        self._metadata.append(MetadataIndex(self.bytes_written, len(record), name))
        self._write(record)

    def add_message(self, channel_id: int, t_ns: int, data: bytes) -> None:
        """One message at `t_ns` >= 0 [ns since the epoch]; closes the chunk when it is full."""
        length = len(data)
        self._rows.extend((channel_id, t_ns, length))
        self._contents.append(data)
        self._size += _MESSAGE_BYTES + length
        if self._size >= self._chunk_bytes:
            self.close_chunk()

    def add_messages(self, messages: Sequence[tuple[int, int, bytes]]) -> None:
        """The same of many that belong in one chunk: channel, time and data of each."""
        self._rows += [number for channel_id, t_ns, data in messages for number in (channel_id, t_ns, len(data))]
        self._contents += (contents := [data for _, _, data in messages])
        self._size += _MESSAGE_BYTES * len(contents) + sum(map(len, contents))
        if self._size >= self._chunk_bytes:
            self.close_chunk()

    def close_chunk(self) -> None:
        """Put what is pending into a chunk and hand it to the stream. Nothing pending: nothing happens."""
        if not self._contents:
            return
        rows, contents = np.array(self._rows, np.int64).reshape(-1, 3), b"".join(self._contents)
        records = np.empty(self._size, np.uint8)
        indexes = np.empty(len(self._counts) * _INDEX_BYTES + 16 * len(rows), np.uint8)
        self._open_chunk()
        begins = _pack(rows, np.frombuffer(contents, np.uint8), self._counts, records, indexes)
        first_ns, last_ns = int(rows[:, _TIME].min()), int(rows[:, _TIME].max())
        squeezed = self._compress(records.data)
        start = self.bytes_written
        head = _CHUNK.pack(
            Opcode.CHUNK, _CHUNK_FIXED_BYTES + len(squeezed), first_ns, last_ns, len(records),
            zlib.crc32(records.data), len(COMPRESSION), COMPRESSION, len(squeezed),
        )  # fmt: skip
        self._write(b"".join((head, squeezed, indexes[: begins[-1]].tobytes())))
        length = len(head) + len(squeezed)
        offsets = {int(channel): start + length + int(begins[channel]) for channel in np.flatnonzero(np.diff(begins))}
        self._remember(ChunkIndex(
            message_start_time=first_ns, message_end_time=last_ns, chunk_start_offset=start,
            chunk_length=length, message_index_offsets=offsets, message_index_length=int(begins[-1]),
            compression=COMPRESSION.decode(), compressed_size=len(squeezed), uncompressed_size=len(records),
        ))  # fmt: skip

    def finish(self) -> None:
        """Close the last chunk and write the summary. The stream is neither flushed nor closed."""
        self.close_chunk()
        self._write(_packed(DataEnd(self._crc)))
        start, offsets = self.bytes_written, b""
        self._crc = 0  # of the summary from here on
        groups: dict[Opcode, bytes | bytearray] = {
            Opcode.SCHEMA: b"".join(map(_packed, self._schemas)),
            Opcode.CHANNEL: b"".join(map(_packed, self._channels)),
            Opcode.STATISTICS: _packed(self._statistics()),
            Opcode.CHUNK_INDEX: self._index,
            Opcode.METADATA_INDEX: b"".join(map(_packed, self._metadata)),
        }
        for opcode, records in groups.items():
            if records:
                offsets += _packed(SummaryOffset(opcode, self.bytes_written, len(records)))
                self._write(records)
        self._write(offsets + pack("<BQQQ", Opcode.FOOTER, 20, start, self.bytes_written))
        self._write(pack("<I", self._crc) + MAGIC)

    def _open_chunk(self) -> None:
        self._rows: list[int] = []  # channel, time and length of each message
        self._contents: list[bytes] = []
        self._size = 0

    def _write(self, data: bytes | bytearray) -> None:
        self._stream.write(data)
        self._crc = zlib.crc32(data, self._crc)
        self.bytes_written += len(data)

    def _remember(self, chunk: ChunkIndex) -> None:
        first_ns = chunk.message_start_time
        self._first_ns = first_ns if self._first_ns is None else min(first_ns, self._first_ns)
        self._last_ns = max(chunk.message_end_time, self._last_ns)
        self._index += _packed(chunk)
        self._n_chunks += 1

    def _statistics(self) -> Statistics:
        counts = {channel: n for channel, n in enumerate(self._counts.tolist()) if n}
        return Statistics(
            attachment_count=0, channel_count=len(self._channels), channel_message_counts=counts,
            chunk_count=self._n_chunks, message_count=sum(counts.values()),
            metadata_count=len(self._metadata), message_start_time=self._first_ns or 0,
            message_end_time=self._last_ns, schema_count=len(self._schemas),
        )  # fmt: skip


def _packed(record: McapRecord) -> bytes:
    builder: Any = RecordBuilder()  # untyped in the package
    record.write(builder)
    return bytes(builder.end())


@compiled
def _put(raw: Bytes, at: int, value: int, n_bytes: int) -> int:
    """A little-endian number; -> where it ends."""
    for i in range(n_bytes):
        raw[at + i] = (value >> (8 * i)) & 0xFF
    return at + n_bytes


@compiled
def _index_heads(rows: Integers, counts: Integers, indexes: Bytes) -> Integers:
    """Write the head of each channel's index; -> where they begin, and the end of the last one."""
    entries, begins = np.zeros(len(counts), np.int64), np.zeros(len(counts) + 1, np.int64)
    for row in rows:
        entries[row[_CHANNEL]] += 1
    for channel in range(len(counts)):
        at = begins[channel]
        n_bytes = 16 * entries[channel]
        begins[channel + 1] = at + _INDEX_BYTES + n_bytes if n_bytes else at
        if n_bytes:
            at = _put(indexes, at, _OP_INDEX, 1)
            at = _put(indexes, at, 6 + n_bytes, 8)
            _put(indexes, _put(indexes, at, channel, 2), n_bytes, 4)
    return begins


def _pack_chunk(rows: Integers, contents: Bytes, counts: Integers, records: Bytes, indexes: Bytes) -> Integers:
    """Write the records of a chunk and the index records behind it, count the messages; -> see `_index_heads`."""
    begins = _index_heads(rows, counts, indexes)
    entry_at, read, at = begins + _INDEX_BYTES, 0, 0
    for row in rows:
        channel, time, length = row[_CHANNEL], row[_TIME], row[_LENGTH]
        entry_at[channel] = _put(indexes, _put(indexes, entry_at[channel], time, 8), at, 8)
        at = _put(records, _put(records, at, _OP_MESSAGE, 1), _MESSAGE_BYTES - 9 + length, 8)
        at = _put(records, _put(records, at, channel, 2), counts[channel], 4)
        at = _put(records, _put(records, at, time, 8), time, 8)
        records[at : at + length] = contents[read : read + length]
        counts[channel] += 1
        at, read = at + length, read + length
    return begins


_I, _U = numba.int64, numba.types.Array(numba.uint8, 1, "C", readonly=True)
_pack: Any = compiled(_pack_chunk, _I[::1](_I[:, ::1], _U, _I[::1], numba.uint8[::1], numba.uint8[::1]))
