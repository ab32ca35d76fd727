"""The verbs find what comes with thrustd from any folder, in a checkout and installed; or say what to pass."""

import json
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import thrustd
from tests.brochure.fit.test_deck_fit import flight
from tests.conftest import ROOT
from thrustd.__main__ import main
from thrustd.installation.shipped import DECK, HIL, MODELS
from thrustd.sources.mcap_log import LogFile

CC = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """As a wheel lays it out: the package in one folder, its data files in another."""
    data = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["data-files"]
    for folder, patterns in data.items():
        (tmp_path / "prefix" / folder).mkdir(parents=True)
        for pattern in patterns:
            for path in ROOT.glob(pattern):
                shutil.copy(path, tmp_path / "prefix" / folder)
    monkeypatch.setattr(thrustd, "__file__", str(tmp_path / "site-packages" / "thrustd" / "__init__.py"))
    monkeypatch.setattr(sys, "prefix", str(tmp_path / "prefix"))
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    return tmp_path / "prefix" / "share" / "thrustd"


def test_a_flight_is_simulated_from_any_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["simulate", "--minutes", "0.1", "--config", HIL, "-o", "flight.mcap"]) == 0  # as pages print it
    files = LogFile(tmp_path / "flight.mcap").header.files
    assert files["config.toml"] == (ROOT / HIL).read_text()


def test_a_deck_is_fitted_from_any_folder_and_not_over_its_base(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    flights = [str(flight(tmp_path / f"flight{seed}.csv", seed)) for seed in (1, 2)]
    assert main(["brochure", "fit", *flights, "-o", "deck.json"]) == 0
    capsys.readouterr()
    assert main(["brochure", "fit", *flights, "-o", str(ROOT / DECK)]) == 2
    assert "is an input" in capsys.readouterr().err


def test_installed_it_finds_them_beside_the_interpreter(installed):
    assert main(["simulate", "--minutes", "0.1", "-o", "flight.mcap"]) == 0
    assert (installed / DECK).read_text() == (ROOT / DECK).read_text()


@pytest.mark.skipif(CC is None, reason="no C compiler here")
def test_installed_the_page_about_c_works_in_an_empty_folder(installed):
    """Every command of it, as it stands there."""
    page = (ROOT / "docs" / "c.md").read_text()
    compile_line, build_line = re.findall(r"^    ((?:thrustd compile|cc) .*)$", page, re.MULTILINE)
    assert main(compile_line.split()[1:]) == 0
    Path("fly.c").write_text(re.search(r"```c\n(.*?)```", page, re.DOTALL)[1])
    said = subprocess.run(
        build_line.replace("cc ", f"{CC} ", 1), shell=True, check=True, capture_output=True, text=True
    )
    assert f"{build_line}\n    {said.stdout}" in page


def test_installed_models_and_configurations_are_found_by_the_names_that_pages_print(installed, capsys):
    assert main(["check", "deploy/ph-lab.toml", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["ok"]
    for name in MODELS:
        assert main(["compile", name, "--rate", "100"]) == 0
    Path("models").mkdir()
    Path(MODELS[0]).write_text("{}")  # one's own comes first
    assert main(["compile", MODELS[0], "--rate", "100"]) == 2


@pytest.mark.parametrize(
    ("call", "option", "name"),
    [
        ("simulate --minutes 1 -o flight.mcap", "--config", HIL),
        ("compare MODEL flight.csv --against brochure", "--deck", DECK),
        ("brochure fit flight.csv other.csv -o deck.json", "--base", DECK),
    ],
)
def test_where_they_are_missing_the_line_says_what_to_pass(installed, capsys, call, option, name):
    shutil.rmtree(installed)
    flight(installed.parents[2] / "elsewhere" / "flight.csv", 1)
    assert main(call.replace("MODEL", str(ROOT / "models" / "left-upper.json")).split()) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"thrustd: {option}: expected a file; the shipped {name} is neither in ")
