"""Recordings whose time jumps or never ends: one line, and no grid that fills memory."""

import numpy as np
import pytest

from tests.cli.test_bad_input import refused
from thrustd.core.errors import RecordingError
from thrustd.records.files import write_recording
from thrustd.records.recording import make_recording

ROWS = 300
FLIGHT = dict.fromkeys(
    ("n1_pct_left", "fuel_flow_kg_s_left", "mach", "pressure_altitude_m", "sat_degC", "force_N", "n1_pct_right"),
    np.linspace(0.05, 0.1, ROWS),
)


@pytest.fixture
def jumped(tmp_path):
    """A clock that jumps by four months."""
    time_s = np.arange(ROWS) * 0.1
    time_s[200:] += 1e7
    write_recording(make_recording("a", {"time_s": time_s, **FLIGHT}), tmp_path / "a.csv")
    return tmp_path / "a.csv"


@pytest.mark.parametrize(
    "verb",
    ["points", "transients", "performance", "simulate -o {}/o.mcap --recording", "simulate -o {}/o.csv --programme"],
)
def test_a_clock_that_jumps_is_no_flight_and_no_programme(jumped, capsys, verb):
    line = refused(capsys, *verb.format(jumped.parent).split(), jumped)
    assert "a.csv: 1e+07 s long, 1e+07 s of it behind data row 200; expected at most 3" in line
    assert sorted(jumped.parent.iterdir()) == [jumped]


def test_a_grid_has_a_largest_size(jumped, capsys):
    line = refused(capsys, "convert", jumped, "--rate", "100", "-o", jumped.with_name("o.csv"))
    assert "a.csv: 1e+07 s at 100 Hz, that is 1e+09 rows; expected 1 row and more, at most 5e+08 values in all" in line


@pytest.mark.parametrize("far", [1e15, 1e300, -1e13])
def test_seconds_that_no_clock_shows_are_named(far):
    with pytest.raises(RecordingError, match=r"time_s = .* in data row 2; expected seconds, -1e\+12 to 1e\+12"):
        make_recording("a", {"time_s": [0.0, far], "force_N": [1.0, 2.0]})
