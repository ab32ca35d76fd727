"""The verb `identify` on data that are not of a mount."""

import json

import numpy as np

from thrustd.__main__ import main


def test_any_two_columns_can_be_input_and_output(tmp_path, capsys):
    rng = np.random.default_rng(3)
    volt = np.repeat(rng.uniform(-2.0, 2.0, 60), 20)
    level = np.zeros(len(volt))
    for k in range(1, len(volt)):
        level[k] = 0.9 * level[k - 1] - 0.3 * volt[k - 1]
    table = np.column_stack((4.0 * np.arange(len(volt)), volt, level + 0.002 * rng.normal(size=len(volt))))
    path = tmp_path / "tank.csv"
    np.savetxt(path, table, delimiter=",", header="time_s,pump_V,level_V", comments="")
    arguments = ["identify", str(path), "--input", "pump_V", "--output", "level_V", "-o", str(tmp_path / "tank.json")]
    assert main([*arguments, "--structure", "oe-2-2", "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["structures"]
    assert row["validation"]["fit_pct"] > 97.0


def test_a_missing_column_is_named(tmp_path, capsys):
    path = tmp_path / "tank.csv"
    np.savetxt(path, np.ones((50, 2)) * np.arange(50)[:, None], delimiter=",", header="time_s,u", comments="")
    assert main(["identify", str(path), "--input", "pump_V", "-o", str(tmp_path / "tank.json")]) != 0
    assert "pump_V" in capsys.readouterr().err
