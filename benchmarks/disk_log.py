"""A disk that fails at random moments: `python benchmarks/disk_log.py --moments 50`. Nothing lost may go uncounted.

A minute of 1 kHz events goes through the recorder while the disk gets full, read-only or slow at a random moment and
recovers at another. Afterwards every event is in the logs, or counted as lost or dropped. The minute passes within
a second, so the queue (16 s of real flight) overflows here although it would not in the air. Whoever estimates must not
wait for the disk: the longest time in the recorder's hands is printed; and the last event must be in a log again.
"""

import argparse
import errno
import random
import tempfile
import time
from io import FileIO
from pathlib import Path
from queue import SimpleQueue
from threading import Event as Flag
from typing import Any

from rich.progress import track

from thrustd.core.types import Fault, Frame
from thrustd.sinks.log_files import Disk
from thrustd.sinks.log_recorder import LogRecorder, RecorderSettings
from thrustd.sources.log_run import LogRun
from thrustd.wire.event_batch import EventBatch
from thrustd.wire.log_layout import LogHeader

EVENTS = 60_000
LIMIT_S = 60.0
TROUBLES = {"full": errno.ENOSPC, "read-only": errno.EROFS, "slow": 0}


class Drive:
    """Files that fail or wait on demand."""

    def __init__(self) -> None:
        self.error = 0
        self.moving = Flag()
        self.moving.set()

    def open(self, path: Path) -> Any:
        return _DriveFile(path, self)


class _DriveFile(FileIO):
    def __init__(self, path: Path, drive: Drive) -> None:
        if drive.error:
            raise OSError(drive.error, "trouble")
        super().__init__(path, "xb")
        self._drive = drive

    def write(self, data: Any) -> int:
        self._drive.moving.wait(LIMIT_S)
        if self._drive.error:
            raise OSError(self._drive.error, "trouble")
        return super().write(data)


def fly(folder: Path, trouble: str, dice: random.Random) -> tuple[int, int, int, float]:
    """-> events found in the logs, lost with a file, dropped for lack of speed; longest time in `write_batch`, s."""
    drive, faults = Drive(), SimpleQueue[Fault]()
    log = LogRecorder(
        RecorderSettings(folder), LogHeader(engines=(), mounts=()), faults.put, Disk(open_file=drive.open)
    )
    begins = dice.randrange(EVENTS // 2)
    ends = begins + dice.randrange(600, EVENTS // 2)
    longest_s = 0.0
    for number in range(EVENTS):
        if number == begins:
            drive.error = TROUBLES[trouble]
            if not drive.error:
                drive.moving.clear()
        if number == ends:
            if drive.error:
                _wait_for(faults, active=True)
            drive.error = 0
            drive.moving.set()
            if trouble != "slow":
                _wait_for(faults, active=False)
        event = Frame(number * 1_000_000, "adc", 0, number.to_bytes(26, "little"))
        begin_s = time.perf_counter()
        log.write_batch(EventBatch.of((event,)))
        longest_s = max(longest_s, time.perf_counter() - begin_s)
    log.close()
    run = LogRun(list(folder.glob("*.mcap")))
    found = list(run.events())
    assert [event.t_ns for event in found] == sorted(event.t_ns for event in found)
    assert found[-1].t_ns == event.t_ns, "recording has not resumed"
    return len(found), log.lost_items, log.dropped_items, longest_s


def _wait_for(faults: "SimpleQueue[Fault]", active: bool) -> None:
    while faults.get(timeout=LIMIT_S)[2:4] != ("not_recorded", active):
        pass


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--moments", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    dice = random.Random(arguments.seed)
    for trouble in TROUBLES:
        worst_lost = worst_dropped = 0
        worst_s = 0.0
        for _ in track(range(arguments.moments), trouble):
            with tempfile.TemporaryDirectory() as folder:
                found, lost, dropped, longest_s = fly(Path(folder), trouble, dice)
            assert found + lost + dropped == EVENTS, f"{EVENTS - found - lost - dropped} events went uncounted"
            worst_lost, worst_dropped = max(worst_lost, lost), max(worst_dropped, dropped)
            worst_s = max(worst_s, longest_s)
        print(
            f"{trouble}: {arguments.moments} moments, every event recorded or counted, recording resumed every time; "
            f"worst: {worst_lost} lost with a file, {worst_dropped} dropped, of {EVENTS}; longest wait of the "
            f"estimating thread {1000 * worst_s:.1f} ms"
        )


if __name__ == "__main__":
    main()
