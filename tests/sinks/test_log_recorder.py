"""The recorder: nothing blocks, nothing raises, every loss is counted; a killed process loses less than a second."""

import errno
import os
import signal
import subprocess
import sys
from datetime import UTC, datetime
from io import FileIO
from pathlib import Path
from queue import SimpleQueue
from shutil import rmtree
from threading import Event as Flag
from typing import Any

import pytest

from thrustd.core.errors import LogError
from thrustd.core.types import Event, Fault, Frame, MountOutput, Tick
from thrustd.sinks import log_recorder
from thrustd.sinks.log_files import Disk
from thrustd.sinks.log_recorder import LogRecorder, RecorderSettings
from thrustd.sources.log_run import LogRun
from thrustd.sources.mcap_log import LogFile
from thrustd.wire.event_batch import EventBatch
from thrustd.wire.log_layout import LogHeader

HEADER = LogHeader(engines=("left",), mounts=("left_upper",), run="r1")
NOON = datetime(2018, 3, 12, 12, 0, 0, tzinfo=UTC)
LIMIT_S = 20.0


def disk(**more: Any) -> Disk:
    return Disk(utc=lambda: NOON, **more)


def flight(seconds: float, start_s: float = 0.0) -> list[Event]:
    return [
        Frame(round((start_s + i / 1000) * 1e9), "adc", 0, bytes((i & 255, i >> 8 & 255)) * 12)
        for i in range(round(seconds * 1000))
    ]


def recorder(folder: Path, report: list[Fault], **more: Any) -> LogRecorder:
    settings = RecorderSettings(folder, **more.pop("settings", {}))
    return LogRecorder(settings, HEADER, report.append, disk(**more))


def recorded(folder: Path) -> list[Event]:
    """Events of all files of the run, in the order of their parts."""
    run = LogRun(list(folder.glob("*.mcap")))
    events = list(run.events())
    assert run.position_bytes == run.size_bytes
    return events


def test_everything_is_recorded_under_a_name_with_the_time(tmp_path: Path) -> None:
    faults: list[Fault] = []
    log, events = recorder(tmp_path, faults), flight(2)
    for event in events:
        log.write_batch(EventBatch.of((event,)))
        log.write_output(MountOutput(event.t_ns, 0, 0.5, 2500.0, 20.0))
    log.close()
    assert [path.name for path in tmp_path.iterdir()] == ["flight_00001_20180312T120000Z_0000.mcap"]
    [path] = tmp_path.iterdir()
    assert list(LogFile(path).events()) == events
    assert sum(1 for _ in LogFile(path).messages(["/mount/left_upper"])) == len(events)
    assert faults == []


def test_files_rotate_by_time_and_size_and_continue_each_other(tmp_path: Path) -> None:
    events = flight(10)
    for name, limit in (("time", {"rotate_min": 3 / 60}), ("size", {"rotate_mb": 0.02})):
        log = recorder(tmp_path / name, [], settings=limit)
        for event in events:
            log.write_batch(EventBatch.of((event,)))
        log.close()
        files = sorted((tmp_path / name).glob("*.mcap"))
        assert len(files) >= 3
        assert [LogFile(path).header.part for path in files] == list(range(len(files)))
        assert recorded(tmp_path / name) == events


def test_an_existing_file_is_never_overwritten(tmp_path: Path) -> None:
    old = tmp_path / "flight_00001_20180312T120000Z_0000.mcap"

    def open_late(path: Path) -> Any:
        old.write_bytes(b"precious")  # another process was faster
        return path.open("xb")

    log = recorder(tmp_path, [], open_file=open_late)
    log.write_batch(EventBatch.of((Tick(1),)))
    log.close()
    assert old.read_bytes() == b"precious"
    assert list(LogFile(tmp_path / "flight_00001_20180312T120000Z_0000-1.mcap").events()) == [Tick(1)]


def test_a_name_cannot_leave_the_folder(tmp_path: Path) -> None:
    recorder(tmp_path / "logs", [], settings={"name": "../PH LAB"}).close()
    assert [path.name for path in (tmp_path / "logs").iterdir()] == ["-PH-LAB_00001_20180312T120000Z_0000.mcap"]


