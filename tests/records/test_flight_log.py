"""A flight log read as columns, whole and cut off."""

from pathlib import Path

import numpy as np
import pytest

from thrustd.core.errors import RecordingError
from thrustd.core.types import Estimate, Fault, MountOutput, Reading, Tick
from thrustd.records.files import read_recording, write_recording
from thrustd.sinks.mcap_log import new_log
from thrustd.wire.log_layout import LogHeader

HEADER = LogHeader(engines=("left", "right"), mounts=("left_upper",), run="r1", epoch_offset_ns=10**18)


def write_log(path: Path, seconds: int = 20, outputs: bool = True) -> None:
    with new_log(path, HEADER, reading_hz=100.0) as log:
        for step in range(seconds * 50):
            t_ns = step * 20_000_000
            log.write_event(Tick(t_ns))
            if not outputs:
                continue
            if step % 5 == 0:
                log.write_output(Reading(t_ns, "n1_pct", 0, 50.0 + step))
            log.write_output(MountOutput(t_ns, 0, 0.5, 2500.0, 30.0))
            log.write_output(Estimate(t_ns, 0, 5000.0 + step, *[10.0] * 12, 0))
            log.write_truth("left", t_ns, 5001.0 + step)
            log.write_truth("left_upper", t_ns, 2400.0)
        log.write_output(Fault(0, "adc", "damaged"))


def test_estimates_readings_and_truth_become_columns(tmp_path):
    write_log(tmp_path / "a.mcap")
    record = read_recording(tmp_path / "a.mcap")
    assert len(record) == 1000
    assert record.sample_hz == pytest.approx(50)
    assert record.time_s[0] == 0.0  # monotonic, as everything is computed
    assert record["thrust_N_left"] - record["estimate_thrust_n_left"] == pytest.approx(1.0)
    assert record["deformation_mm_left_upper"][7] == 0.5
    assert record["force_N_left_upper"][7] == 2400.0
    assert record["mount_force_n_left_upper"][7] == 2500.0
    assert record["n1_pct_left"][7] == 55.0  # held since step 5
    assert not any("t_ns" in name for name in record.channels)
    assert "1 faults in the log" in record.notes


def test_a_cut_log_gives_what_is_whole(tmp_path):
    path = tmp_path / "cut.mcap"
    write_log(path, 120)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) * 2 // 3])
    record = read_recording(path)
    assert 1000 < len(record) < 6000
    assert any("cut off" in note for note in record.notes)


def test_raw_events_alone_are_no_recording(tmp_path):
    write_log(tmp_path / "raw.mcap", outputs=False)
    with pytest.raises(RecordingError, match="only raw events; replay it first"):
        read_recording(tmp_path / "raw.mcap")


def test_a_flight_log_converts(tmp_path):
    write_log(tmp_path / "a.mcap")
    record = read_recording(tmp_path / "a.mcap")
    write_recording(record, tmp_path / "a.parquet")
    back = read_recording(tmp_path / "a.parquet")
    assert np.array_equal(back["thrust_N_left"], record["thrust_N_left"])
