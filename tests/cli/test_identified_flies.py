"""From the bench to the air: what `identify` writes, `compile` accepts and `replay` flies."""

import json

import pytest

from tests.conftest import ROOT
from thrustd.__main__ import main
from thrustd.records.files import write_recording
from thrustd.sources.mcap_log import LogFile
from thrustd.twin.bench import Rig, step_bench

SLOW = Rig(sample_hz=10.0)
FLIGHT = ROOT / "replay_logs" / "throttle-steps.mcap"


@pytest.fixture
def winner(tmp_path, capsys):
    """The model of the left upper mount, as the verb writes it, and what it said."""
    for name, seed in (("bench", 1), ("other", 2)):
        write_recording(step_bench(1.0, seed, rig=SLOW), tmp_path / f"{name}.csv")
    records = [str(tmp_path / "bench.csv"), "--validate", str(tmp_path / "other.csv")]
    compared = ["--structure", "polynomial-ols", "--structure", "hammerstein"]
    assert main(["identify", *records, *compared, "--json", "-o", str(tmp_path / "found.json")]) == 0
    return tmp_path / "found.json", json.loads(capsys.readouterr().out)


def test_the_winner_compiles_at_the_rate_of_flight_and_flies(winner, tmp_path, capsys):
    model, said = winner
    rmse_n = {row["structure"]: row["validation"]["rmse_n"] for row in said["structures"]}
    assert said["structure"] == min(rmse_n, key=rmse_n.get) == "hammerstein"
    assert main(["compile", str(model), "--rate", "100", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["worst_difference_between_rates_n"] < 10.0
    out = tmp_path / "flown.mcap"
    config = _with_model(model, tmp_path)
    assert main(["replay", str(FLIGHT), "--config", str(config), "--json", "-o", str(out)]) == 0
    own = json.loads(capsys.readouterr().out)
    assert own["missing_events"] == 0
    assert model.read_text() in LogFile(out).header.files.values()
    assert own["scores"]["left_upper"]["mount"]["rmse_n"] < 200.0  # of 3 kN; it knows no friction, weight or inertia


def _with_model(model, folder):
    """The installation of the bench with one model replaced."""
    text = (ROOT / "deploy" / "hil.toml").read_text()
    text = text.replace("../models/left-upper.json", str(model)).replace('"../models', f'"{ROOT / "models"}')
    config = folder / "own.toml"
    for name in ("canaerospace.dbc", "citation-ii.toml"):
        text = text.replace(f'"{name}"', f'"{ROOT / "deploy" / name}"')
    config.write_text(text)
    return config
