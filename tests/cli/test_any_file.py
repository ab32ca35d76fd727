"""Somebody else's file through the loop on the command line: their columns, their units, their complaints."""

import json

import numpy as np
import pytest

from thrustd.__main__ import main


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    """A folder with a spring of 3 tonf/cm that was recorded twice without a time, and a model of it."""
    folder = tmp_path_factory.mktemp("rig")
    rng = np.random.default_rng(4)
    for name in ("a.csv", "b.csv"):
        x = np.cumsum(rng.normal(size=4000))
        x = 10 * np.convolve(x - x.mean(), np.ones(50) / 50, "same") / np.abs(x).max()
        table = np.column_stack((x, 3 * x + rng.normal(0, 0.1, len(x)), np.sin(np.arange(4000) / 300)))
        np.savetxt(folder / name, table, delimiter=",", header="travel_cm,load_tonf,oil_bar", comments="")
    said = ["--rate", "20", "--input", "travel_cm", "--output", "load_tonf"]
    assert (
        main(["identify", str(folder / "a.csv"), *said, "--structure", "polynomial-ols", "-o", str(folder / "m.json")])
        == 0
    )
    return folder


ROLES = ["--rate", "20", "--input", "travel_cm", "--output", "load_tonf"]


def test_compare_reads_the_columns_and_prints_their_unit(rig, capsys):
    assert main(["compare", str(rig / "m.json"), str(rig / "b.csv"), *ROLES, "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)["comparisons"]
    assert found["rmse_n"] == pytest.approx(0.1, rel=0.1)
    assert (found["unit"], found["input"], found["output"]) == ("tonf", "travel_cm", "load_tonf")
    assert main(["compare", str(rig / "m.json"), str(rig / "b.csv"), *ROLES]) == 0
    shown = capsys.readouterr().out
    assert "RMSE tonf" in shown and "kN" not in shown and " N" not in shown.replace(" N ", "")


def test_info_names_the_columns_of_the_model_and_no_newton(rig, capsys):
    assert main(["info", str(rig / "m.json")]) == 0
    shown = capsys.readouterr().out
    assert "  travel_cm  -" in shown and "  load_tonf  -" in shown
    assert "deformation_mm" not in shown and "force_n" not in shown and " N" not in shown


@pytest.mark.parametrize("verb", ["compare", "diagnose", "extend"])
def test_a_column_in_another_unit_than_the_models_is_refused(rig, capsys, tmp_path, verb):
    """Taken as they stand, millimetres would be centimetres and newtons tonnes, with sizes that look possible."""
    table = np.loadtxt(rig / "b.csv", delimiter=",", skiprows=1)
    np.savetxt(tmp_path / "m.csv", table, delimiter=",", header="deformation_mm,force_N,oil_bar", comments="")
    more = ["--effect", "creep", "-o", str(tmp_path / "x.json")] if verb == "extend" else []
    assert main([verb, str(rig / "m.json"), str(tmp_path / "m.csv"), "--rate", "20", *more]) == 2
    line = capsys.readouterr().err
    assert "travel_cm of the model is in cm, deformation_mm of m.csv in mm; expected a column in cm" in line
    assert "--rename 'deformation_mm=travel_cm*FACTOR'" in line and line.count("\n") == 1


def test_a_column_that_was_converted_or_says_no_unit_is_compared(rig, capsys, tmp_path):
    table = np.loadtxt(rig / "b.csv", delimiter=",", skiprows=1) * [10, 1, 1]
    np.savetxt(tmp_path / "m.csv", table, delimiter=",", header="deformation_mm,load,oil_bar", comments="")
    said = ["--rate", "20", "--rename", "deformation_mm=travel_cm*0.1", "--input", "travel_cm", "--output", "load"]
    assert main(["compare", str(rig / "m.json"), str(tmp_path / "m.csv"), *said, "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)["comparisons"]
    assert found["rmse_n"] == pytest.approx(0.1, rel=0.1)


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ("--rate 20 --input travel_mm --output load_tonf", "no column 'travel_mm'; it has"),
        ("--rate 20 --input Travel_cm --output load_tonf", "did you mean travel_cm?"),
        ("--rate 20", "no reference: expected force_N or thrust_N"),
        ("--rate 0 --input travel_cm --output load_tonf", "--rate 0: expected samples per second"),
        ("--input travel_cm --output load_tonf", "no column 'time_s'"),
        ("--rate 20 --input travel_cm --output travel_cm", "is input and output; expected two columns"),
        ("--rate 20 --input travel_cm --output load_tonf --against oil_bar", "expected one of the two"),
        ("--rate 20 --input travel_cm --mount left_upper", "expected no --input or --output"),
    ],
)
@pytest.mark.parametrize("verb", ["compare", "diagnose", "extend"])
def test_bad_words_about_columns_are_one_line(rig, capsys, tmp_path, verb, said, words):
    more = ["--effect", "creep", "-o", str(tmp_path / "x.json")] if verb == "extend" else []
    assert main([verb, str(rig / "m.json"), str(rig / "b.csv"), *said.split(), *more]) == 2
    said_error = capsys.readouterr().err
    assert words in said_error and said_error.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_guess_about_a_unit_can_be_overruled(rig, capsys, tmp_path):
    table = np.loadtxt(rig / "b.csv", delimiter=",", skiprows=1)
    table[:, 2] = 9.8 + 0.1 * table[:, 2]
    header = "travel_cm,load_tonf,accel_z_g"
    np.savetxt(tmp_path / "g.csv", table, delimiter=",", header=header, comments="")
    call = ["compare", str(rig / "m.json"), str(tmp_path / "g.csv"), *ROLES]
    assert main(call) == 2
    assert "accel_z_g is about 9.8" in capsys.readouterr().err
    assert main([*call, "--trust-units"]) == 0


def test_another_size_is_asked_about_in_their_words(rig, capsys, tmp_path):
    table = np.loadtxt(rig / "b.csv", delimiter=",", skiprows=1) * [1.0, 1e3, 1.0]
    np.savetxt(tmp_path / "kgf.csv", table, delimiter=",", header="travel_cm,load_tonf,oil_bar", comments="")
    assert main(["compare", str(rig / "m.json"), str(tmp_path / "kgf.csv"), *ROLES]) == 2
    assert "load_tonf reaches" in (said := capsys.readouterr().err) and "another unit?" in said


def test_a_record_at_one_level_or_without_a_force_is_one_line(rig, capsys, tmp_path):
    """What it cannot tell is no second complaint."""
    table = np.loadtxt(rig / "b.csv", delimiter=",", skiprows=1)
    for column, value, words in ((0, 2.0, "travel_cm never moves"), (1, np.nan, "load_tonf has no value at all")):
        bad = table.copy()
        bad[:, column] = value
        np.savetxt(tmp_path / "bad.csv", bad, delimiter=",", header="travel_cm,load_tonf,oil_bar", comments="")
        for verb, *more in (["compare"], ["diagnose"], ["extend", "--effect", "creep", "-o", str(tmp_path / "x.json")]):
            assert main([verb, str(rig / "m.json"), str(tmp_path / "bad.csv"), *ROLES, *more]) == 2
            (line,) = capsys.readouterr().err.splitlines()
            assert words in line


def test_a_rate_that_stands_in_for_a_clock_is_said(rig, capsys, tmp_path):
    table = np.loadtxt(rig / "b.csv", delimiter=",", skiprows=1)
    table = np.column_stack((np.arange(len(table)) / 20, table))
    np.savetxt(tmp_path / "b.csv", table, delimiter=",", header="time_s,travel_cm,load_tonf,oil_bar", comments="")
    assert main(["compare", str(rig / "m.json"), str(tmp_path / "b.csv"), *ROLES]) == 0
    assert "b.csv: time_s, 20 rows a second, replaced by 20 as asked for" in capsys.readouterr().err


@pytest.mark.parametrize("verb", ["diagnose", "extend"])
def test_an_effect_that_is_mistyped_is_offered_the_nearest(rig, capsys, tmp_path, verb):
    more = ["-o", str(tmp_path / "x.json")] if verb == "extend" else []
    said = [*ROLES, "--effect", "hysteresys", *more]
    assert main([verb, str(rig / "m.json"), str(rig / "b.csv"), *said]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "unknown effect 'hysteresys': expected hysteresis or " in line and "thrustd effects" in line
    assert "nacelle_drag" not in line
