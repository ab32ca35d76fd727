"""Bad input is one line on standard error and exit status 2; no traceback, nothing written."""

import json

import numpy as np
import pytest

from thrustd.__main__ import main
from thrustd.records.files import write_recording
from thrustd.records.recording import make_recording


def refused(capsys, *arguments):
    """Run a verb that must refuse; -> its line."""
    assert main([str(argument) for argument in arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    lines = err.splitlines()
    assert len(lines) == 1, lines
    assert lines[0].startswith("thrustd: ")
    return lines[0]


def edit(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def test_a_good_aircraft_is_ready(good, capsys):
    assert main(["check", str(good / "aircraft.toml"), "--json"]) == 0
    assert '"ok":true' in capsys.readouterr().out


def test_check_says_what_flies_beside_what_a_rigid_body_would_carry(good, capsys):
    """It printed 35 % alone, and 46 % flew."""
    assert main(["check", str(good / "aircraft.toml")]) == 0
    assert "35 % of thrust, -1423 +- 30 N at 1 g; 46 % flies, without weight" in capsys.readouterr().out


def test_an_aircraft_whose_sensors_are_not_heard_is_not_ready(broken, capsys):
    assert main(["check", str(broken / "aircraft.toml"), "--live", "0.4"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert sum(line.startswith("degraded: ") for line in lines) >= 2  # each engine, and the port that is not there
    assert ": not ready: " in lines[-1] and not any("ready to fly" in line for line in lines)


@pytest.mark.parametrize(
    ("file", "old", "new", "words"),
    [
        ("aircraft.toml", "sample_hz", "sample_Hz", ("aircraft.toml", "sample_Hz")),
        ("aircraft.toml", "left_lower.json", "gone.json", ("gone.json", "No such file")),
        ("left_upper.json", "thrustd-model/1", "thrustd-model/2", ("left_upper.json", "schema")),
        ("left_upper.json", '"direct": 1.1', '"direct": 1.2', ("left_upper.json", "witness")),
        ("aircraft.toml", '"virtual"', '"carrier-pigeon"', ("can.interface", "carrier-pigeon")),
        ("can.dbc", "Engine1_N1", "Engine1_NX", ("can.dbc", "Engine1_N1")),
        ("can.dbc", "BO_ ", "BO ", ("can.dbc", "DBC")),
        ("deck.json", "{", "[", ("deck.json",)),
    ],
)
def test_check_refuses(broken, capsys, file, old, new, words):
    edit(broken / file, old, new)
    line = refused(capsys, "check", broken / "aircraft.toml")
    for word in words:
        assert word in line


@pytest.mark.parametrize(
    "place", [("witness", "rate_hz"), ("linear", "real_modes", 0, "tau_s"), ("input_curve", "y", 0)]
)
def test_a_model_whose_numbers_overflow_is_one_line(broken, capsys, place):
    model = inner = json.loads((broken / "left_upper.json").read_text())
    for part in place[:-1]:
        inner = inner[part]
    inner[place[-1]] = 1e308
    (broken / "left_upper.json").write_text(json.dumps(model))
    assert "witness row" in refused(capsys, "check", broken / "aircraft.toml")


@pytest.mark.parametrize("call", [("info",), ("check",), ("replay",), ("points",), ("compare", "left_upper.json")])
def test_a_name_that_no_file_can_have_is_one_line(broken, capsys, monkeypatch, call):
    monkeypatch.chdir(broken)
    assert "File name too long" in refused(capsys, *call, "x" * 500 + ".csv")


def test_replay_refuses_what_is_no_log(broken, capsys):
    out = broken / "out.mcap"
    (broken / "empty.mcap").write_bytes(b"")
    (broken / "text.mcap").write_text("time_s,force_N\n")
    for name, word in (("empty.mcap", "empty"), ("text.mcap", "MCAP"), ("gone.mcap", "gone.mcap")):
        assert word in refused(capsys, "replay", broken / name, "-o", out)
    assert not out.exists()


def test_replay_refuses_four_flipped_bytes_but_reads_a_cut_log(broken, capsys):
    content = bytearray((broken / "flight.mcap").read_bytes())
    middle = len(content) // 2
    (broken / "cut.mcap").write_bytes(content[:middle])
    for i in range(middle, middle + 4):
        content[i] ^= 0xFF
    (broken / "flipped.mcap").write_bytes(content)
    line = refused(capsys, "replay", broken / "flipped.mcap", "-o", broken / "out.mcap")
    assert "flipped.mcap" in line
    assert "--salvage" in line
    assert not (broken / "out.mcap").exists()
    assert main(["replay", str(broken / "flipped.mcap"), "--salvage", "--json", "-o", str(broken / "out.mcap")]) == 0
    out, err = capsys.readouterr()
    summary = json.loads(out)
    assert "1 chunk damaged: " in summary["damage"]
    assert summary["damage"] in err
    assert summary["faults"]["log damaged"] == 1
    assert summary["missing_events"] > 0
    assert main(["info", str(broken / "flipped.mcap"), "--json"]) == 2
    out, err = capsys.readouterr()
    assert json.loads(out)["problem"] == summary["damage"]
    assert len(err.splitlines()) == 1
    assert "--salvage" in refused(capsys, "convert", broken / "flipped.mcap", "-o", broken / "out.csv")
    assert main(["convert", str(broken / "flipped.mcap"), "--salvage", "-o", str(broken / "out.csv")]) == 0
    assert "chunk damaged" in capsys.readouterr().err
    assert main(["replay", str(broken / "cut.mcap"), "--json"]) == 0
    assert '"cut":true' in capsys.readouterr().out


def test_a_log_whose_configuration_was_changed_in_it_is_not_replayed(broken, capsys):
    content = (broken / "flight.mcap").read_bytes()
    assert content.count(b"sample_hz = 100") == 1
    (broken / "changed.mcap").write_bytes(content.replace(b"sample_hz = 100", b"sample_hz = 900"))
    assert "SHA-256" in refused(capsys, "replay", broken / "changed.mcap", "--salvage")


def test_check_refuses_a_model_of_another_unit(broken, capsys):
    path = broken / "left_upper.json"
    low, high = json.loads(path.read_text())["valid"]["deformation_mm"]
    spec = json.loads(path.read_text())
    spec["valid"]["deformation_mm"] = [low * 1e3, high * 1e3]
    path.write_text(json.dumps(spec))
    line = refused(capsys, "check", broken / "aircraft.toml")
    assert "valid.deformation_mm" in line
    assert "unit" in line


@pytest.mark.parametrize("value", ["inf", "nan", "1000.0", "0.0"])
def test_check_refuses_a_transducer_of_no_such_scale(broken, capsys, value):
    line = (broken / "aircraft.toml").read_text().split("scale_mm = ")[1].split("\n")[0]
    edit(broken / "aircraft.toml", f"scale_mm = {line}", f"scale_mm = {value}")
    assert "scale_mm" in refused(capsys, "check", broken / "aircraft.toml")


@pytest.mark.parametrize("option", ["-o", "--smooth", "--picture"])
def test_what_is_read_is_not_written_over(broken, capsys, option):
    before = (broken / "flight.mcap").read_bytes()
    for log in (broken / "flight.mcap", broken):
        assert "is an input" in refused(capsys, "replay", log, option, broken / "flight.mcap")
    assert (broken / "flight.mcap").read_bytes() == before


def test_a_folder_that_is_not_there_is_told_before_the_work(broken, capsys):
    words = refused(capsys, "replay", broken / "flight.mcap", "-o", broken / "gone" / "out.mcap")
    assert "no folder" in words
    assert "gone" in words


@pytest.mark.parametrize("bench", ["steps", "sine", "multisine", "weight"])
def test_every_bench_record_is_made(tmp_path, capsys, bench):
    out = tmp_path / "bench.csv"
    assert main(["simulate", "--bench", bench, "--hours", "0.05", "--mount", "lower", "-o", str(out)]) == 0
    assert "18000" in capsys.readouterr().out


def test_simulate_refuses_what_cannot_be(tmp_path, capsys):
    assert ".mcap" in refused(capsys, "simulate", "-o", tmp_path / "flight.csv")
    assert "--hours" in refused(capsys, "simulate", "--bench", "sine", "--hours", "nan", "-o", tmp_path / "bench.csv")
    assert "--minutes" in refused(capsys, "simulate", "--hil", "deploy/hil.toml", "--minutes", "0")
    assert "--recording" in refused(capsys, "simulate", "--tethered", "--recording", "f.npz", "-o", tmp_path / "f.mcap")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("deformation_mm,force_N\n0.1,5\n", ("time_s",)),
        ("time_s,force_N\n0,5\n1,lots\n", ("lots",)),
        ("time_s,force_N\n0,5\n2,5\n1,5\n", ("time_s",)),
        ("", ("empty",)),
    ],
)
def test_convert_refuses_and_writes_nothing(tmp_path, capsys, rows, words):
    (tmp_path / "in.csv").write_text(rows)
    line = refused(capsys, "convert", tmp_path / "in.csv", "-o", tmp_path / "out.parquet")
    assert "in.csv" in line
    for word in words:
        assert word in line
    assert sorted(path.name for path in tmp_path.iterdir()) == ["in.csv"]


def test_convert_goes_round_all_types(tmp_path, capsys):
    columns = {"time_s": np.arange(50) * 0.1, "force_N": np.linspace(0, 6e3, 50), "bleed_pct": np.ones(50)}
    write_recording(make_recording("r", columns), tmp_path / "r.csv")
    before = tmp_path / "r.csv"
    for suffix in (".parquet", ".mcap", ".npz", ".mat", ".csv"):
        after = tmp_path / f"next{suffix}"
        assert main(["convert", str(before), "-o", str(after)]) == 0
        before = after
    assert (tmp_path / "next.csv").read_text() == (tmp_path / "r.csv").read_text()


@pytest.mark.parametrize("arguments", [["fly"], [], ["replay"], ["replay", "x.mcap", "--speed", "-1"], ["simulate"]])
def test_a_call_that_makes_no_sense_is_one_line(capsys, arguments):
    refused(capsys, *arguments)


def test_every_verb_has_help_with_an_example(capsys):
    with pytest.raises(SystemExit):
        main(["--help"])
    verbs = [
        line.split()[0] for line in capsys.readouterr().out.splitlines() if line.startswith("    ") and line[4] != " "
    ]
    verbs = [verb for verb in verbs if verb.islower()]
    assert {"run", "replay", "simulate", "convert", "check", "info"} <= set(verbs)
    for verb in verbs:
        with pytest.raises(SystemExit) as done:
            main([verb, "--help"])
        assert done.value.code == 0
        assert "example" in capsys.readouterr().out


@pytest.mark.parametrize("verb", ["extend", "diagnose"])
@pytest.mark.parametrize("effect", ["k * (n1_pct", "open('x')", "no_such_effect", "no column at all"])
def test_an_effect_that_no_recording_could_mend_is_refused_before_one_is_read(broken, capsys, verb, effect):
    record = broken / "notes.csv"
    record.write_text("time_s,deformation_mm,force_N\n" + "".join(f"{n},{n % 7},{n % 5}\n" for n in range(500)))
    out = ["-o", str(broken / "out.json")] if verb == "extend" else []
    model = str(broken / "models" / "left-upper.json")
    words = refused(capsys, verb, model, str(record), "--effect", effect, *out)
    assert effect in words and len(words.splitlines()) == 1
