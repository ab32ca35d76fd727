"""The budget is what the filter used, and its terms are those of the aircraft's file."""

import json

import pytest

from thrustd.__main__ import main
from thrustd.installation.shipped import shipped


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("budget") / "flight.mcap"
    assert main(["simulate", "--minutes", "3", "--seed", "7", "-o", str(path)]) == 0
    return path


def budget(capsys, *words):
    assert main(["budget", *words, "--json"]) == 0
    return json.loads(capsys.readouterr().out)["engines"]


def test_the_sum_is_what_the_filter_used_and_one_term_changes_the_band(log, tmp_path, capsys):
    plain = budget(capsys, str(log), "--at", "130", "140")
    for engine in plain:
        assert engine["mounts_n"] == pytest.approx(engine["filter_n"], rel=0.03)
        rows = [row for row in engine["rows"] if row["source"] == "mounts" and row["kind"] == "systematic"]
        assert sum(row["std_n"] ** 2 for row in rows) ** 0.5 == pytest.approx(engine["mounts_n"])
    folder = shipped("deploy/hil.toml", "config").parent
    text = (folder / "hil.toml").read_text().replace("../models", str(folder.parent / "models"))
    for name in ("canaerospace.dbc", "citation-ii.toml"):
        text = text.replace(f'"{name}"', f'"{folder / name}"')
    (tmp_path / "wide.toml").write_text(text + "\n[fusion]\nmount_stiffness_std = 0.02\n")
    wide = budget(capsys, str(log), "--at", "130", "140", "--config", str(tmp_path / "wide.toml"))
    for before, after in zip(plain, wide, strict=True):
        assert after["filter_n"] > 2 * before["filter_n"]
        assert after["fused_n"] != before["fused_n"]


def test_a_window_where_nothing_was_estimated_is_one_line(log, capsys):
    for at in (("900", "950"), ("20", "10")):
        assert main(["budget", str(log), "--at", *at]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert line.startswith("thrustd: --at")
