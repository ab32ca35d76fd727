"""A checkpoint is taken over only when it is fresh, whole and of the same files."""

import os
import time
from contextlib import ExitStack
from pathlib import Path

import psutil
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.onboard.rig import reliable_aircraft
from thrustd.installation.installation import read_installation
from thrustd.onboard import checkpoint
from thrustd.onboard.checkpoint import SCHEMA, Checkpoint, Clocks, at_start, clocks, encode, judge, read_checkpoint
from thrustd.onboard.daemon import Shell, start_pipeline
from thrustd.sinks.latest_file import LatestFile, replace_file
from thrustd.sources.merge import EventQueue

S = 1_000_000_000
PATH = Path("checkpoint.json")
HASHES = {"config.toml": "a", "left.json": "b"}
THEN = Clocks("boot", 100 * S, 5000 * S)
SNAPSHOT = {"mounts": [{"state": [0.1, 1e-300, -0.0]}]}
SERVICE = {"left": (3.0, 12_000.0), "right": (5.0, 20_000.0)}
CONTENT = encode(Checkpoint(SCHEMA, THEN, HASHES, SNAPSHOT, SERVICE))


def later(seconds, boot="boot", base_ns=0):
    return Clocks(boot, THEN.monotonic_ns + seconds * S - base_ns, THEN.utc_ns + seconds * S)


def test_a_fresh_one_is_taken_over_to_the_last_bit():
    found = judge(PATH, CONTENT, HASHES, later(9), 10)
    assert found.start.snapshot == SNAPSHOT
    assert found.start.shift_ns == 0
    assert not found.refused


def test_a_calendar_clock_that_jumps_within_a_boot_does_not_matter():
    jumped = later(5)._replace(utc_ns=0)
    assert judge(PATH, CONTENT, HASHES, jumped, 10).start is not None


def test_after_a_reboot_the_calendar_tells_the_age_and_times_are_moved():
    found = judge(PATH, CONTENT, HASHES, later(8, "another", 90 * S), 10)
    assert found.start.shift_ns == -90 * S


@pytest.mark.parametrize(
    "now, hashes, word",
    [
        (later(11), HASHES, "11.0 s old, expected 0 to 10 s"),
        (later(-1), HASHES, "-1.0 s old"),
        (later(20, "another"), HASHES, "20.0 s old"),
        (later(1), HASHES | {"left.json": "c"}, "of another left.json"),
        (later(1), {"config.toml": "a"}, "of another left.json"),
    ],
)
def test_an_old_or_foreign_one_is_refused_with_a_word(now, hashes, word):
    found = judge(PATH, CONTENT, hashes, now, 10)
    assert found.start is None
    assert found.refused
    assert word in found.word
    assert "starting cold" in found.word
    assert found.service_s({"left": 3.0, "right": 0.0}) == (12_000.0, 0.0)  # the right one was mounted anew
    (line,) = found.overruled({"left": 3.0, "right": 0.0})
    assert line == "right: 0.00 h in service, of the calibration file, which changed; the checkpoint told 5.56 h"


@given(st.data())
def test_one_changed_byte_is_noticed(data):
    at = data.draw(st.integers(0, len(CONTENT) - 1))
    byte = data.draw(st.integers(0, 255).filter(lambda value: value != CONTENT[at]))
    found = judge(PATH, CONTENT[:at] + bytes([byte]) + CONTENT[at + 1 :], HASHES, later(1), 10)
    assert found.start is None or found.start.snapshot == SNAPSHOT  # a blank between two words is not damage


@given(st.binary(max_size=300) | st.integers(0, len(CONTENT) - 1).map(lambda n: CONTENT[:n]))
def test_junk_and_cut_files_are_refused(content):
    assert judge(PATH, content, HASHES, later(1), 10).start is None


def test_a_slow_start_makes_no_checkpoint_older():
    """Its age is counted to the start of this process, which is longer ago than this test."""
    now, before = clocks(), clocks()
    began = at_start(now)
    up_ns = now.monotonic_ns - began.monotonic_ns
    assert up_ns == pytest.approx(now.utc_ns - psutil.Process().create_time() * 1e9, abs=2 * S)
    assert up_ns > time.process_time_ns() / 4  # of several threads
    assert now.utc_ns - began.utc_ns == up_ns
    written = before._replace(monotonic_ns=began.monotonic_ns - 9 * S, utc_ns=began.utc_ns - 9 * S)
    content = encode(Checkpoint(SCHEMA, written, HASHES, SNAPSHOT))
    later_by_minutes = now._replace(monotonic_ns=now.monotonic_ns + 300 * S)
    assert judge(PATH, content, HASHES, later_by_minutes, 10).start is None
    assert judge(PATH, content, HASHES, began, 10).start is not None


@pytest.mark.parametrize("process_s, warm", [(60, True), (0, False)])
def test_the_daemon_counts_to_the_start_of_its_process_not_to_its_ready(tmp_path, monkeypatch, process_s, warm):
    """Written 65 s ago: 5 s before a process that took a minute to come here, or before one that has just begun."""
    config = reliable_aircraft(tmp_path)
    config.write_text(config.read_text().replace("max_age_s = 60", "max_age_s = 10"))
    place, now = read_installation(config), clocks()
    then = now._replace(monotonic_ns=now.monotonic_ns - 65 * S, utc_ns=now.utc_ns - 65 * S)
    service = dict.fromkeys((mount.name for mount in place.config.mount), (0.0, 0.0))
    memory = Checkpoint(SCHEMA, then, place.hashes(), place.pipeline().snapshot(), service)
    (tmp_path / "checkpoint.json").write_bytes(encode(memory))
    ticks = round((time.clock_gettime(time.CLOCK_BOOTTIME) - process_s) * os.sysconf("SC_CLK_TCK"))
    (tmp_path / "stat").write_text(f"1 (thrustd) S {'0 ' * 18}{ticks} 0")
    monkeypatch.setattr(checkpoint, "OWN_STATUS", tmp_path / "stat")
    with ExitStack() as opened:
        _, start = start_pipeline(Shell(place, tmp_path, EventQueue(), opened))
    assert (start.snapshot is not None) == warm


def test_none_at_all_is_a_first_start(tmp_path):
    found = read_checkpoint(tmp_path / "none.json", HASHES, later(1), 10)
    assert found.start is None
    assert not found.refused


def test_a_folder_in_its_place_is_refused(tmp_path):
    assert read_checkpoint(tmp_path, HASHES, later(1), 10).refused


def test_a_file_is_replaced_whole_or_not_at_all(tmp_path):
    path = tmp_path / "new" / "checkpoint.json"
    replace_file(path, b"one")
    replace_file(path, b"two")
    assert path.read_bytes() == b"two"
    assert [p.name for p in path.parent.iterdir()] == ["checkpoint.json"]


def test_a_disk_that_refuses_is_told_once_and_told_again_when_it_is_back(tmp_path):
    faults = []
    (tmp_path / "folder").write_text("a file where a folder should be")
    for path, blocked in ((tmp_path / "folder" / "c.json", True), (tmp_path / "c.json", False)):
        latest = LatestFile(path, lambda value: value, faults.append)
        latest.put(b"state")
        latest.close()
        assert (latest.written_ns is None) == blocked
    assert [fault.kind for fault in faults] == ["not_saved"]
