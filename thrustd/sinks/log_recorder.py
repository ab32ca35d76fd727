"""The recorder in flight: `LogWriter` in its own thread behind a bounded queue, so that no disk holds up an estimate.

    producer:  batches of events, outputs -> parcel (20 ms) -> queue             never waits, never raises
    thread:    queue -> LogWriter -> file, rotated by size and time, synced twice per second

A disk that is too slow fills the queue: the oldest parcels go, counted as `log_overrun`. A disk that refuses (full,
read-only, gone) is a fault: the file is given up, parcels wait in the queue, and a new file is tried with growing
delays; when it works, the fault is over. Events keep their numbers, so a log tells what it lacks.
"""

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from threading import Event as Flag
from threading import Thread
from typing import Final

from thrustd.core.types import Fault, Output
from thrustd.sinks.log_files import REAL_DISK, Disk, LogFiles, Parcel, RecorderSettings
from thrustd.sinks.mcap_log import BATCH_NS
from thrustd.wire.event_batch import EventBatch
from thrustd.wire.log_layout import LogHeader

WHERE: Final = "log"
__all__ = ["LogRecorder", "RecorderSettings"]

MAX_PARCELS = 1024  # 20 s, 22 MB at 1 kHz
IDLE_S = 0.2  # an idle thread looks for work this often
FIRST_RETRY_S = 0.5
LONGEST_RETRY_S = 10.0
JOIN_S = 10.0


class LogRecorder:
    """A sink that never waits and never raises once it is started."""

    def __init__(
        self,
        settings: RecorderSettings,
        header: LogHeader,
        report: Callable[[Fault], None],
        disk: Disk = REAL_DISK,
    ) -> None:
        """`report` takes faults from any thread. A disk that refuses the first file is a fault like any later one."""
        self._report = report
        self.folder = settings.folder
        self._files = LogFiles(settings, header, disk)
        self._parcels: deque[Parcel] = deque()
        self._parcel = Parcel(0, [], [])
        self._next_number = 0
        self._last_ns = 0
        self._work, self._closing = Flag(), Flag()
        self._refused = False  # the disk, at the last attempt
        self.dropped_items = 0  # missing in the log for lack of speed
        self.lost_items = 0  # missing because a file had to be given up
        self._guard(self._files.start)
        self._thread = Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    @property
    def path(self) -> Path | None:
        """The file being written; None while the disk refuses."""
        return self._files.path

    def write_batch(self, batch: EventBatch) -> None:
        """The next raw events, at least one; hands a parcel over when it is old enough."""
        t_ns = batch.t_ns.item(0)
        if self._parcel.batches and not 0 <= t_ns - self._parcel.batches[0].t_ns.item(0) < BATCH_NS:
            self._hand_over()
        self._parcel.batches.append(batch)
        self._last_ns = t_ns
        self._next_number += len(batch)

    def write_output(self, output: Output) -> None:
        """One output of the pipeline; travels with the events around it."""
        self._parcel.outputs.append(output)

    def wake(self) -> None:
        """A good moment for the thread to write what is handed over; without one it looks every IDLE_S."""
        if self._parcels:
            self._work.set()

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
                count = oldest.n_events() + len(oldest.outputs)
                self.dropped_items += count
                self._report(Fault(self._last_ns, WHERE, "overrun", count=count))

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
        """Do `action`; a disk that begins to refuse is told, and what it cost. True of `action`: a file came back."""
        try:
            resumed = action()
        except Exception:  # mostly a disk that refuses; whatever it is, this thread must live
            lost = self._files.give_up()
            self.lost_items += lost
            if lost or not self._refused:
                self._report(Fault(self._last_ns, WHERE, "not_recorded", count=lost))
            self._refused = True
            return False
        if resumed:
            self._refused = False
            self._report(Fault(self._last_ns, WHERE, "not_recorded", active=False))
        return True
