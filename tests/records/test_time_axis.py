"""The clock of a recording: its own, another column, or a rate; and columns that do not go with it."""

import numpy as np
import pytest

from thrustd.__main__ import main
from thrustd.core.errors import RecordingError
from thrustd.records.rename import read_rename
from thrustd.records.time_axis import TimeAxis, read_timed


@pytest.mark.parametrize("name", ["accel_x_g", "time_s", "n1_pct_left"])
def test_a_channel_of_another_length_is_refused(tmp_path, capsys, name):
    columns = {"time_s": np.arange(40) * 0.1, "force_N": np.arange(40.0), "deformation_mm": np.arange(40.0)}
    np.savez(tmp_path / "rig.npz", **columns | {name: np.arange(30.0)})
    assert main(["info", str(tmp_path / "rig.npz")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"rig.npz: {name} has 30 values, other columns 40; expected as many" in line


def test_what_is_no_channel_may_have_another_length(tmp_path):
    """Archives of public records say where their segments begin."""
    columns = {"time_s": np.arange(40) * 0.1, "u": np.arange(40.0), "y": np.arange(40.0)}
    np.savez(tmp_path / "rig.npz", **columns, seg_start=[0, 20], Ts=0.1)
    record = read_timed(tmp_path / "rig.npz", TimeAxis())
    assert list(record.channels) == ["u", "y"] and "seg_start: 2 values where others have 40, left out" in record.notes


@pytest.mark.parametrize("tremble_s", [0.0, 0.004])
def test_a_rate_beside_a_clock_is_said_and_one_that_contradicts_it_is_refused(tmp_path, tremble_s):
    stamps = np.arange(400) * 0.05 + np.random.default_rng(1).uniform(0.0, tremble_s, 400)
    path = tmp_path / "rig.csv"
    np.savetxt(path, np.column_stack((stamps, np.sin(stamps))), delimiter=",", header="time_s,force_N", comments="")
    assert "replaced by 20 as asked for" in read_timed(path, TimeAxis(rate_hz=20.0)).notes[0]
    with pytest.raises(
        RecordingError, match=r"50 rows a second were asked for, its time_s has .*; expected one of both"
    ):
        read_timed(path, TimeAxis(rate_hz=50.0))
    aside = read_timed(path, TimeAxis(rate_hz=50.0), [read_rename("time_s=clock")])
    assert aside.sample_hz == pytest.approx(50.0) and not aside.notes[1:]


def test_a_clock_that_stands_is_replaced_with_a_word(tmp_path):
    (tmp_path / "rig.csv").write_text("time_s,force_N\n" + "0,1\n" * 20)
    assert (
        "time_s does not rise; replaced by 20 rows a second"
        in read_timed(tmp_path / "rig.csv", TimeAxis(rate_hz=20.0)).notes[0]
    )
