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
    assert row["validation"]["fit_pct"] > 90.0


def test_a_model_worse_than_a_constant_is_written_and_stops_a_script(tmp_path, capsys):
    rng = np.random.default_rng(1)
    u = np.repeat(rng.uniform(0, 1, 50), 20)
    path, other, out = tmp_path / "bench.csv", tmp_path / "other.csv", tmp_path / "bench.json"
    for where, slope in ((path, 1.0), (other, -3.0)):
        y = slope * u + 0.01 * rng.normal(size=1000)
        np.savetxt(where, np.column_stack((u, y)), delimiter=",", header="u,y", comments="")
    named = ["--rate", "10", "--input", "u", "--output", "y", "--structure", "static-pwl", "--json"]
    assert main(["identify", str(path), "--validate", str(other), *named, "-o", str(out)]) == 1
    assert json.loads(capsys.readouterr().out)["usable"] is False
    assert out.exists()


def test_identify_and_compare_tell_how_long_a_record_is_and_at_what_rate(tmp_path, capsys):
    """Milliseconds in time_s make hours of minutes."""
    u = np.repeat(np.random.default_rng(1).uniform(0, 1, 50), 20)
    path, out = str(tmp_path / "bench.csv"), str(tmp_path / "bench.json")
    columns = np.column_stack((np.arange(1000) * 50.0, u, 3.0 * u))
    np.savetxt(path, columns, delimiter=",", header="time_s,u,y", comments="")
    named = ["--input", "u", "--output", "y"]
    for call in (["identify", path, "--structure", "static-pwl", "-o", out], ["compare", out, path]):
        main([*call, *named])
        assert "bench.csv: 1000 samples, 13.88 h, 0.02 Hz" in capsys.readouterr().out


def test_a_missing_column_is_named(tmp_path, capsys):
    path = tmp_path / "tank.csv"
    np.savetxt(path, np.ones((50, 2)) * np.arange(50)[:, None], delimiter=",", header="time_s,u", comments="")
    assert main(["identify", str(path), "--input", "pump_V", "-o", str(tmp_path / "tank.json")]) != 0
    assert "pump_V" in capsys.readouterr().err


def test_records_to_judge_in_another_unit_are_named_by_their_own_words(tmp_path, capsys):
    u = np.repeat(np.random.default_rng(0).uniform(-1, 1, 40), 10)
    for name, scale in (("bar", 3.0), ("pascal", 3e5)):
        columns = np.column_stack((u, scale * u))
        np.savetxt(tmp_path / f"{name}.csv", columns, delimiter=",", header="travel,pull", comments="")
    bar, pascal = (str(tmp_path / f"{name}.csv") for name in ("bar", "pascal"))
    named = ["--rate", "10", "--input", "travel", "--output", "pull", "--structure", "static-pwl"]
    out = ["-o", str(tmp_path / "m.json")]
    main(["identify", pascal, "--validate", bar, *named, *out])
    assert "bar.csv: pull spans" in " ".join("".join(capsys.readouterr()).split())
    assert main(["identify", bar, "--validate", bar, *named, *out]) == 0
    assert "fitted to as well" in "".join(capsys.readouterr())


def test_files_without_a_time_need_one_word_more(tmp_path, capsys):
    rng = np.random.default_rng(3)
    u = np.repeat(rng.uniform(-2.0, 2.0, 60), 20)
    y = np.convolve(u, 0.3 * 0.8 ** np.arange(60))[: len(u)] + 0.01 * rng.normal(size=len(u))
    path, out = tmp_path / "foreign.csv", str(tmp_path / "foreign.json")
    rows = [f"{a:.6g},{b:.6g},{0.25 if k == 0 else ''}," for k, (a, b) in enumerate(zip(u, y, strict=True))]
    path.write_text("\n".join(['"uEst","yEst","Ts",', *rows]))
    assert main(["identify", str(path), "-o", out]) != 0
    assert "--time COLUMN" in capsys.readouterr().err
    assert main(["identify", str(path), "--rate", "4", "-o", out]) != 0
    assert "--input COLUMN and --output COLUMN" in capsys.readouterr().err
    named = ["--rate", "4", "--input", "uEst", "--output", "yEst", "--structure", "oe-2-2", "--json"]
    other = ["--validate", str(path), "--validate-columns", "yEst", "uEst"]
    assert main(["identify", str(path), *named, *other, "-o", out]) == 1  # the wrong way round no model is of use
    found = json.loads(capsys.readouterr().out)
    assert found["unit"] == ""
    assert found["structures"][0]["validation"]["rmse_n"] > found["structures"][0]["train"]["rmse_n"]


def test_the_unit_is_that_of_the_file(tmp_path, capsys):
    path = tmp_path / "spring.csv"
    u = np.repeat(np.random.default_rng(0).uniform(-1, 1, 40), 10)
    np.savetxt(path, np.column_stack((u, 3 * u)), delimiter=",", header="travel_mm,pull_bar", comments="")
    named = ["--rate", "10", "--input", "travel_mm", "--output", "pull_bar", "--structure", "static-pwl"]
    assert main(["identify", str(path), *named, "-o", str(tmp_path / "spring.json")]) == 0
    assert "free-run error, bar" in capsys.readouterr().out


def test_a_unit_in_brackets_is_the_unit(tmp_path, capsys):
    path = tmp_path / "valve.csv"
    u = np.repeat(np.random.default_rng(0).integers(0, 6, 30), 10)
    header = "t [s],valve (%),pressure [bar]"
    np.savetxt(path, np.column_stack((np.arange(300) / 2, u, 3 * u)), delimiter=",", header=header, comments="")
    named = ["--time", "t [s]", "--input", "valve (%)", "--output", "pressure [bar]", "--structure", "static-pwl"]
    assert main(["identify", str(path), *named, "-o", str(tmp_path / "valve.json")]) == 0
    assert "free-run error, bar" in capsys.readouterr().out
