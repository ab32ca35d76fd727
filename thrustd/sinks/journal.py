"""Faults as lines for whoever watches the process: the first of a kind at a place, and again when it was over for long.

The end of one that lasted is told, too, once for each time that it was told.

A thread of its own writes them: a terminal or journal that takes nothing holds up no estimate, lines are left out then.
"""

import sys
from collections.abc import Callable
from contextlib import suppress
from queue import SimpleQueue
from threading import Thread

from thrustd.core.faults import FAULT_KINDS
from thrustd.core.types import Fault, Output

OVER_NS = 60_000_000_000
MOST_WAITING = 50  # lines
JOIN_S = 1.0


def say(words: str) -> None:
    """One line on standard error, as systemd's journal and a terminal show it; nobody has to be there to read it."""
    with suppress(AttributeError, OSError, ValueError):  # never open (None), its reader or terminal gone, closed
        sys.stderr.write(f"thrustd: {words}\n")


class Journal:
    """A sink for outputs."""

    def __init__(self, write: Callable[[str], None] = say) -> None:
        self._last_ns: dict[tuple[str, str], int] = {}  # of each kind at each place
        self._open = set[tuple[str, str]]()  # told, and not their end
        self._lines: SimpleQueue[str | None] = SimpleQueue()
        self._write = write
        self._thread = Thread(target=self._run, name="journal", daemon=True)
        self._thread.start()

    def write_output(self, output: Output) -> None:
        if not isinstance(output, Fault):
            return
        key = output.where, output.kind
        if not output.active:
            if key in self._open:
                self._open.discard(key)
                self._tell(f"{output.where}: {output.kind}: over")
            return
        before_ns, self._last_ns[key] = self._last_ns.get(key), output.t_ns
        if before_ns is None or output.t_ns - before_ns >= OVER_NS:
            self._open.add(key)
            self._tell(f"{output.where}: {output.kind}: {FAULT_KINDS[output.kind].meaning}")

    def _tell(self, line: str) -> None:
        if self._lines.qsize() < MOST_WAITING:
            self._lines.put(line)

    def close(self) -> None:
        self._lines.put(None)
        self._thread.join(JOIN_S)

    def _run(self) -> None:
        while (line := self._lines.get()) is not None:
            self._write(line)
