"""The logs of a long flight against themselves: what is in them, and whether replay says what was said live."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from rich.progress import track

from thrustd.replay import open_installation
from thrustd.sources.log_run import LogRun
from thrustd.types import Estimate, Event, Frame, MountOutput
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
    for event in track(run.events(), "counting and replaying"):
        if isinstance(event, Frame):
            adc_bytes += len(event.data) * (event.channel == "adc")
            can_messages += event.channel == "can"
        if replayed.seconds(event) <= replay_s:
            replayed.feed(event)
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

    def seconds(self, event: Event) -> float:
        """Since the first event."""
        if self._first_ns is None:
            self._first_ns = event.t_ns
        return (event.t_ns - self._first_ns) * 1e-9

    def feed(self, event: Event) -> None:
        self._last_ns = event.t_ns
        for output in self._pipeline.feed(event):
            if isinstance(output, Estimate | MountOutput):
                self.outputs += 1
                self.same += self._topics.encode(output) == next(self._live, b"")
