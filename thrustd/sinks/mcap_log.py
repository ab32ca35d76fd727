"""The flight log: raw events in arrival order, outputs as JSON, everything about the run in the header.

`LogWriter` is synchronous and deterministic: what is in the file depends only on what was written to it. Events are
batched (at most 64, or 20 ms), chunks close at 64 KiB, and every `sync_s` of event time everything goes to the disk,
so that a kill at any moment loses less than a second. A thread around it is in `log_recorder`.
"""

import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, Final

from thrustd import __version__
from thrustd.core.errors import LogError
from thrustd.core.types import Event, Fault, Output, Reading
from thrustd.sinks.mcap_file import McapFile
from thrustd.sinks.whole_file import whole_file
from thrustd.wire.event_batch import ENCODING, MAX_EVENTS, EventBatch
from thrustd.wire.log_layout import (
    HEADER_NAME,
    RAW_TOPIC,
    TRUTH_TOPIC,
    LogHeader,
    TopicKind,
    Topics,
    json_schema,
    schema_name,
)

BATCH_NS: Final = 20_000_000
SYNC_S = 0.5  # of event time; "at most one second lost" includes a late writer
LIBRARY = f"thrustd {__version__}"
_ID, _DUE_NS = range(2)


class LogWriter:
    """Events, outputs and truth into one MCAP stream."""

    def __init__(
        self, stream: BinaryIO, header: LogHeader, reading_hz: float = 10.0, sync_s: float | None = SYNC_S
    ) -> None:
        """`reading_hz` thins decoded channels (0 = none); `sync_s` None = leave flushing to the caller."""
        self.syncs = 0  # how often everything went to the disk
        self._stream = stream
        self._file = McapFile(stream, LIBRARY)
        self._offset_ns = header.epoch_offset_ns
        self._topics = Topics(header.engines, header.mounts)
        self._reading_ns = round(1e9 / reading_hz) if reading_hz > 0 else 0
        self._sync_ns = None if sync_s is None else round(sync_s * 1e9)
        self._synced_ns: int | None = None
        self._batch: list[Event] = []
        self._batch_number = self._batch_ns = 0  # of the first event in the batch
        self._schema_ids: dict[str, int] = {}
        self._channel_ids: dict[str, int] = {}  # by topic
        self._said: dict[Any, list[int]] = {}  # by what is said and of whom: channel id, when the next reading is due
        self._file.add_metadata(HEADER_NAME, header.to_metadata())
        self._raw_id = self._file.add_channel(RAW_TOPIC, ENCODING, 0)
        for place in self._topics.fixed():
            self._channel(place)

    @property
    def bytes_written(self) -> int:
        return self._file.bytes_written

    def write_event(self, event: Event, number: int | None = None) -> None:
        """The next raw event; `number` when events before it were dropped, else it counts up by one."""
        t_ns = event[0]
        batch = self._batch
        if batch:
            gap = number is not None and number != self._batch_number + len(batch)
            if gap or len(batch) >= MAX_EVENTS or not self._batch_ns <= t_ns < self._batch_ns + BATCH_NS:
                self._close_batch()
                self._sync_when_due(t_ns)
                batch = self._batch
        if not batch:
            self._batch_ns = t_ns
            if number is not None:
                self._batch_number = number
        batch.append(event)

    def write_batches(self, batches: Sequence[EventBatch], number: int) -> None:
        """Raw events that are batches already, a message each; `number` of the first event."""
        self._close_batch()
        for place, batch in enumerate(batches):
            if place == 0:
                self._sync_when_due(batch.t_ns.item(0))
            self._add(batch, number)
            number += len(batch)
        self._batch_number = number

    def write_output(self, output: Output) -> None:
        """One output of the pipeline; readings beyond `reading_hz` are left out."""
        self.write_outputs((output,))

    def write_outputs(self, outputs: Iterable[Output]) -> None:
        """The same of several: each costs less."""
        find, encode, add, log_ns = self._said.get, self._topics.encode, self._file.add_message, self._log_ns
        every_ns, early_ns = self._reading_ns, self._reading_ns // 4  # at this rate it may jitter
        for output in outputs:
            kind, t_ns = type(output), output[0]
            key: Any = output[1:3] if kind is Reading else kind if kind is Fault else (kind, output[1])
            said = find(key) or self._new_place(key, self._topics.of(output), t_ns)
            if kind is Reading:
                if every_ns == 0 or said[_DUE_NS] - t_ns > early_ns:
                    continue
                said[_DUE_NS] = t_ns + every_ns
            add(said[_ID], log_ns(t_ns), encode(output))

    def write_truth(self, name: str, t_ns: int, value_n: float) -> None:
        """True thrust of the engine or true force on the mount called `name`."""
        said = self._said.get(name) or self._new_place(name, self._topics.of_truth(name), t_ns)
        self._file.add_message(said[_ID], self._log_ns(t_ns), self._topics.encode_truth(name, t_ns, value_n))

    def copy(self, messages: Sequence[tuple[str, int, bytes]]) -> None:
        """Topic, log time and data of truth in a chunk of another log of this flight, as they are."""
        topics = dict.fromkeys([topic for topic, _, _ in messages])
        ids = {topic: self._channel(self._topics.of_truth(topic.removeprefix(TRUTH_TOPIC))) for topic in topics}
        self._file.add_messages([(ids[topic], log_ns, data) for topic, log_ns, data in messages])

    def sync(self) -> None:
        """Everything written so far is readable after this, and on the disk if the stream is a file."""
        self._close_batch()
        self._file.close_chunk()
        self._stream.flush()
        self.syncs += 1
        try:
            descriptor = self._stream.fileno()
        except (OSError, AttributeError):
            return  # not a file: nothing to wait for
        os.fsync(descriptor)

    def close(self) -> None:
        """Write the summary and flush; the stream stays open."""
        self._close_batch()
        self._file.finish()
        self._stream.flush()

    def _log_ns(self, t_ns: int) -> int:
        log_ns = t_ns + self._offset_ns
        return log_ns if log_ns > 0 else 0  # MCAP times are unsigned

    def _close_batch(self) -> None:
        if self._batch:
            batch, self._batch = EventBatch.of(self._batch), []
            self._add(batch, self._batch_number)
            self._batch_number += len(batch)

    def _add(self, batch: EventBatch, number: int) -> None:
        self._file.add_message(self._raw_id, self._log_ns(batch.t_ns.item(0)), batch.encode(number))

    def _sync_when_due(self, t_ns: int) -> None:
        if self._sync_ns is None:
            return
        if self._synced_ns is None:
            self._synced_ns = t_ns
        elif not 0 <= t_ns - self._synced_ns < self._sync_ns:
            self._synced_ns = t_ns
            self.sync()

    def _new_place(self, key: Any, place: TopicKind, t_ns: int) -> list[int]:
        said = self._said[key] = [self._channel(place), t_ns]
        return said

    def _channel(self, place: TopicKind) -> int:
        found = self._channel_ids.get(place.topic)
        if found is None:
            name = schema_name(place.kind)
            if name not in self._schema_ids:
                self._schema_ids[name] = self._file.add_schema(name, json_schema(place.kind))
            found = self._file.add_channel(place.topic, "json", self._schema_ids[name])
            self._channel_ids[place.topic] = found
        return found


@contextmanager
def new_log(path: Path, header: LogHeader, reading_hz: float = 10.0) -> Iterator[LogWriter]:
    """A log written on the ground: under `path` only when complete, nothing left behind when it fails."""
    with whole_file(path, LogError) as part, part.open("wb") as stream:
        writer = LogWriter(stream, header, reading_hz, sync_s=None)
        yield writer
        writer.close()
