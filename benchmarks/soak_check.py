"""The logs of a long flight against themselves: what is in them, and whether replay says what was said live."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.progress import track

from thrustd.core.types import Estimate, MountOutput
from thrustd.replay.replay import open_installation
from thrustd.sources.log_run import LogRun
from thrustd.wire.event_batch import EventBatch
from thrustd.wire.log_layout import Topics


class Checked(NamedTuple):
    """What a run of log files says."""

    files: int
    adc_bytes: int
    can_messages: int
    missing_events: int
    replayed_h: float
    outputs: int  # estimates and mount outputs said live in the time that was replayed
    same: int  # of them, said by replay to the last bit


def check(paths: Sequence[Path], replay_s: float) -> Checked:
    """Count everything, replay the first `replay_s` seconds."""
    run = LogRun(paths)
    replayed = _Replay(run)
    adc_bytes = can_messages = 0
    for batch in track(run.batches(), "counting and replaying"):
        lengths = np.diff(batch.ends, prepend=0)
        for kind, channel in enumerate(batch.channels):
            mine = batch.kind == kind
            adc_bytes += int(lengths[mine].sum()) * (channel == "adc")
            can_messages += int(mine.sum()) * (channel == "can")
        if replayed.seconds(batch) <= replay_s:
            replayed.take(batch)
    return Checked(
        len(run.files), adc_bytes, can_messages, run.missing_events, replayed.hours, replayed.outputs, replayed.same
    )


class _Replay:
    """A pipeline beside the log it reads, and what the log says that it said."""

    def __init__(self, run: LogRun) -> None:
        installation = open_installation(run.files[0], None)
        self.outputs, self.same = 0, 0
        self._pipeline = installation.pipeline()
        self._topics = Topics(run.header.engines, run.header.mounts)
        names = [f"/estimate/{name}" for name in run.header.engines] + [f"/mount/{name}" for name in run.header.mounts]
        self._live = (message.data for message in LogRun([file.path for file in run.files]).messages(names))
        self._first_ns: int | None = None
        self._last_ns = 0

    @property
    def hours(self) -> float:
        return (self._last_ns - (self._first_ns or 0)) / 3.6e12

    def seconds(self, batch: EventBatch) -> float:
        """Of its first event since the very first."""
        if self._first_ns is None:
            self._first_ns = batch.t_ns.item(0)
        return (batch.t_ns.item(0) - self._first_ns) * 1e-9

    def take(self, batch: EventBatch) -> None:
        self._last_ns = batch.t_ns.item(-1)
        for output in self._pipeline.take(batch):
            if isinstance(output, Estimate | MountOutput):
                self.outputs += 1
                self.same += self._topics.encode(output) == next(self._live, b"")
