"""The process that does the long work: one JSON order per line comes in, progress and one result go out.

    in   {"id": ..., "kind": "compare", "arguments": {...}}
    out  {"progress": 0.3, "note": "..."} ...   then   {"done": {...}} or {"failed": "one line"}

Standard output belongs to this protocol alone: whatever a library prints goes to standard error.
"""

import os
import sys
import time
from pathlib import Path
from typing import Any, BinaryIO

import msgspec

from thrustd.core.errors import ThrustdError
from thrustd.workbench.folder import Folder
from thrustd.workbench.prepare import plain

SAY_EVERY_S = 0.15
NICE = 5  # the server stays responsive on a small machine


class Voice:
    """Tells the server; progress at most every `SAY_EVERY_S`."""

    def __init__(self, out: BinaryIO) -> None:
        self._out = out
        self._last_s = 0.0

    def progress(self, fraction: float, note: str = "") -> None:
        now_s = time.monotonic()
        if now_s - self._last_s >= SAY_EVERY_S:
            self._last_s = now_s
            self.say({"progress": min(max(fraction, 0.0), 1.0), "note": note})

    def say(self, message: dict[str, Any]) -> None:
        self._out.write(msgspec.json.encode(message, enc_hook=plain) + b"\n")
        self._out.flush()


def carry_out(folder: Folder, line: bytes, voice: Voice) -> None:
    """One order; whatever goes wrong is one line for the page, and a traceback only for the terminal."""
    from thrustd.workbench.tasks import TASKS

    order = msgspec.json.decode(line)
    try:
        voice.say({"done": TASKS[order["kind"]](folder, order["arguments"], voice.progress)})
    except ThrustdError as problem:
        voice.say({"failed": " ".join(str(problem).split())})
    except MemoryError:
        voice.say({"failed": f"{order['kind']}: not enough memory on this machine"})
    except Exception as problem:
        sys.excepthook(type(problem), problem, problem.__traceback__)
        voice.say({"failed": f"{order['kind']}: internal error: {type(problem).__name__}: {problem}"[:300]})


def main(root: str) -> None:
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    os.nice(NICE)
    folder, voice = Folder(Path(root)), Voice(out)
    for line in sys.stdin.buffer:
        carry_out(folder, line, voice)


if __name__ == "__main__":
    main(sys.argv[1])
