"""The recorder in flight: `LogWriter` in its own thread behind a bounded queue, so that no disk holds up an estimate.

    producer:  events and outputs -> parcel (64 events or 20 ms) -> queue        never waits, never raises
    thread:    queue -> LogWriter -> file, rotated by size and time, synced twice per second

A disk that is too slow fills the queue: the oldest parcels go, counted as `log_overrun`. A disk that refuses (full,
read-only, gone) is `log_write`: the file is given up, parcels wait in the queue, and a new file is tried with growing
delays; when it works, `log_resumed`. Events keep their numbers, so a log tells what it lacks.
"""

import os
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from threading import Event as Flag
from threading import Thread
from typing import BinaryIO, Final, NamedTuple

import msgspec

from thrustd.errors import LogError
from thrustd.sinks.mcap_log import BATCH_NS, LogWriter
from thrustd.types import Event, Fault, Output
from thrustd.wire.event_batch import MAX_EVENTS
from thrustd.wire.log_layout import LogHeader

WHERE: Final = "log"
MAX_PARCELS = 1024  # about 16 s of a 1 kHz flight, 25 MB
IDLE_S = 0.2  # an idle thread looks for work this often
FIRST_RETRY_S = 0.5
LONGEST_RETRY_S = 10.0
JOIN_S = 10.0


class RecorderSettings(NamedTuple):
    """Where and how; sizes in MB = 10^6 bytes."""

    folder: Path
    name: str = "flight"
    rotate_mb: float = 500.0
    rotate_min: float = 60.0
    reading_hz: float = 10.0


class Parcel(NamedTuple):
    """What was recorded together; `first_number` numbers the events of the run without gaps."""

    first_number: int
    events: list[Event]
    outputs: list[Output]


class LogRecorder:
    """A sink that never waits and never raises once it is started."""

    def __init__(
        self,
        settings: RecorderSettings,
        header: LogHeader,
        report: Callable[[Fault], None],
        open_file: Callable[[Path], BinaryIO] | None = None,
        utc: Callable[[], datetime] = lambda: datetime.now(UTC),
    ) -> None:
        """`report` takes faults from any thread. The first file is opened here: LogError when that fails."""
        self._report = report
        self._files = _Files(settings, header, open_file or _exclusive, utc)
        self._parcels: deque[Parcel] = deque()
        self._parcel = Parcel(0, [], [])
        self._next_number = 0
        self._last_ns = 0
        self._work, self._closing = Flag(), Flag()
        self.dropped_items = 0  # missing in the log for lack of speed
        self.lost_items = 0  # missing because a file had to be given up
        try:
            self._files.start()
        except OSError as error:
            raise LogError(f"{settings.folder}: no log can be written: {error.strerror or error}") from None
        self._thread = Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    @property
    def path(self) -> Path | None:
        """The file being written; None while the disk refuses."""
        return self._files.path

    def write_event(self, event: Event) -> None:
        """The next raw event; hands a parcel over when it is full or old enough."""
        parcel = self._parcel
        events = parcel.events
        if events and (len(events) >= MAX_EVENTS or not 0 <= event.t_ns - events[0].t_ns < BATCH_NS):
            self._hand_over()
            events = self._parcel.events
        events.append(event)
        self._last_ns = event.t_ns
        self._next_number += 1

    def write_output(self, output: Output) -> None:
        """One output of the pipeline; travels with the events around it."""
        self._parcel.outputs.append(output)

    def close(self) -> None:
        """Write what is pending and finish the file."""
        self._hand_over()
        self._closing.set()
        self._work.set()
        self._thread.join(JOIN_S)

    def _hand_over(self) -> None:
        self._parcels.append(self._parcel)
        self._parcel = Parcel(self._next_number, [], [])
        if len(self._parcels) > MAX_PARCELS:
            with suppress(IndexError):  # the thread may have taken it just now
                oldest = self._parcels.popleft()
                count = len(oldest.events) + len(oldest.outputs)
                self.dropped_items += count
                self._report(Fault(self._last_ns, WHERE, "log_overrun", count))
        self._work.set()

    def _run(self) -> None:
        retry_s = FIRST_RETRY_S
        while True:
            self._work.wait(IDLE_S)
            self._work.clear()
            closing = self._closing.is_set()
            if self._drain():
                retry_s = FIRST_RETRY_S
            elif not closing:
                self._closing.wait(retry_s)
                retry_s = min(2 * retry_s, LONGEST_RETRY_S)
            if closing:
                self._guard(self._files.finish)
                return

    def _drain(self) -> bool:
        """Write all waiting parcels; False when the disk refused."""
        while self._parcels:
            if not self._guard(self._files.ready):
                return False
            try:
                parcel = self._parcels.popleft()
            except IndexError:
                return True
            if not self._guard(partial(self._files.write, parcel)):
                return False
        return True

    def _guard(self, action: Callable[[], bool | None]) -> bool:
        """Do `action`; a refusing disk is counted and told, once per file. `action` is true when a file came back."""
        try:
            resumed = action()
        except OSError:
            lost = self._files.give_up()
            if lost is not None:
                self.lost_items += lost
                self._report(Fault(self._last_ns, WHERE, "log_write", lost))
            return False
        if resumed:
            self._report(Fault(self._last_ns, WHERE, "log_resumed"))
        return True


