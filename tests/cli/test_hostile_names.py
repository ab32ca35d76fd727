"""What a file is called, or calls its parts, steers no terminal and ends no verb."""

import json
import os

import pytest

from tests.cli.test_bad_input import refused
from tests.conftest import ROOT
from thrustd.__main__ import main
from thrustd.cli.verb import note

HOSTILE = "\x1b]0;owned\x07\x1b[31mx"
NAMES = [f"{HOSTILE}.csv", "a\nthrustd: ready.csv", "\u202etxt.csv", os.fsdecode(b"\xff.csv")]


@pytest.mark.parametrize("verb", ["info", "convert -o out.parquet", "points", "identify -o out.json", "replay"])
@pytest.mark.parametrize("name", NAMES, ids=["escape", "newline", "turned", "no UTF-8"])
def test_a_file_of_such_a_name_is_asked_to_be_renamed(tmp_path, monkeypatch, capsys, verb, name):
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).write_text("time_s,force_N\n0,1\n1,2\n2,3\n")
    line = refused(capsys, *verb.split(), name)
    assert "holds control characters or is not UTF-8" in line
    assert line.isprintable()
    assert os.listdir(tmp_path) == [name]


@pytest.mark.parametrize("verb", ["info", "replay --json"])
@pytest.mark.parametrize("name", [f"{HOSTILE}.mcap", os.fsdecode(b"\xff.mcap")], ids=["escape", "no UTF-8"])
def test_nor_does_a_log_in_a_folder_have_such_a_name(tmp_path, capsys, verb, name):
    (tmp_path / name).write_bytes((ROOT / "replay_logs" / "throttle-steps.mcap").read_bytes())
    line = refused(capsys, *verb.split(), tmp_path)
    assert "its name holds control characters or is not UTF-8" in line
    assert line.isprintable()


def test_a_model_says_what_it_likes_of_itself_in_plain_text(tmp_path, capsys):
    spec = json.loads((ROOT / "models" / "left-upper.json").read_text())
    spec["name"] = HOSTILE
    spec["provenance"] |= {HOSTILE: f"{HOSTILE}\nthrustd: ready"}
    (tmp_path / "a.json").write_text(json.dumps(spec))
    assert main(["info", str(tmp_path / "a.json")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert r"name: \x1b]0;owned\x07\x1b[31mx" in lines
    assert all(line.isprintable() for line in lines)
    assert not any(line.startswith("thrustd") for line in lines)


def test_a_note_is_plain_text(capsys):
    note(HOSTILE)
    assert capsys.readouterr().err == "\\x1b]0;owned\\x07\\x1b[31mx\n"
