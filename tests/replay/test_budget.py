"""The budget is what the filter used, and its terms are those of the aircraft's file."""

import json
from math import hypot

import numpy as np
import pytest
from matplotlib.figure import Figure

from thrustd.__main__ import main
from thrustd.core.calibration import Calibration, MountCalibration, Zero, write_calibration
from thrustd.fusion.settings import FusionSettings
from thrustd.installation.installation import read_installation
from thrustd.installation.shipped import shipped
from thrustd.replay.budget import CHANGED, INSTALLED, TERMS, WINDMILLS, Band, Told, budget_of
from thrustd.replay.budget_picture import draw

FUEL = TERMS["fuel_n"]


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("budget") / "flight.mcap"
    assert main(["simulate", "--minutes", "3", "--seed", "7", "-o", str(path)]) == 0
    return path


def budget(capsys, *words):
    assert main(["budget", *words, "--json"]) == 0
    return json.loads(capsys.readouterr().out)["engines"]


def installed(engine):
    return {row["term"].removeprefix(INSTALLED): row["std_n"] for row in engine["rows"] if INSTALLED in row["term"]}


def test_a_window_behind_the_end_is_told_how_long_the_flight_is(log, capsys):
    assert main(["budget", str(log), "--at", "500", "600"]) == 2
    assert "nothing was estimated there, only until 180 s" in capsys.readouterr().err
    assert main(["budget", str(log), "--at", "160", "220"]) == 2  # it would be called the mean over a minute
    assert "not all of it was estimated, only until 180 s" in capsys.readouterr().err
    assert main(["budget", str(log), "--at", "160", "160.5"]) == 2
    assert "--at 160 160.5: expected T0 not below 0 and T1 at least 2 s behind it" in capsys.readouterr().err


def test_what_is_fused_has_a_line_of_its_own(log, capsys):
    """It stood behind the brochure's sum, as if it were a part of that."""
    engine = budget(capsys, str(log), "--at", "130", "140")[0]
    assert main(["budget", str(log), "--at", "130", "140"]) == 0
    lines = capsys.readouterr().out.splitlines()
    fused = next(line for line in lines if line.startswith("fused: "))
    assert fused == f"fused: one sigma {engine['fused_n']:.1f} N, 95 % band +- {1.96 * engine['fused_n']:.0f} N"


def test_the_sum_is_what_the_filter_used_and_one_term_changes_the_band(log, tmp_path, capsys):
    plain = budget(capsys, str(log), "--at", "130", "140")
    for engine in plain:
        assert engine["mounts_n"] == pytest.approx(engine["filter_n"], rel=1e-6)
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
    aircraft = (folder / "citation-ii.toml").read_text()
    changes = (
        ("zero_n = 179.6", "zero_n = 18.0"),
        ("temperature_n = 88.0", "temperature_n = 8.8"),
        ("scale = 0.03", "scale = 0.003"),
        ("drag_m2 = 0.04", "drag_m2 = 0.004"),
    )
    for old, new in changes:
        aircraft = aircraft.replace(old, new)
    (tmp_path / "known.toml").write_text(aircraft)
    (tmp_path / "hil.toml").write_text(text.replace(str(folder / "citation-ii.toml"), "known.toml"))
    known = budget(capsys, str(log), "--at", "130", "140", "--config", str(tmp_path / "hil.toml"))
    for before, after in zip(plain, known, strict=True):
        was, now = (installed(engine) for engine in (before, after))
        assert (
            set(was) - {CHANGED} == {"zero", "temperature", "scale", "drag", "rest", "mass"} and min(was.values()) > 0.0
        )
        # what is left is a third of what the brochure may be wrong by: it alone would see both mounts fail
        assert hypot(*now.values()) < 0.7 * hypot(*was.values()) and after["fused_n"] < before["fused_n"]
        assert after["mounts_n"] == pytest.approx(before["mounts_n"])  # of the bench
    vague = (folder / "citation-ii.toml").read_text().replace("engine_mass_std_kg = 4.0", "engine_mass_std_kg = 60.0")
    (tmp_path / "known.toml").write_text(vague)
    heavy = budget(capsys, str(log), "--at", "130", "140", "--config", str(tmp_path / "hil.toml"))
    for before, after in zip(plain, heavy, strict=True):
        was, now = (installed(engine) for engine in (before, after))
        assert now["mass"] == pytest.approx(15.0 * was["mass"], rel=0.01) and was["mass"] > 5.0  # 0.2 g of climb
        assert after["fused_n"] > before["fused_n"] + 10.0
        assert after["thrust_n"] == pytest.approx(before["thrust_n"], abs=1.0)
    (tmp_path / "known.toml").write_text(
        (folder / "citation-ii.toml").read_text().replace("density = 0.012", "density = 0.05")
    )
    other = budget(capsys, str(log), "--at", "130", "140", "--config", str(tmp_path / "hil.toml"))
    for before, after in zip(plain, other, strict=True):
        assert after["brochure_n"] > 1.2 * before["brochure_n"] and after["fused_n"] > before["fused_n"]
        was, now = ({row["term"]: row["std_n"] for row in engine["rows"]} for engine in (before, after))
        assert now[FUEL] == pytest.approx(was[FUEL] * hypot(0.05, 0.003) / hypot(0.012, 0.003), rel=0.01)
        assert now["deck's shape and fit"] == pytest.approx(was["deck's shape and fit"], rel=0.1)