class _Files:
    """The file being written, and the next one. Only the recorder's thread uses it; OSError goes through."""

    def __init__(
        self,
        settings: RecorderSettings,
        header: LogHeader,
        open_file: Callable[[Path], BinaryIO],
        utc: Callable[[], datetime],
    ) -> None:
        self.path: Path | None = None
        self._settings = settings
        self._header = header
        self._open_file = open_file
        self._utc = utc
        self._stream: BinaryIO | None = None
        self._writer: LogWriter | None = None
        self._part = header.part
        self._started_ns: int | None = None
        self._unsynced_items = 0
        self._syncs = 0  # of the writer, as last seen

    def start(self) -> None:
        """Open the next file under a name that was never used, header on the disk."""
        folder = self._settings.folder
        folder.mkdir(parents=True, exist_ok=True)
        stamp = self._utc().strftime("%Y%m%dT%H%M%SZ")
        path, stream = _first_free(folder, f"{self._settings.name}_{stamp}_{self._part:04d}", self._open_file)
        header = msgspec.structs.replace(self._header, part=self._part)
        try:
            writer = LogWriter(stream, header, self._settings.reading_hz)
            writer.sync()
        except OSError:
            _discard(stream)
            path.unlink(missing_ok=True)
            raise
        self._stream, self._writer, self.path = stream, writer, path
        self._part += 1
        self._started_ns, self._unsynced_items, self._syncs = None, 0, writer.syncs

    def ready(self) -> bool:
        """Make sure there is a file; true when there was none."""
        if self._writer is not None:
            return False
        self.start()
        return True

    def write(self, parcel: Parcel) -> None:
        writer = self._writer
        assert writer is not None, "ready() comes first"
        self._unsynced_items += len(parcel.events) + len(parcel.outputs)
        for number, event in enumerate(parcel.events, start=parcel.first_number):
            writer.write_event(event, number)
        for output in parcel.outputs:
            writer.write_output(output)
        if writer.syncs != self._syncs:
            self._syncs, self._unsynced_items = writer.syncs, 0
        if parcel.events:
            self._rotate_when_due(parcel.events[-1].t_ns)

    def finish(self) -> None:
        """Summary, disk, closed. Nothing open: nothing happens."""
        if self._writer is not None and self._stream is not None:
            self._writer.close()
            os.fsync(self._stream.fileno())
            self._stream.close()
        self._writer = self._stream = self.path = None

    def give_up(self) -> int | None:
        """Let go of a file that cannot be written; the items lost with it, None when there was no file."""
        stream, lost = self._stream, self._unsynced_items
        self._writer = self._stream = self.path = None
        self._unsynced_items = 0
        if stream is None:
            return None
        _discard(stream)
        return lost

    def _rotate_when_due(self, t_ns: int) -> None:
        if self._started_ns is None:
            self._started_ns = t_ns
        assert self._writer is not None
        too_large = self._writer.bytes_written > self._settings.rotate_mb * 1e6
        if too_large or t_ns - self._started_ns > self._settings.rotate_min * 60e9:
            self.finish()
            self.start()


def _discard(stream: BinaryIO) -> None:
    with suppress(OSError):  # closing tries to write what is still buffered
        stream.close()


def _exclusive(path: Path) -> BinaryIO:
    return path.open("xb")


def _first_free(folder: Path, stem: str, open_file: Callable[[Path], BinaryIO]) -> tuple[Path, BinaryIO]:
    """Open the first of stem.mcap, stem-1.mcap, stem-2.mcap ... that does not exist."""
    attempt = 0
    while True:
        path = folder / (f"{stem}-{attempt}.mcap" if attempt else f"{stem}.mcap")
        try:
            return path, open_file(path)
        except FileExistsError:
            attempt += 1
