"""The files of one run as one log: the recorder starts a new file by size, by time and after a full disk."""

from collections.abc import Collection, Iterator, Sequence
from itertools import pairwise
from pathlib import Path

from thrustd.core.errors import LogError
from thrustd.core.types import Event
from thrustd.sources.mcap_log import Hear, LogFile
from thrustd.sources.mcap_walk import LogMessage
from thrustd.wire.event_batch import EventBatch
from thrustd.wire.log_layout import LogHeader


def run_paths(path: Path) -> list[Path]:
    """The files that `path` stands for: a folder for all its logs, the first file of a run for the whole run."""
    if path.is_dir():
        found = sorted(path.glob("*.mcap"))
        if not found:
            raise LogError(f"{path}: no *.mcap in this folder, expected the files of one run")
        return _plain(found)
    header = LogFile(path).header
    if not header.run or header.part > 0:
        return [path]
    return _plain([path, *(other for other in sorted(path.parent.glob("*.mcap")) if _continues(other, header))])


def _plain(paths: list[Path]) -> list[Path]:
    for path in paths:
        if not path.name.isprintable():
            raise LogError(f"{path}: its name holds control characters or is not UTF-8; expected plain text: rename it")
    return paths


def _continues(path: Path, first: LogHeader) -> bool:
    try:
        header = LogFile(path).header
    except LogError:  # not one of ours, or nothing in it
        return False
    return header.run == first.run and header.part > first.part


class LogRun:
    """Reads like a `LogFile`. `paths` in any order; LogError when they are not consecutive files of one run."""

    def __init__(self, paths: Sequence[Path], salvage: bool = False) -> None:
        if not paths:
            raise LogError("no log given, expected at least one file")
        self.files = sorted((LogFile(path, salvage) for path in paths), key=lambda file: file.header.part)
        for this, following in pairwise(self.files):
            if following.header.run != this.header.run or not this.header.run:
                raise LogError(f"{following.path}: expected a file of the same run as {this.path}")
            if following.header.part != this.header.part + 1:
                raise LogError(f"{following.path}: part {following.header.part}, expected {this.header.part + 1}")

    @property
    def path(self) -> Path:
        return self.files[0].path

    @property
    def header(self) -> LogHeader:
        return self.files[0].header

    @property
    def size_bytes(self) -> int:
        return sum(file.size_bytes for file in self.files)

    @property
    def position_bytes(self) -> int:
        return sum(file.position_bytes for file in self.files)

    @property
    def cut(self) -> bool:
        return any(file.cut for file in self.files)

    @property
    def damage(self) -> str:
        """With `salvage`, what is lost, in words."""
        return "; ".join(f"{file.path.name}: {file.damage}" for file in self.files if file.damage)

    @property
    def read_events(self) -> int:
        return sum(file.read_events for file in self.files)

    @property
    def missing_events(self) -> int:
        return sum(file.missing_events for file in self.files)

    def events(self) -> Iterator[Event]:
        """`batches`, one event after the other."""
        for batch in self.batches():
            yield from batch.events()

    def batches(self, topics: Collection[str] = (), hear: Hear | None = None) -> Iterator[EventBatch]:
        """Raw events of all files in arrival order; `topics` and `hear` as of a file."""
        number: int | None = None
        for file in self.files:
            yield from file.batches(number, topics, hear)
            number = file.next_number

    def messages(self, topics: Collection[str] | None = None) -> Iterator[LogMessage]:
        """Messages of all files in file order, of `topics` or of all but `/raw`."""
        for group in self.groups(topics):
            yield from group

    def groups(self, topics: Collection[str] | None = None) -> Iterator[list[LogMessage]]:
        """`messages`, as many as are in one record of the file together."""
        for file in self.files:
            yield from file.groups(topics)
