"""A flight log as a source: the raw events of `/raw` in the order they arrived, whatever speed they are read at."""

from collections.abc import Callable, Collection, Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

from thrustd.core.errors import LogError
from thrustd.core.types import Event, Fault
from thrustd.sources.mcap_damage import Gap
from thrustd.sources.mcap_walk import LogMessage, McapWalk
from thrustd.sources.plain_file import file_bytes
from thrustd.wire.event_batch import ENCODING, EventBatch, Messages
from thrustd.wire.log_layout import HEADER_NAME, RAW_TOPIC, LogHeader

Hear = Callable[[list[LogMessage]], None]


class LogFile:
    """One log, opened as often as it is iterated. `path` must exist and start like a thrustd log, else LogError.

    A damaged log is a LogError at the end of the iteration; with `salvage` what is whole of it is read.
    """

    def __init__(self, path: Path, salvage: bool = False) -> None:
        self.path = path
        self.damage = ""  # with `salvage`: what is lost, in words; known after a complete iteration
        self._salvage = salvage
        self._gaps: list[Gap] = []  # of the running iteration
        self.size_bytes = 0
        self.position_bytes = 0  # how far the running iteration is
        self.cut = False  # the file ended without a summary; known after a complete iteration
        self.read_events = 0  # counted while `events` runs
        self.missing_events = 0  # dropped by the recorder; counted while `events` runs
        self.next_number: int | None = None  # of the event after the last one read
        self.header = self._read_header()

    def events(self, first_number: int | None = None) -> Iterator[Event]:
        """`batches`, one event after the other."""
        for batch in self.batches(first_number):
            yield from batch.events()

    def batches(
        self, first_number: int | None = None, topics: Collection[str] = (), hear: Hear | None = None
    ) -> Iterator[EventBatch]:
        """Raw events in arrival order; `first_number` is known when the file before in the run was read.

        `hear` is told the messages of `topics` that are met on the way, before the events of the same record.
        What damage took is a Fault before the next event.
        """
        self.missing_events = self.read_events = 0
        self.next_number = 0 if self.header.part == 0 else first_number
        seen, told, last_ns = False, 0, 0
        for walk, messages in self._walk(lambda topic: topic == RAW_TOPIC or topic in topics):
            raw = [message for message in messages if message[0] == RAW_TOPIC]
            if hear is not None and len(raw) < len(messages):
                hear([message for message in messages if message[0] != RAW_TOPIC])
            if not raw:
                continue
            found = self._decode(walk, raw)
            for number, n in zip(found.first_numbers, found.n_events, strict=True):
                if self.next_number is not None:
                    self.missing_events += max(0, number - self.next_number)
                self.next_number = number + n
            seen = True
            self.read_events += len(found.batch)
            if len(self._gaps) > told:
                yield _fault(found.batch.t_ns.item(0), self._gaps[told:])
                told = len(self._gaps)
            last_ns = found.batch.t_ns.item(-1)
            yield found.batch
        if len(self._gaps) > told:
            yield _fault(last_ns, self._gaps[told:])
        if not seen and not self.cut:
            raise LogError(f"{self.path}: no message on topic {RAW_TOPIC!r}, expected the raw events of a flight")

    def messages(self, topics: Collection[str] | None = None) -> Iterator[LogMessage]:
        """Messages in file order, of `topics` or of all but `/raw`."""
        for group in self.groups(topics):
            yield from group

    def groups(self, topics: Collection[str] | None = None) -> Iterator[list[LogMessage]]:
        """`messages`, as many as are in one record of the file together."""
        wanted = (lambda topic: topic != RAW_TOPIC) if topics is None else (lambda topic: topic in topics)
        for _, messages in self._walk(wanted):
            yield messages

    def _decode(self, walk: McapWalk, messages: list[LogMessage]) -> Messages:
        encoding = walk.encodings[RAW_TOPIC]
        if encoding != ENCODING:
            raise LogError(f"{self.path}: topic {RAW_TOPIC!r} is encoded {encoding!r}, expected {ENCODING!r}")
        try:
            return Messages([message.data for message in messages])
        except LogError as error:
            raise LogError(f"{self.path}: {error}") from None

    def _walk(self, wanted: Callable[[str], bool]) -> Iterator[tuple[McapWalk, list[LogMessage]]]:
        """The wanted messages, record by record of the file."""
        with self._open() as stream:
            walk = McapWalk(stream, str(self.path), wanted, self._salvage)
            self._gaps = walk.gaps
            for messages in walk.records():
                self.position_bytes = walk.position_bytes
                if messages:
                    yield walk, messages
            self.cut, self.position_bytes, self.damage = walk.cut, walk.position_bytes, walk.account()

    def _read_header(self) -> LogHeader:
        with self._open() as stream:
            walk = McapWalk(stream, str(self.path), salvage=self._salvage)
            self.size_bytes = walk.size_bytes
            for messages in walk.records():
                if HEADER_NAME in walk.metadata or messages:
                    break
        try:
            return LogHeader.from_metadata(walk.metadata.get(HEADER_NAME, {}))
        except LogError as error:
            damage = f"{walk.account()}: " if walk.gaps else ""
            raise LogError(f"{self.path}: {damage}{error}") from None

    def _open(self) -> BinaryIO:
        file_bytes(self.path, LogError)
        try:
            return self.path.open("rb")
        except OSError as error:
            raise LogError(f"{self.path}: cannot be read: {error.strerror or error}") from None


def _fault(t_ns: int, gaps: Sequence[Gap]) -> EventBatch:
    return EventBatch.of([Fault(t_ns, "log", "damaged", count=max(1, sum(gap.n_records for gap in gaps)))])
