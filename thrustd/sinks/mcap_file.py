"""An MCAP file, written: messages into zstd chunks with indexes, checksums everywhere.

The `mcap` package's own writer takes several us per message, as much as a replay at 200 x real time has for
everything. So messages and their indexes are packed here; the rare records come from the package.
Every byte is under a checksum: chunks, data section and summary have one each.
Reference: MCAP format specification, version 0 (https://mcap.dev/spec).
"""

import zlib
from collections import Counter, defaultdict
from struct import Struct, pack
from typing import Any, BinaryIO

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

MAGIC = b"\x89MCAP0\r\n"
CHUNK_BYTES = 64 * 1024  # closing a chunk of this size stalls about 0.5 ms
ZSTD_LEVEL = 1
COMPRESSION = b"zstd"
_OP_MESSAGE = int(Opcode.MESSAGE)
_MESSAGE = Struct("<BQHIQQ")
_MESSAGE_FIXED_BYTES = 22  # of the record's length: channel, sequence and two times
_CHUNK = Struct(f"<BQQQQII{len(COMPRESSION)}sQ")
_CHUNK_FIXED_BYTES = _CHUNK.size - 9
_INDEX = Struct("<BQHI")


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
        self._counts: Counter[int] = Counter()
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
        self._write(_packed(channel))
        return number

    def add_metadata(self, name: str, values: dict[str, str]) -> None:
        record = _packed(Metadata(name, values))
        self._metadata.append(MetadataIndex(self.bytes_written, len(record), name))
        self._write(record)

    def add_message(self, channel_id: int, t_ns: int, data: bytes) -> None:
        """One message at `t_ns` >= 0 [ns since the epoch]; closes the chunk when it is full."""
        length = len(data)
        entries = self._entries[channel_id]
        sequence = self._counts[channel_id] + (len(entries) >> 1)
        entries += (t_ns, self._size)
        head = _MESSAGE.pack(_OP_MESSAGE, _MESSAGE_FIXED_BYTES + length, channel_id, sequence, t_ns, t_ns)
        self._parts += (head, data)
        self._size += _MESSAGE.size + length
        if self._size >= self._chunk_bytes:
            self.close_chunk()

    def close_chunk(self) -> None:
        """Put what is pending into a chunk and hand it to the stream. Nothing pending: nothing happens."""
        if not self._parts:
            return
        records, entries = b"".join(self._parts), self._entries
        self._counts.update({channel: len(entry) // 2 for channel, entry in entries.items()})
        first_ns = min(min(entry[::2]) for entry in entries.values())
        last_ns = max(max(entry[::2]) for entry in entries.values())
        self._open_chunk()
        squeezed = self._compress(records)
        start = self.bytes_written
        head = _CHUNK.pack(
            Opcode.CHUNK, _CHUNK_FIXED_BYTES + len(squeezed), first_ns, last_ns, len(records),
            zlib.crc32(records), len(COMPRESSION), COMPRESSION, len(squeezed),
        )  # fmt: skip
        indexes = {channel: _packed_index(channel, entry) for channel, entry in entries.items()}
        self._write(b"".join((head, squeezed, *indexes.values())))
        chunk_end = start + len(head) + len(squeezed)
        self._remember(first_ns, last_ns, start, chunk_end, len(squeezed), len(records), indexes)

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
        self._parts: list[bytes] = []
        self._size = 0
        self._entries: defaultdict[int, list[int]] = defaultdict(list)  # channel -> time, offset, time, offset ...

    def _write(self, data: bytes | bytearray) -> None:
        self._stream.write(data)
        self._crc = zlib.crc32(data, self._crc)
        self.bytes_written += len(data)

    def _remember(
        self, first_ns: int, last_ns: int, start: int, end: int, squeezed: int, size: int, indexes: dict[int, bytes]
    ) -> None:
        offsets, at = {}, end
        for channel, record in indexes.items():
            offsets[channel] = at
            at += len(record)
        self._first_ns = first_ns if self._first_ns is None else min(first_ns, self._first_ns)
        self._last_ns = max(last_ns, self._last_ns)
        index = ChunkIndex(
            message_start_time=first_ns, message_end_time=last_ns, chunk_start_offset=start,
            chunk_length=end - start, message_index_offsets=offsets, message_index_length=at - end,
            compression=COMPRESSION.decode(), compressed_size=squeezed, uncompressed_size=size,
        )  # fmt: skip
        self._index += _packed(index)
        self._n_chunks += 1

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=0, channel_count=len(self._channels), channel_message_counts=dict(self._counts),
            chunk_count=self._n_chunks, message_count=self._counts.total(),
            metadata_count=len(self._metadata), message_start_time=self._first_ns or 0,
            message_end_time=self._last_ns, schema_count=len(self._schemas),
        )  # fmt: skip


def _packed(record: McapRecord) -> bytes:
    builder: Any = RecordBuilder()  # untyped in the package
    record.write(builder)
    return bytes(builder.end())


def _packed_index(channel_id: int, entries: list[int]) -> bytes:
    n_bytes = 8 * len(entries)
    return _INDEX.pack(Opcode.MESSAGE_INDEX, 6 + n_bytes, channel_id, n_bytes) + pack(f"<{len(entries)}Q", *entries)
