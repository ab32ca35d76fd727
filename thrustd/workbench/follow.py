"""A flight log that is still being written, read on from where it was left: what the live page shows.

Only whole records are taken; a chunk that is half on the disk waits for the next look. Estimates and mounts are kept
at `SHOW_HZ` for the last `KEEP_ROWS` rows, readings and faults as their latest state.
"""

import threading
from collections import Counter
from io import BytesIO
from pathlib import Path
from struct import Struct
from typing import Any

import msgspec
from mcap.exceptions import EndOfFile, McapError
from mcap.records import Channel, Chunk, Message
from mcap.stream_reader import StreamReader, breakup_chunk
from zstandard import ZstdError

from thrustd.core.errors import LogError
from thrustd.sources.mcap_walk import MAGIC  # at the beginning, and at the end of a log that was finished

MAGIC_BYTES = len(MAGIC)
SHOW_HZ = 10.0
KEEP_ROWS = 36_000  # an hour at SHOW_HZ, for each engine and mount
READ_BYTES = 32 << 20  # at most per look
MAX_RECORD_BYTES = 64 << 20
_HEAD = Struct("<BQ")
_SHOWN = ("/estimate/", "/mount/")


class FollowedLog:
    """One log; `read_on` takes what is new, `answer` says it."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._lock = threading.Lock()
        self._at = MAGIC_BYTES
        self._topics: dict[int, tuple[str, str]] = {}
        self._rows: list[dict[str, Any]] = []
        self._dropped = 0  # rows no longer kept
        self._last_ns: dict[str, int] = {}
        self._readings: dict[str, dict[str, Any]] = {}
        self._faults: Counter[str] = Counter()
        self._latest_ns = 0
        self._decode = msgspec.json.Decoder().decode

    def read_on(self) -> None:
        """Take the whole records that were added; LogError for a file that is no MCAP."""
        with self._lock, self.path.open("rb") as file:
            if self._at == MAGIC_BYTES and not file.read(MAGIC_BYTES).startswith(MAGIC):
                raise LogError(f"{self.path.name}: is not a flight log (MCAP)")
            file.seek(self._at)
            content = file.read(READ_BYTES)
            whole, n_records = _whole(content, self.path.name)
            self._take(content[:whole], n_records)
            if len(content) < READ_BYTES and content.endswith(MAGIC) and whole != len(content) - MAGIC_BYTES:
                raise LogError(f"{self.path.name}: damaged near byte {self._at + whole}: a length that cannot be")
            self._at += whole

    def answer(self, after: int) -> dict[str, Any]:
        """Rows numbered `after` and later, and the latest of everything else."""
        with self._lock:
            first = max(after - self._dropped, 0)
            return {
                "rows": self._rows[first:],
                "next": self._dropped + len(self._rows),
                "readings": self._readings,
                "faults": dict(self._faults),
                "latest_ns": self._latest_ns,
                "bytes": self._at,
            }

    def _take(self, content: bytes, n_records: int) -> None:
        taken = 0
        try:
            for record in StreamReader(BytesIO(content), skip_magic=True, emit_chunks=True).records:
                inner = breakup_chunk(record, validate_crc=True) if isinstance(record, Chunk) else [record]
                for item in inner:
                    self._record(item)
                taken += 1
        except EndOfFile:  # the reader says so at the end of what it was given, and of a record that ends too early
            if taken < n_records:
                raise LogError(f"{self.path.name}: damaged near byte {self._at}: a record that does not fit") from None
        except (McapError, ZstdError, msgspec.DecodeError, EOFError, ValueError) as problem:
            raise LogError(f"{self.path.name}: damaged near byte {self._at}: {type(problem).__name__}") from None

    def _record(self, record: Any) -> None:
        if isinstance(record, Channel):
            self._topics[record.id] = (record.topic, record.message_encoding)
        elif isinstance(record, Message):
            topic, encoding = self._topics.get(record.channel_id, ("", ""))
            if encoding == "json":
                self._message(topic, self._decode(record.data))

    def _message(self, topic: str, said: dict[str, Any]) -> None:
        t_ns = int(said.get("t_ns", 0))
        self._latest_ns = max(self._latest_ns, t_ns)
        if topic.startswith(_SHOWN):
            if t_ns - self._last_ns.get(topic, -(10**12)) >= 0.999e9 / SHOW_HZ:
                self._last_ns[topic] = t_ns
                self._rows.append({"topic": topic, **said})
                self._forget()
        elif topic.startswith("/reading/"):
            self._readings[topic.removeprefix("/reading/")] = said
        elif topic == "/fault" and said.get("active", True):
            self._faults[f"{said['where']} {said['kind']}"] += int(said.get("count", 1))

    def _forget(self) -> None:
        beyond = len(self._rows) - KEEP_ROWS * max(1, len(self._last_ns))
        if beyond > 2000:
            del self._rows[:beyond]
            self._dropped += beyond


def _whole(content: bytes, name: str) -> tuple[int, int]:
    """Bytes of `content` that are whole records, and how many these are."""
    at = n_records = 0
    while at + _HEAD.size <= len(content):
        _, length = _HEAD.unpack_from(content, at)
        if length > MAX_RECORD_BYTES:
            raise LogError(f"{name}: damaged: a record of {length} bytes")
        if at + _HEAD.size + length > len(content):
            break
        at, n_records = at + _HEAD.size + length, n_records + 1
    return at, n_records
