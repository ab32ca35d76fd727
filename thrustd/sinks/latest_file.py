"""The latest value in one small file, written whole by a thread of its own: a slow disk holds up nobody.

Temporary name, fsync, rename, fsync of the folder: a reader sees one whole value, whenever the power goes.
"""

import os
import time
from collections.abc import Callable
from pathlib import Path
from threading import Event as Flag
from threading import Thread
from typing import Generic, TypeVar

from thrustd.core.types import Fault
from thrustd.sinks.whole_file import refuse_device, sync_folder

IDLE_S = 1.0
JOIN_S = 5.0

Value = TypeVar("Value")


class LatestFile(Generic[Value]):
    """`put` never waits; values that come faster than the disk takes them replace each other."""

    def __init__(
        self,
        path: Path,
        encode: Callable[[Value], bytes],
        report: Callable[[Fault], None],
        where: str = "checkpoint",
        clock_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        """A disk that refuses is reported as "not_saved" once, and when it is over."""
        self.written_ns: int | None = None
        self._path, self._encode, self._report, self._where, self._clock_ns = path, encode, report, where, clock_ns
        self._latest: Value | None = None
        self._work, self._closing = Flag(), Flag()
        self._refused = False
        self._thread = Thread(target=self._run, name=where, daemon=True)
        self._thread.start()

    def put(self, value: Value) -> None:
        """Write this next."""
        self._latest = value
        self._work.set()

    def close(self) -> None:
        """Write what is pending and stop."""
        self._closing.set()
        self._work.set()
        self._thread.join(JOIN_S)

    def _run(self) -> None:
        while True:
            self._work.wait(IDLE_S)
            self._work.clear()
            closing = self._closing.is_set()
            value, self._latest = self._latest, None
            if value is not None:
                self._try(value)
            if closing:
                return

    def _try(self, value: Value) -> None:
        try:
            replace_file(self._path, self._encode(value))
        except Exception:  # a disk that refuses mostly; this thread must live whatever it is
            if not self._refused:
                self._tell(True)
            self._refused = True
            return
        self.written_ns = self._clock_ns()
        if self._refused:
            self._tell(False)
        self._refused = False

    def _tell(self, active: bool) -> None:
        self._report(Fault(self._clock_ns(), self._where, "not_saved", active))


def replace_file(path: Path, content: bytes) -> None:
    """`content` under `path`, whole or not at all, on the disk when this returns. OSError goes through."""
    refuse_device(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.part")
    with part.open("wb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())
    os.replace(part, path)
    sync_folder(path.parent)