def test_a_folder_that_cannot_be_is_a_fault_from_the_start(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    faults: list[Fault] = []
    log = recorder(tmp_path / "file" / "logs", faults)
    assert log.path is None
    log.close()
    assert [(fault.where, fault.kind) for fault in faults] == [("log", "not_recorded")]


def test_files_of_different_runs_or_with_one_missing_are_no_run(tmp_path: Path) -> None:
    log = recorder(tmp_path, [], settings={"rotate_min": 1 / 60})
    for event in flight(5):
        log.write_batch(EventBatch.of((event,)))
    log.close()
    first, second, third, *_ = sorted(tmp_path.glob("*.mcap"))
    assert len(list(LogRun([second, first]).messages())) == 0
    with pytest.raises(LogError, match="part 2, expected 1"):
        LogRun([first, third])
    with pytest.raises(LogError, match="part 0, expected 1"):
        LogRun([first, first])
    with pytest.raises(LogError, match="at least one"):
        LogRun([])


def test_the_oldest_logs_go_when_the_disk_gets_full_but_nothing_else(tmp_path: Path) -> None:
    """Of flights 4 to 8 the clock was right in the first three, then years behind: today's log is not the oldest."""
    for name in ("flight_notes.txt", "other_00001_20180312T110000Z_0000.mcap"):
        (tmp_path / name).write_text("keep")
    days = ("20180310", "20180311", "20180312", "19700101", "19700101")
    old = [tmp_path / f"flight_{4 + n:05d}_{day}T110000Z_0000.mcap" for n, day in enumerate(days)]
    unnumbered = tmp_path / "flight_20180309T110000Z_0000.mcap"
    for path in [unnumbered, *old]:
        path.write_text("old")
    free = iter([1e6, 2e6, 2.5e6, 3e6]).__next__
    faults: list[Fault] = []
    settings = RecorderSettings(tmp_path, keep_free_mb=3)
    LogRecorder(settings, HEADER, faults.append, disk(free_bytes=lambda folder: int(free()))).close()
    kept = ["flight_notes.txt", "other_00001_20180312T110000Z_0000.mcap", *(path.name for path in old[2:])]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(
        [*kept, "flight_00009_20180312T120000Z_0000.mcap"]
    )


def test_flights_are_numbered_and_all_files_of_one_carry_its_number(tmp_path: Path) -> None:
    for expected in (1, 2):
        log = recorder(tmp_path, [], settings={"rotate_min": 1 / 60})
        for event in flight(3):
            log.write_batch(EventBatch.of((event,)))
        log.close()
        names = sorted(tmp_path.glob(f"flight_{expected:05d}_*.mcap"))
        assert [LogFile(path).header.part for path in names] == list(range(len(names)))
        assert len(names) >= 3


@pytest.mark.parametrize("trouble", ["removed", "moved"])
def test_a_folder_that_goes_in_flight_is_told_and_made_again(tmp_path: Path, trouble: str) -> None:
    faults, folder = SimpleQueue[Fault](), tmp_path / "logs"
    log = LogRecorder(RecorderSettings(folder), HEADER, faults.put, disk())
    before, after = flight(2), flight(3, 2.0)
    for event in before:
        log.write_batch(EventBatch.of((event,)))
    if trouble == "removed":
        rmtree(folder)
    else:
        folder.rename(tmp_path / "elsewhere")
    for event in after:
        log.write_batch(EventBatch.of((event,)))
    lost = wait_for(faults, "not_recorded").count
    wait_for(faults, "not_recorded", active=False)
    log.close()
    kept = recorded(folder)
    assert lost == log.lost_items > 0
    assert len(kept) == len([*before, *after]) - lost
    assert kept[-1] == after[-1]


class Drive:
    """A disk with two switches: the error it answers with, and stuck."""

    def __init__(self) -> None:
        self.error = 0
        self.moving = Flag()
        self.moving.set()

    def open(self, path: Path) -> Any:
        return _DriveFile(path, self)


class _DriveFile(FileIO):
    def __init__(self, path: Path, drive: Drive) -> None:
        super().__init__(path, "xb")
        self._drive = drive

    def write(self, data: Any) -> int:
        self._drive.moving.wait(LIMIT_S)
        if self._drive.error:
            raise OSError(self._drive.error, os.strerror(self._drive.error))
        return super().write(data)


def wait_for(faults: "SimpleQueue[Fault]", kind: str, active: bool = True) -> Fault:
    while True:
        fault = faults.get(timeout=LIMIT_S)
        if (fault.kind, fault.active) == (kind, active):
            return fault


@pytest.mark.parametrize("error, before_s", [(errno.ENOSPC, 3.0), (errno.EROFS, 0.7), (errno.EIO, 1.9)])
def test_a_disk_that_fails_is_counted_and_recording_resumes_in_a_new_file(
    tmp_path: Path, error: int, before_s: float
) -> None:
    drive, faults = Drive(), SimpleQueue[Fault]()
    log = LogRecorder(RecorderSettings(tmp_path), HEADER, faults.put, disk(open_file=drive.open))
    before, during, after = flight(before_s), flight(2, before_s), flight(3, before_s + 2)
    for event in before:
        log.write_batch(EventBatch.of((event,)))
    drive.error = error
    for event in during:
        log.write_batch(EventBatch.of((event,)))
    lost = wait_for(faults, "not_recorded").count
    drive.error = 0
    wait_for(faults, "not_recorded", active=False)
    for event in after:
        log.write_batch(EventBatch.of((event,)))
    log.close()
    assert log.lost_items == lost < 2000
    assert log.dropped_items == 0
    events = recorded(tmp_path)
    assert len(list(tmp_path.glob("*.mcap"))) == 2
    assert len(events) == len([*before, *during, *after]) - lost
    assert events[-len(after) :] == after


def test_a_disk_that_is_full_from_now_on_costs_records_only(tmp_path: Path) -> None:
    drive, faults = Drive(), SimpleQueue[Fault]()
    log = LogRecorder(RecorderSettings(tmp_path), HEADER, faults.put, disk(open_file=drive.open))
    drive.error = errno.ENOSPC
    for event in flight(5):
        log.write_batch(EventBatch.of((event,)))
    wait_for(faults, "not_recorded")
    log.close()
    assert list(LogFile(next(tmp_path.glob("*.mcap"))).events()) == []


def test_a_stuck_disk_drops_the_oldest_and_never_blocks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(log_recorder, "MAX_PARCELS", 20)
    drive, faults = Drive(), SimpleQueue[Fault]()
    log = LogRecorder(RecorderSettings(tmp_path), HEADER, faults.put, disk(open_file=drive.open))
    events = flight(20)
    drive.moving.clear()
    for event in events:
        log.write_batch(EventBatch.of((event,)))
    dropped = log.dropped_items
    assert dropped > 0
    drive.moving.set()
    log.close()
    told = 0
    while told < dropped:
        told += wait_for(faults, "overrun").count
    [path] = tmp_path.glob("*.mcap")
    reader = LogFile(path)
    kept = list(reader.events())
    assert len(kept) == len(events) - log.dropped_items
    assert reader.missing_events == log.dropped_items
    assert kept[-1] == events[-1]


CHILD = """
import sys
from itertools import chain
from io import FileIO
from pathlib import Path
from queue import SimpleQueue
from threading import Event
from thrustd.sinks.log_files import Disk
from thrustd.sinks.log_recorder import LogRecorder, RecorderSettings
from thrustd.sources.merge import EventQueue, merged
from thrustd.sources.ticker import Ticker
from thrustd.wire.event_batch import EventBatch
from thrustd.wire.log_layout import LogHeader

queue = EventQueue()
log = LogRecorder(RecorderSettings(Path(sys.argv[1])), LogHeader(engines=(), mounts=()), queue.put)
for event in chain.from_iterable(merged(queue, [Ticker(1000, queue.put)], Event())):
    log.write_batch(EventBatch.of((event,)))
    print(event.t_ns, flush=True)
"""


@pytest.mark.parametrize("ticks", [1, 137, 700, 1600, 2300])
def test_kill_9_loses_less_than_a_second_and_the_rest_is_readable(tmp_path: Path, ticks: int) -> None:
    with subprocess.Popen([sys.executable, "-c", CHILD, str(tmp_path)], stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        told = [int(child.stdout.readline()) for _ in range(ticks)]
        os.kill(child.pid, signal.SIGKILL)
        told += [int(line) for line in child.stdout if line.endswith("\n")]
    [path] = tmp_path.glob("*.mcap")
    log = LogFile(path)
    kept = [event.t_ns for event in log.events()]
    assert log.cut
    assert kept == told[: len(kept)]
    assert told[-1] - (kept[-1] if kept else told[0]) < 1_000_000_000
