"""A flight log that is still being written, read on from where it was left: what the live page shows.

Only whole records are taken; a chunk that is half on the disk waits for the next look. Estimates and mounts are kept
at `SHOW_HZ` for the last `KEEP_ROWS` rows, readings and faults as their latest state.
"""

import threading
from collections import Counter
from pathlib import Path
from typing import Any

import msgspec

from thrustd.core.errors import LogError
from thrustd.sources.mcap_walk import McapWalk
from thrustd.wire.log_layout import FAULT_TOPIC

SHOW_HZ = 10.0
KEEP_ROWS = 36_000  # an hour at SHOW_HZ, for each engine and mount
READ_BYTES = 32 << 20  # at most per look
_ROWS, _READING = ("/estimate/", "/mount/"), "/reading/"


class FollowedLog:
    """One log; `read_on` takes what is new, `answer` says it."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._lock = threading.Lock()
        self._walk: McapWalk | None = None
        self._rows: list[dict[str, Any]] = []
        self._dropped = 0  # rows no longer kept
        self._last_ns: dict[str, int] = {}
        self._readings: dict[str, dict[str, Any]] = {}
        self._faults: Counter[str] = Counter()
        self._latest_ns = 0
        self._decode = msgspec.json.Decoder(dict[str, Any]).decode

    def read_on(self) -> None:
        """Take the whole records that were added; LogError for a file that is no MCAP, or damaged."""
        with self._lock, self.path.open("rb") as stream:
            walk = self._walk = self._walk or McapWalk(stream, self.path.name, _is_shown)
            begin = walk.position_bytes
            for messages in walk.grown(stream):
                for message in messages:
                    self._message(message.topic, message.data)
                if walk.gaps or walk.position_bytes - begin > READ_BYTES:
                    break
            if walk.gaps:
                raise LogError(f"{self.path.name}: {walk.account()}")

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
                "bytes": self._walk.position_bytes if self._walk else 0,
            }

    def _message(self, topic: str, data: bytes) -> None:
        try:
            said = self._decode(data)
        except msgspec.DecodeError as problem:
            raise LogError(f"{self.path.name}: damaged: {topic}: {problem}") from None
        t_ns = int(said.get("t_ns", 0))
        self._latest_ns = max(self._latest_ns, t_ns)
        if topic.startswith(_ROWS):
            if t_ns - self._last_ns.get(topic, -(10**12)) >= 0.999e9 / SHOW_HZ:
                self._last_ns[topic] = t_ns
                self._rows.append({"topic": topic, **said})
                self._forget()
        elif topic.startswith(_READING):
            self._readings[topic.removeprefix(_READING)] = said
        elif said.get("active", True):
            self._faults[f"{said['where']} {said['kind']}"] += int(said.get("count", 1))

    def _forget(self) -> None:
        beyond = len(self._rows) - KEEP_ROWS * max(1, len(self._last_ns))
        if beyond > 2000:
            del self._rows[:beyond]
            self._dropped += beyond


def _is_shown(topic: str) -> bool:
    return topic.startswith((*_ROWS, _READING)) or topic == FAULT_TOPIC
