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


@pytest.mark.parametrize(
    ("option", "scale", "dt_s", "words"),
    [
        ("--bench", 1.0, 100.0, "a sample every 100 s"),
        ("--weight", 0.2248, 0.1, "the benches 5e+03; expected a mount of that kind"),
        ("--chamber", 4.4482, 0.1, "the benches 5e+03; expected a mount of that kind"),
    ],
)
def test_milliseconds_and_pounds_are_refused(option, scale, dt_s, words, tmp_path, capsys):
    """Both flew: relaxations of 700 s, and stiffening by normal load 12 times too large."""
    mm = np.abs(np.sin(0.05 * np.arange(ROWS)))
    columns = {"deformation_mm": mm, "force_N": 5000.0 * mm, "temperature_degC": 20.0 + 20.0 * mm}
    bench, off = tmp_path / "bench.csv", tmp_path / "off.csv"
    write_recording(make_recording("bench", {"time_s": 0.1 * np.arange(ROWS), **columns}), bench)
    columns |= {"force_N": scale * 5000.0 * mm, "accel_z_g": 1.0 + mm}
    write_recording(make_recording("off", {"time_s": dt_s * np.arange(ROWS), **columns}), off)
    upper = off if option == "--bench" else bench
    more = [] if option == "--bench" else [option, str(off)]
    out = str(tmp_path / "aircraft")
    assert main(["commission", "--bench", f"upper={upper}", f"lower={bench}", *more, "-o", out]) == 2
    (line,) = (line for line in capsys.readouterr().err.splitlines() if not line.startswith("read"))
    assert line.startswith("thrustd: off.csv: ") and words in line
    assert not (tmp_path / "aircraft").exists()
