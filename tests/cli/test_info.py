"""`thrustd info` says what a JSON file is, and `check` says what is no configuration."""

import json

import msgspec
import pytest

from tests.conftest import ROOT
from thrustd.__main__ import main

DECK = ROOT / "models" / "brochure" / "jt15d-4.json"
MODEL = ROOT / "models" / "left-upper.json"


def test_a_deck_tells_engines_flights_and_errors_as_they_stand_in_the_file(capsys):
    assert main(["info", str(DECK)]) == 0
    told = capsys.readouterr().out
    deck = msgspec.json.decode(DECK.read_bytes())
    assert all(line in told for line in deck["provenance"])
    for name, value in deck["errors"].items():
        assert f"  {name}  {value:.6g}\n" in told
    assert "  0  N1, N2\n  1  N1, N2\n" in told
    assert main(["info", str(DECK), "--json"]) == 0
    assert msgspec.json.decode(capsys.readouterr().out)["name"] == deck["name"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty; expected a mount model"),
        ("[1, 2]", "a JSON list of 2; expected a mount model"),
        ("7", "a single JSON value; expected"),
        ('{"a": 1, "b": 2}', "without a schema of thrustd, its keys: a, b; expected"),
        ("{", "not JSON: "),
    ],
)
def test_other_json_is_named(tmp_path, capsys, text, words):
    path = tmp_path / "some.json"
    path.write_text(text)
    assert main(["info", str(path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert words in line
    assert "some.json" in line


def test_a_file_of_another_type_is_told_which_there_are(capsys):
    assert main(["info", str(ROOT / "README.md")]) == 2
    assert "expected a file of type .csv, .parquet, .npz, .mat, .mcap, .json, .toml" in capsys.readouterr().err


def test_a_text_column_is_named_where_the_time_is_missed(tmp_path, capsys):
    (tmp_path / "clock.csv").write_text("time,force_N\n10:00:01,5\n10:00:02,6\n")
    for call in (["info"], ["convert", "-o", str(tmp_path / "x.csv")]):
        assert main([*call, str(tmp_path / "clock.csv")]) == 2
        assert "it has force_N; time: text column left out" in capsys.readouterr().err


def test_a_file_without_a_known_time_is_described_and_its_time_may_be_named(tmp_path, capsys):
    path = tmp_path / "rig.csv"
    path.write_text("Time [s],Load [kN],LVDT (V)\n0.0,1.5,0.3\n0.1,1.6,0.4\n0.2,1.7,0.5\n")
    assert main(["info", str(path)]) == 2  # described, and what another verb would miss
    said = capsys.readouterr()
    assert all(line in said.out for line in ("rows: 3", "Load [kN]  kN", "LVDT (V)  V"))
    (line,) = said.err.splitlines()
    assert "--rename 'Time [s]=time_s'" in line and "--time COLUMN" in line
    for more, hertz in ((["--time", "Time [s]"], 10.0), (["--rate", "50"], 50.0)):
        assert main(["info", str(path), *more, "--json"]) == 0
        told = msgspec.json.decode(capsys.readouterr().out)
        assert told["sample_hz"] == pytest.approx(hertz) and told["channels"]["Load [kN]"] == "kN"
    assert main(["info", str(path), "--rate", "-1"]) == 2
    assert "above 0" in capsys.readouterr().err
    assert main(["info", str(path), "--time", "Time [s]", "--rate", "50"]) == 2
    assert "--rate 50: --time Time [s] says when; expected one of both" in capsys.readouterr().err


def test_an_effect_has_the_word_of_all_reports_and_its_own_law_in_brackets(capsys):
    assert main(["info", str(MODEL)]) == 0
    said = capsys.readouterr().out
    assert "  hysteresis (hysteresis_stops)  travel_mm = " in said and "  axial_inertia  mass_kg = 171.7" in said
    assert main(["info", str(MODEL), "--json"]) == 0
    assert "hysteresis_stops" in json.loads(capsys.readouterr().out)["effects"]  # what `--effect` and files take


@pytest.mark.parametrize(("path", "words"), [(MODEL, "a mount model, read by"), (DECK, "a brochure deck, read by")])
def test_a_model_is_no_configuration(capsys, path, words):
    assert main(["check", str(path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"{path}: {words}" in line
    assert "thrustd info" in line
