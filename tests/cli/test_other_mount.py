"""A model, or a record of gauge blocks, of another mount than --mount says."""

import numpy as np
import pytest

from thrustd.__main__ import main
from thrustd.records.files import write_recording
from thrustd.records.recording import make_recording


@pytest.fixture
def flight(tmp_path):
    time_s = 0.5 * np.arange(1200)
    mm = 0.4 + 0.3 * np.sin(0.02 * time_s)
    columns = {f"{name}_left_upper": mm for name in ("deformation_mm",)} | {"force_N": 5000.0 * mm}
    path = tmp_path / "flight.csv"
    write_recording(make_recording("flight", {"time_s": time_s, **columns, "accel_x_g": 0 * mm, "accel_z_g": 1 + 0 * mm,
                                              "temperature_degC_left_upper": 20.0 + mm}), path)  # fmt: skip
    return str(path)


@pytest.mark.parametrize(("model", "warned"), [("left-upper", False), ("left-lower", True)])
def test_a_model_that_is_called_as_another_mount_is_said(model, warned, flight, tmp_path, capsys):
    named = f"models/{model}.json"
    c = ["compile", named, "--rate", "100", "--mount", "left_upper", "--c", str(tmp_path / "m.c")]
    for command in (["compare", named, flight, "--mount", "left_upper", "--against", "force_N"], c):
        assert main(command) == 0
        said = [line for line in capsys.readouterr().err.splitlines() if "another mount" in line]
        assert len(said) == warned
        assert not warned or said == [
            "warning: --mount left_upper: the model is called left-lower, another mount of the configuration"
        ]


def test_gauge_blocks_of_a_mount_that_is_nowhere_are_one_line_and_no_file(tmp_path, capsys):
    blocks, out = tmp_path / "b.csv", tmp_path / "c.toml"
    gauge = np.linspace(0.0, 1.4, 15)
    write_recording(make_recording("b", {"time_s": gauge, "gauge_mm": gauge, "deformation_mm": gauge + 1e-4}), blocks)
    assert main(["calibrate", "blocks", str(blocks), "--mount", "leftupper", "-o", str(out)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "--mount leftupper: not in the configuration" in line and not out.exists()
