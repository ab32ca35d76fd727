"""The files of one run: names never used before, rotated by size and time, given up when the disk refuses."""

import os
import re
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from glob import escape
from pathlib import Path
from typing import BinaryIO, NamedTuple

import msgspec

from thrustd.core.types import Output
from thrustd.sinks.mcap_log import LogWriter
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
        _sync_folder(folder)
        return path


def _sync_folder(folder: Path) -> None:
    """The name survives a power cut too."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


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
        self._unsynced_items = 0
        self._syncs = 0  # of the writer, as last seen

    def start(self) -> None:
        """Open the next file under a name that was never used, header on the disk."""
        folder = self._settings.folder
        folder.mkdir(parents=True, exist_ok=True)
        if self._settings.keep_free_mb > 0:
            self._make_room()
        stamp = self._disk.utc().strftime("%Y%m%dT%H%M%SZ")
        self._run = self._run or f"{self._name}_{stamp}"
        stem = f"{self._name}_{stamp}_{self._part:04d}"
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
        items = parcel.n_events() + len(parcel.outputs)
        self._unsynced_items += items
        writer.write_batches(parcel.batches, parcel.first_number)
        for output in parcel.outputs:
            writer.write_output(output)
        if writer.syncs != self._syncs:
            self._syncs, self._unsynced_items = writer.syncs, items  # it syncs before it takes a new parcel
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

    def _make_room(self) -> None:
        """Delete the oldest finished logs of this name until `keep_free_mb` is free."""
        folder = self._settings.folder
        pattern = f"{escape(self._name)}_[0-9]*T[0-9]*Z_[0-9]*.mcap"
        old = sorted(folder.glob(pattern), key=lambda path: path.name)
        while old and self._disk.free_bytes(folder) < self._settings.keep_free_mb * 1e6:
            with suppress(OSError):
                old[0].unlink()
            del old[0]
