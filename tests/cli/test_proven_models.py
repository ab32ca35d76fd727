"""Every verb that loads a model refuses one whose witness rows do not come out again, as the daemon does."""

import json

import numpy as np
import pytest

from tests.conftest import simple_model, small_aircraft
from thrustd.__main__ import main
from thrustd.core.errors import ModelError
from thrustd.fleet.fleet import CompareJob
from thrustd.installation.installation import CONFIG
from thrustd.model.artifact import write_model
from thrustd.records.files import write_recording
from thrustd.records.recording import make_recording
from thrustd.workbench.folder import Folder

VERBS = (
    "compare MODEL bench.csv",
    "diagnose MODEL bench.csv",
    "extend MODEL bench.csv --effect hysteresis -o out.json",
    "extend MODEL --given axial_inertia.mass_kg=186.5 -o out.json",
    "compile MODEL --rate 100",
    "info MODEL",
)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A bench record, a model, the same with a stiffness changed by hand, and one that lost its witness."""
    good = json.loads(write_model(simple_model()))
    bent = json.loads(write_model(simple_model()))
    bent["linear"]["direct"] *= 1.01
    for name, spec in (("good", good), ("bent", bent), ("bare", good | {"witness": None})):
        (tmp_path / f"{name}.json").write_text(json.dumps(spec))
    time_s = np.arange(2000) * 0.1
    ones = np.ones(len(time_s))
    columns = {"time_s": time_s, "deformation_mm": 0.4 - 0.4 * np.cos(time_s / 5), "accel_x_g": 0 * ones}
    columns |= {"accel_z_g": ones, "force_N": 5000 * columns["deformation_mm"]}
    write_recording(make_recording("bench", columns), tmp_path / "bench.csv")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("call", VERBS)
@pytest.mark.parametrize("name", ["bent", "bare"])
def test_a_model_that_does_not_come_out_again_is_refused(folder, capsys, call, name):
    assert main(call.replace("MODEL", f"{name}.json").split()) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"{name}.json: " in line
    assert "witness row" in line
    assert not (folder / "out.json").exists()


def test_the_same_model_as_it_was_written_is_taken(folder, capsys):
    assert main(["compare", "good.json", "bench.csv"]) == 0


def test_a_flight_is_not_simulated_with_it_and_a_configuration_is_not_ready(folder, capsys):
    aircraft = small_aircraft()
    for name, content in aircraft.files.items():
        (folder / ("aircraft.toml" if name == CONFIG else name)).write_bytes(content)
    (folder / "left_lower.json").write_bytes((folder / "bent.json").read_bytes())
    for call in ("check aircraft.toml", "simulate --minutes 0.1 --config aircraft.toml -o out.mcap"):
        assert main(call.split()) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert "left_lower.json: witness row" in line
    assert not (folder / "out.mcap").exists()


def test_fleet_and_workbench_refuse_it_too(folder):
    with pytest.raises(ModelError, match="witness row"):
        CompareJob((str(folder / "bent.json"),))(str(folder / "bench.csv"))
    with pytest.raises(ModelError, match="witness row"):
        Folder(folder).model("bent.json")
