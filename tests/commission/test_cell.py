"""A load cell's record with samples in it that no run could have made, and with more than the mounts explain."""

import numpy as np
import pytest

from thrustd.commission.tether import fit_tether
from thrustd.core.errors import RecordingError
from thrustd.records.files import read_recording
from thrustd.replay.columns import flight_columns
from thrustd.replay.replay import open_installation
from thrustd.sources.log_run import LogRun, run_paths


@pytest.fixture(scope="module")
def run(static_run):
    log = LogRun(run_paths(static_run))
    installation = open_installation(log, None)
    return flight_columns(log, installation), read_recording(static_run.with_name("run-cell.csv")), installation


@pytest.mark.parametrize(("first", "count", "force_n"), [(8000, 1, 1e5), (8000, 10, 1e6)])
def test_a_glitch_of_the_cell_is_left_out_and_said(run, first, count, force_n):
    """One sample of 100 kN made the bands of all mounts nearly three times as wide, unsaid."""
    flight, cell, installation = run
    clean, changed = fit_tether(flight, cell, installation), cell["force_N"].copy()
    changed[first : first + count] = force_n
    found = fit_tether(flight, cell.with_channels(force_N=changed), installation)
    assert not clean.remarks
    (line,) = found.remarks
    assert f"{count} of {len(cell)} samples left out" in line
    assert f"the largest {force_n:.0f} N at {cell.time_s[first]:.2f} s" in line
    assert found.after_n == pytest.approx(clean.after_n, rel=0.01)
    for name, (gain, std) in clean.gains.items():
        assert found.gains[name] == (pytest.approx(gain, abs=1e-4), pytest.approx(std, rel=0.05))


def test_more_left_than_the_models_leave_is_said(run):
    """A rope that slips: 300 N less from then on are no glitch, and no gain either."""
    flight, cell, installation = run
    slipped = cell["force_N"] + 300.0 * (np.arange(len(cell)) > 7000)
    (line,) = fit_tether(flight, cell.with_channels(force_N=slipped), installation).remarks
    assert "N RMS left, of the mounts' own errors" in line and "did the rope slip" in line


def test_a_record_without_numbers_is_no_other_clock(run):
    flight, cell, installation = run
    with pytest.raises(RecordingError, match="less than 60 s with a number in force_N: 0 s"):
        fit_tether(flight, cell.with_channels(force_N=np.nan * cell["force_N"]), installation)
