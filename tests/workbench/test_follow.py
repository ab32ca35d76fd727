"""A flight log followed while it grows: the same rows however the file arrives."""

import pytest

from thrustd.core.errors import LogError
from thrustd.core.types import Estimate, Fault, MountOutput, Reading
from thrustd.sinks.mcap_log import new_log
from thrustd.wire.log_layout import LogHeader
from thrustd.workbench.follow import FollowedLog


def write_log(path, seconds=120):
    """Two engines and a mount at 50 Hz, a reading at 1 Hz, two faults."""
    with new_log(path, LogHeader(engines=("left", "right"), mounts=("left_upper",))) as log:
        for i in range(seconds * 50):
            t_ns = i * 20_000_000
            for engine in (0, 1):
                log.write_output(
                    Estimate(t_ns, engine, 1000.0 + i, 50, 0, 990, 60, 1010, 90, 1, 2, 0.5, 0, 0, 0.5, 1 << 8)
                )
            log.write_output(MountOutput(t_ns, 0, 0.2, 500.0, 20.0))
            if i % 50 == 0:
                log.write_output(Reading(t_ns, "mach", 0, 0.3 + i * 1e-6))
        log.write_output(Fault(t_ns, "adc", "damaged"))
        log.write_output(Fault(t_ns, "adc", "damaged", count=3))


def test_whole_log(tmp_path):
    write_log(tmp_path / "log.mcap")
    log = FollowedLog(tmp_path / "log.mcap")
    log.read_on()
    said = log.answer(0)
    left = [row for row in said["rows"] if row["topic"] == "/estimate/left"]
    assert len(left) == pytest.approx(1200, abs=2)
    assert left[-1]["status_text"] == ["TRANSIENT"]
    assert said["faults"] == {"adc damaged": 4}
    assert said["readings"]["mach"]["value"] == pytest.approx(0.3 + 5950e-6)


def test_growing_log_gives_the_same_rows(tmp_path):
    write_log(tmp_path / "whole.mcap", seconds=60)
    content = (tmp_path / "whole.mcap").read_bytes()
    growing = tmp_path / "growing.mcap"
    growing.write_bytes(content[:8])
    log, rows, after = FollowedLog(growing), [], 0
    for stop in [*range(8, len(content), 7001), len(content)]:
        growing.write_bytes(content[:stop])
        log.read_on()
        said = log.answer(after)
        rows, after = rows + said["rows"], said["next"]
    whole = FollowedLog(tmp_path / "whole.mcap")
    whole.read_on()
    assert rows == whole.answer(0)["rows"]


def test_other_files_and_damage_are_said(tmp_path):
    (tmp_path / "not.mcap").write_bytes(b"time_s,force_N\n")
    with pytest.raises(LogError, match=r"not.mcap: starts with .*, expected an MCAP flight log"):
        FollowedLog(tmp_path / "not.mcap").read_on()
    write_log(tmp_path / "log.mcap", seconds=20)
    content = (tmp_path / "log.mcap").read_bytes()
    said = [outcome(tmp_path / "log.mcap", content, len(content) * part // 23) for part in range(1, 23)]
    assert {rows for rows, problem in said if not problem} <= {600}  # a flip in an index changes no row
    assert len([problem for _, problem in said if "damaged" in problem]) > 4


def outcome(path, content, flipped):
    """(rows, problem) of a log with one byte changed."""
    damaged = bytearray(content)
    damaged[flipped] ^= 0xFF
    path.write_bytes(damaged)
    log = FollowedLog(path)
    try:
        log.read_on()
    except LogError as problem:
        return 0, str(problem)
    return len(log.answer(0)["rows"]), ""
