"""`thrustd demo` replays the flight in the package, and overwrites nothing."""

import json

from tests.cli.test_bad_input import refused
from thrustd.__main__ import main


def test_demo_writes_a_log_and_a_picture(tmp_path, capsys):
    folder = tmp_path / "demo"
    assert main(["demo", "--folder", str(folder), "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["estimates"] > 1000 and summary["scores"]["left"]["fused"]["rmse_n"] < 100
    assert {path.name for path in folder.iterdir()} == {"estimates.mcap", "flight.png"}
    assert "already exists" in refused(capsys, "demo", "--folder", folder)