def test_what_a_tethered_run_leaves_of_zeros_and_scales_is_a_term_once(log, tmp_path, capsys):
    """It is the mounts'; the same sigmas stood among the installation's as well."""
    config = shipped("deploy/hil.toml", "config")
    mounts = [mount.name for mount in read_installation(config).config.mount]
    told = MountCalibration(zeros=(Zero(on="2026-01-01", mm=0.0, std_mm=0.002),), gain_std=0.004)
    known = Calibration(on="2026-01-01", tethered="2026-01-01", mount=dict.fromkeys(mounts, told))
    (tmp_path / "calibration.toml").write_text(write_calibration(known))
    text = config.read_text().replace("../models", str(config.parents[1] / "models"))
    for name in ("canaerospace.dbc", "citation-ii.toml"):
        text = text.replace(f'"{name}"', f'"{config.parent / name}"')
    (tmp_path / "hil.toml").write_text(f'calibration = "calibration.toml"\n{text}')
    for engine in budget(capsys, str(log), "--at", "130", "140", "--config", str(tmp_path / "hil.toml")):
        rows = {row["term"]: row["std_n"] for row in engine["rows"] if row["source"] == "mounts"}
        assert rows["zero"] > 10.0 and rows["stiffness"] > 5.0
        assert engine["mounts_n"] == pytest.approx(engine["filter_n"], rel=1e-6)
        terms = installed(engine)
        assert terms["zero"] == terms["scale"] == 0.0 and min(terms["drag"], terms["temperature"], terms["rest"]) > 0.0


def test_with_one_mount_lost_its_share_is_a_term_and_the_aircrafts_file_says_how_large(tmp_path, capsys):
    """The engine's thrust is that of the mount that is left over its part; the log's right upper LVDT goes dead."""
    deaf = shipped("replay_logs/sensor-fails.mcap", "log")
    folder = shipped("deploy/hil.toml", "config").parent
    text = (folder / "hil.toml").read_text().replace("../models", str(folder.parent / "models"))
    aircraft = (folder / "citation-ii.toml").read_text()
    text = text.replace('"canaerospace.dbc"', f'"{folder / "canaerospace.dbc"}"').replace(
        "citation-ii.toml", "own.toml"
    )
    (tmp_path / "hil.toml").write_text(text)
    shares = {}
    for share in (0.006, 0.03):
        (tmp_path / "own.toml").write_text(aircraft.replace("share = 0.006", f"share = {share}"))
        both, one = budget(capsys, str(deaf), "--at", "200", "210", "--config", str(tmp_path / "hil.toml"))
        rows = {row["term"]: row["std_n"] for row in one["rows"] if row["source"] == "mounts"}
        assert one["mounts_n"] == pytest.approx(one["filter_n"], rel=1e-6)
        assert next(row["std_n"] for row in both["rows"] if row["term"] == "share") == 0.0
        shares[share] = rows["share"]
    assert shares[0.006] > 10.0 and shares[0.03] == pytest.approx(5 * shares[0.006], rel=0.05)


