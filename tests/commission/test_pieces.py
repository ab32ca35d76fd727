"""Records of a rig without a number in a column: one line, before any work."""

import numpy as np
import pytest

from thrustd.__main__ import main
from thrustd.records.files import write_recording
from thrustd.records.recording import make_recording

ROWS = 400


@pytest.mark.parametrize("silent", ["force_N", "deformation_mm", "temperature_degC"])
def test_a_column_without_a_number_is_one_line_and_no_folder(silent, tmp_path, capsys):
    mm = np.abs(np.sin(0.05 * np.arange(ROWS)))
    columns = {"deformation_mm": mm, "force_N": 5000.0 * mm, "temperature_degC": 20.0 + 20.0 * mm}
    bench, off = tmp_path / "bench.csv", tmp_path / "off.csv"
    write_recording(make_recording("bench", {"time_s": 0.1 * np.arange(ROWS), **columns}), bench)
    write_recording(make_recording("off", {"time_s": 0.1 * np.arange(ROWS), **columns, silent: np.nan * mm}), off)
    benches = [f"upper={bench if silent == 'temperature_degC' else off}", f"lower={bench}"]
    given = ["commission", "--bench", *benches, "--chamber", str(off), "-o", str(tmp_path / "aircraft")]
    assert main(given) == 2
    (line,) = (line for line in capsys.readouterr().err.splitlines() if not line.startswith("read"))
    assert line.startswith("thrustd: off.csv: ") and silent in line
    assert not (tmp_path / "aircraft").exists()
