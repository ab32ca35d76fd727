"""The files of one run: names never used before, rotated by size and time, given up when the disk refuses.

    <aircraft>_<flight>_<UTC>_<part>.mcap    flight: one more than the largest in the folder

The calendar clock of an aircraft may be years off after a flat battery: which logs are old is said by their flight
number and part, never by the time in their name.
"""

import os
import re
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from errno import ENOENT
from pathlib import Path
from typing import BinaryIO, NamedTuple

import msgspec

from thrustd.core.types import Output
from thrustd.sinks.mcap_log import LogWriter
from thrustd.sinks.whole_file import sync_folder
from thrustd.wire.event_batch import EventBatch
from thrustd.wire.log_layout import LogHeader


class RecorderSettings(NamedTuple):
    """Where and how; sizes in MB = 10^6 bytes."""

    folder: Path
    name: str = "flight"
    rotate_mb: float = 500.0
    rotate_min: float = 60.0
    reading_hz: float = 10.0
    keep_free_mb: float = 0.0  # delete the oldest logs of this name when less is free; 0 = never


class Parcel(NamedTuple):
    """What was recorded together; `first_number` numbers the events of the run without gaps."""

    first_number: int
    batches: list[EventBatch]
    outputs: list[Output]

    def n_events(self) -> int:
        return sum(map(len, self.batches))


def _free_bytes(folder: Path) -> int:
    disk = os.statvfs(folder)
    return disk.f_bavail * disk.f_frsize


def _discard(stream: BinaryIO) -> None:
    with suppress(OSError):  # closing tries to write what is still buffered
        stream.close()


def _exclusive(path: Path) -> BinaryIO:
    return path.open("xb")


def _claim(part: Path, folder: Path, stem: str) -> Path:
    """Give `part` the first of stem.mcap, stem-1.mcap ... that is free. Its header is written: no log is without."""
    attempt = 0
    while True:
        path = folder / (f"{stem}-{attempt}.mcap" if attempt else f"{stem}.mcap")
        try:
            os.link(part, path)  # never overwrites
        except FileExistsError:
            attempt += 1
            continue
        except OSError:  # a file system without hard links
            if path.exists():
                attempt += 1
                continue
            part.rename(path)
        part.unlink(missing_ok=True)
        sync_folder(folder)
        return path


def _still_there(path: Path, stream: BinaryIO) -> None:
    """OSError when the file being written has no name any more: what goes into it is lost."""
    if not os.path.samestat(path.stat(), os.fstat(stream.fileno())):
        raise OSError(ENOENT, os.strerror(ENOENT), str(path))


def _utc_now() -> datetime:
    return datetime.now(UTC)


class Disk(NamedTuple):
    """What the recorder asks of the machine; a test has its own."""

    open_file: Callable[[Path], BinaryIO] = _exclusive
    free_bytes: Callable[[Path], int] = _free_bytes
    utc: Callable[[], datetime] = _utc_now


REAL_DISK = Disk()


class LogFiles:
    """The file being written, and the next one. Only the recorder's thread uses it; OSError goes through."""

    def __init__(self, settings: RecorderSettings, header: LogHeader, disk: Disk) -> None:
        self.path: Path | None = None
        self._settings = settings
        self._name = re.sub(r"[^\w-]+", "-", settings.name)  # it becomes part of file names
        self._header = header
        self._disk = disk
        self._stream: BinaryIO | None = None
        self._writer: LogWriter | None = None
        self._part, self._run = header.part, header.run  # an unnamed run is named after its first file
        self._started_ns: int | None = None
        self._flight = 0  # numbered at the first file
        self._unsynced_items = self._file_items = 0
        self._syncs = 0  # of the writer, as last seen

    def start(self) -> None:
        """Open the next file under a name that was never used, header on the disk."""
        folder = self._settings.folder
        folder.mkdir(parents=True, exist_ok=True)
        self._flight = self._flight or 1 + max((flight for (flight, _), _ in self._old_logs()), default=0)
        if self._settings.keep_free_mb > 0:
            self._make_room()
        flight_stamp = f"{self._flight:05d}_{self._disk.utc():%Y%m%dT%H%M%SZ}"
        self._run = self._run or f"{self._name}_{flight_stamp}"
        stem = f"{self._name}_{flight_stamp}_{self._part:04d}"
        header = msgspec.structs.replace(self._header, part=self._part, run=self._run)
        part = folder / f".{stem}.{os.getpid()}.part"
        part.unlink(missing_ok=True)
        stream = self._disk.open_file(part)
        try:
            writer = LogWriter(stream, header, self._settings.reading_hz)
            writer.sync()
            path = _claim(part, folder, stem)
        except OSError:
            _discard(stream)
            part.unlink(missing_ok=True)
            raise
        self._stream, self._writer, self.path = stream, writer, path
        self._part += 1
        self._started_ns, self._unsynced_items, self._file_items, self._syncs = None, 0, 0, writer.syncs

    def ready(self) -> bool:
        """Make sure there is a file; true when there was none."""
        if self._writer is not None:
            return False
        self.start()
        return True

    def write(self, parcel: Parcel) -> None:
        writer, stream, path = self._writer, self._stream, self.path
        assert writer is not None and stream is not None and path is not None, "ready() comes first"
        items = parcel.n_events() + len(parcel.outputs)
        self._unsynced_items += items
        self._file_items += items
        writer.write_batches(parcel.batches, parcel.first_number)
        for output in parcel.outputs:
            writer.write_output(output)
        if writer.syncs != self._syncs:
            self._syncs = writer.syncs
            self._unsynced_items = self._file_items  # if it is gone, all of it is lost
            _still_there(path, stream)
            self._unsynced_items = items  # it syncs before it takes a new parcel
        if parcel.batches:
            self._rotate_when_due(parcel.batches[-1].t_ns.item(-1))

    def finish(self) -> None:
        """Summary, disk, closed. Nothing open: nothing happens."""
        if self._writer is not None and self._stream is not None:
            self._writer.close()
            os.fsync(self._stream.fileno())
            self._stream.close()
        self._writer = self._stream = self.path = None

    def give_up(self) -> int:
        """Let go of a file that cannot be written; the items lost with it."""
        stream, lost = self._stream, self._unsynced_items
        self._writer = self._stream = self.path = None
        self._unsynced_items = 0
        if stream is not None:
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

    def _old_logs(self) -> list[tuple[tuple[int, int], Path]]:
        """Flight and part of the logs of this name, the oldest first; those from before flights had numbers are 0."""
        pattern = re.compile(rf"{re.escape(self._name)}_(?:(\d+)_)?\d+T\d+Z_(\d+)(?:-\d+)?\.mcap")
        found = ((pattern.fullmatch(path.name), path) for path in self._settings.folder.iterdir())
        return sorted(((int(name[1] or 0), int(name[2])), path) for name, path in found if name)

    def _make_room(self) -> None:
        """Delete the oldest finished logs of this name until `keep_free_mb` is free."""
        folder = self._settings.folder
        for _, path in self._old_logs():
            if self._disk.free_bytes(folder) >= self._settings.keep_free_mb * 1e6:
                return
            with suppress(OSError):
                path.unlink()