@pytest.mark.parametrize(("lost", "kept"), [("mounts", "brochure"), ("brochure", "mounts")])
def test_a_source_that_was_not_used_has_no_terms(lost, kept):
    here = np.ones(5)
    stds = {"mounts": 22.0 * here, "brochure": 250.0 * here, lost: np.nan * here}
    terms = np.full((5, len(TERMS)), np.nan if lost == "mounts" else 8.0)
    known = 4000.0 * here, 300.0 * here, stds["mounts"], stds["brochure"], *[0.0 * here] * 4, terms
    band = Band(FusionSettings(), read_installation(shipped("deploy/hil.toml", "config")).aircraft())
    found = budget_of("left", Told(*known), band)
    assert found.of(lost) == [] and found.sums[lost] == 0.0
    assert {row.kind for row in found.of(kept)} == {"systematic", "random"}
    assert draw(Figure().subplots(), found) is None


def test_what_is_more_than_all_terms_of_the_installation_is_a_row_of_its_own():
    """They were all made larger: a drag that was measured to 35 N stood there with 76."""
    here, band = np.ones(5), Band(FusionSettings(), read_installation(shipped("deploy/hil.toml", "config")).aircraft())
    rows = {}
    for more_n in (100.0, 400.0):
        terms = np.zeros((5, len(TERMS)))
        terms[:, list(TERMS).index("installation_n")] = more_n
        told = Told(4000.0 * here, 500.0 * here, 30.0 * here, 200.0 * here, *[0.0 * here] * 4, terms)
        found = budget_of("left", told, band)
        rows[more_n] = {row.term.removeprefix(INSTALLED): row.std_n for row in found.rows if INSTALLED in row.term}
        assert hypot(*rows[more_n].values()) == pytest.approx(more_n)
    assert CHANGED not in rows[100.0] and rows[400.0][CHANGED] > 200.0
    assert rows[400.0]["scale"] == pytest.approx(band.aircraft.installation.scale * 4000.0)


def test_an_engine_that_is_off_has_one_term_of_its_brochure_and_the_rest_is_added_up():
    """What nobody knows of it is no term: no warning of an empty mean."""
    here = np.ones(5)
    nothing = np.full((5, len(TERMS)), np.nan)
    told = Told(
        -200.0 * here, 130.0 * here, np.nan * here, 80.0 * here, here, 0.0 * here, 0.0 * here, 0.0 * here, nothing
    )
    told.terms_n[:, list(TERMS).index("installation_n")] = 100.0
    band = Band(FusionSettings(), read_installation(shipped("deploy/hil.toml", "config")).aircraft())
    found = budget_of("left", told, band)
    assert hypot(*(row.std_n for row in found.rows if INSTALLED in row.term)) == pytest.approx(100.0)
    assert found.of("mounts") == []
    assert [(row.term, row.std_n) for row in found.rows if row.source == "brochure"] == [(WINDMILLS, 80.0)]
    assert hypot(80.0, 100.0, found.rows[-1].std_n) == pytest.approx(found.fused_n) == 130.0
    assert found.thrust_n == -200.0 and found.filter_n == 0.0


def test_a_window_where_nothing_was_estimated_is_one_line(log, capsys):
    for at in (("900", "950"), ("20", "10"), ("20", "21")):
        assert main(["budget", str(log), "--at", *at]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert line.startswith("thrustd: --at")
