"""Test points: found where the flight is steady, their means right and their uncertainty honest."""

import json

import numpy as np
import pyarrow.parquet as pq
import pytest

from tests.cli.test_bad_input import refused
from tests.conftest import PH_LAB, ROOT
from tests.flighttest.scene import BIAS_STD_N, CHANGE_S, ENGINES, HOLD_S, correlated, made_flight
from thrustd.__main__ import main
from thrustd.core.measures import SIGMAS_95
from thrustd.flighttest.flight import read_flight
from thrustd.flighttest.points import find_points
from thrustd.flighttest.uncertainty import mean_of
from thrustd.flighttest.windows import Window
from thrustd.records.files import write_recording
from thrustd.records.recording import make_recording

FLIGHT = PH_LAB / "ftis_20180312_ref.npz"
SHEET = PH_LAB / "datasheet_20180312_ref.csv"
POUND_PER_HOUR_KG_S = 0.45359237 / 3600


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "made.csv"
    write_recording(made_flight(), path)
    return path


@pytest.mark.parametrize(("tau", "n"), [(0.1, 60), (2.0, 60), (5.0, 120), (15.0, 600)])
def test_the_random_part_holds_the_mean_of_correlated_noise(tau, n):
    rng = np.random.default_rng(1)
    means = [mean_of(correlated(rng, n, tau)) for _ in range(400)]
    assert 0.91 <= np.mean([abs(mean.mean) <= mean.random_u95 for mean in means]) <= 0.985


def test_the_systematic_part_does_not_average_out():
    rng = np.random.default_rng(2)
    short, long = (mean_of(100 + rng.standard_normal(n), 3.0) for n in (50, 5000))
    assert short.systematic_u95 == long.systematic_u95 == SIGMAS_95 * 3.0
    assert long.random_u95 < 0.2 * short.random_u95
    assert long.u95 == pytest.approx(SIGMAS_95 * 3.0, rel=0.01)


def test_every_level_is_a_point_and_no_change_is_in_one(log):
    found = find_points(read_flight(log), fuel_std=0.02)
    assert found.thrust == "fused" and len(found.points) == 3
    for place, (point, mach) in enumerate(zip(found.points, (0.25, 0.35, 0.45), strict=True)):
        begin_s = place * (HOLD_S + CHANGE_S)
        assert point.steady and begin_s - 2 <= point.start_s < point.end_s <= begin_s + HOLD_S + 2
        assert point.end_s - point.start_s > HOLD_S - 3
        assert point.values["mach"].mean == pytest.approx(mach, abs=1e-4)
        for number, engine in enumerate(ENGINES):
            thrust = point.values[f"thrust_N_{engine}"]
            assert abs(thrust.mean - (1000 + 5000 * mach + 100 * number)) < 2 * thrust.random_u95 + 1
            assert thrust.systematic_u95 == pytest.approx(SIGMAS_95 * BIAS_STD_N)
            fuel = point.values[f"fuel_flow_kg_s_{engine}"]
            assert fuel.systematic_u95 == pytest.approx(SIGMAS_95 * 0.02 * fuel.mean)
            tsfc = point.values[f"tsfc_g_kN_s_{engine}"]
            assert tsfc.mean == pytest.approx(1e6 * (0.02 + 2e-5 * thrust.mean) / thrust.mean, rel=1e-3)
            whole = np.hypot(BIAS_STD_N / thrust.mean, 0.02)
            assert tsfc.systematic_u95 == pytest.approx(SIGMAS_95 * whole * tsfc.mean, rel=1e-3)


def test_marks_of_a_file_and_of_a_channel(log, tmp_path, capsys):
    marks = tmp_path / "marks.csv"
    marks.write_text("start_s,end_s,name\n5,50,level\n40,90,moving\n")
    assert main(["points", str(log), "--marks", str(marks), "--json"]) == 0
    first, second = json.loads(capsys.readouterr().out)["points"]
    assert (first["name"], first["moved"]) == ("level", []) and "mach" in second["moved"]
    record = made_flight()
    number = np.where((record.time_s > 80) & (record.time_s < 120), 4.0, 0.0)
    write_recording(record.with_channels(mark=number), log)
    assert main(["points", str(log), "--json"]) == 0  # the log marks its points: no search
    (point,) = json.loads(capsys.readouterr().out)["points"]
    assert point["name"] == "4" and 79 <= point["start_s"] <= 82 and 119 <= point["end_s"] <= 122
    assert main(["points", str(log), "--auto", "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["points"]) == 3


def test_table_page_and_json_say_the_same(log, tmp_path, capsys):
    table, page = tmp_path / "points.parquet", tmp_path / "points.html"
    assert main(["points", str(log), "-o", str(table), "--report", str(page), "--json"]) == 0
    points = json.loads(capsys.readouterr().out)["points"]
    rows = pq.read_table(table).to_pylist()
    said = [point["values"]["thrust_N_left"]["mean"] for point in points]
    assert [row["thrust_N_left"] for row in rows] == said
    assert all(f">{value:.0f}<" in page.read_text() for value in said)
    assert main(["points", str(log)]) == 0
    assert "altitude_m 35" in capsys.readouterr().out.replace("\n", " ")  # the limits are printed


def test_seconds_without_a_value_are_in_no_window_and_told_of_a_mark(log, tmp_path, capsys):
    record = made_flight()
    missing = (record.time_s > 20) & (record.time_s < 40)
    write_recording(record.with_channels(mach=np.where(missing, np.nan, record["mach"])), log)
    found = find_points(read_flight(log))
    assert found.missing_s["mach"] in (19, 20) and len(found.points) == 2  # 20 s are left on either side
    marks = tmp_path / "marks.csv"
    marks.write_text("start_s,end_s\n5,50\n22,38\n80,120\n")
    assert main(["points", str(log), "--marks", str(marks), "--json"]) == 0
    half, none, whole = json.loads(capsys.readouterr().out)["points"]
    assert half["missing_s"]["mach"] in (19, 20) and half["values"]["mach"]["mean"] == pytest.approx(0.25, abs=1e-3)
    assert none["values"]["mach"]["mean"] is None and not whole["missing_s"]
    assert main(["points", str(log), "--marks", str(marks)]) == 0
    said = capsys.readouterr()
    assert "* point 1: no mach in " in said.out and "nan" not in said.out and "Warning" not in said.err
    gone = record.rows(slice(0, 80)), record.rows(slice(160, len(record)))
    columns = {name: np.concatenate([part[name] for part in gone]) for name in ("time_s", *record.channels)}
    write_recording(make_recording("made", columns), log)
    assert find_points(read_flight(log)).points[0].start_s > 70  # no window across rows not there


def test_a_meters_error_is_in_deck_thrust_and_fuel_flow_alike(tmp_path):
    path = tmp_path / "flight.csv"
    record = made_flight(estimates=False)
    found = {}
    for factor in (1.0, 1.01):
        flows = {f"fuel_flow_kg_s_{e}": factor * record[f"fuel_flow_kg_s_{e}"] for e in ENGINES}
        write_recording(record.with_channels(**flows), path)
        found[factor] = find_points(read_flight(path), fuel_std=0.016).points[1].values
    values = {name: found[1.0][f"{name}_left"] for name in ("thrust_N", "tsfc_g_kN_s")}
    thrust, tsfc = ((value.systematic_u95 / SIGMAS_95 / value.mean) for value in values.values())
    per_fuel = 100 * (found[1.01]["thrust_N_left"].mean / values["thrust_N"].mean - 1)
    moved = 100 * (found[1.01]["tsfc_g_kN_s_left"].mean / values["tsfc_g_kN_s"].mean - 1)
    assert moved == pytest.approx(1 - per_fuel, abs=0.05) and per_fuel > 1.2
    others = thrust**2 - (per_fuel * 0.016) ** 2  # engine and deck, not the meter
    assert tsfc == pytest.approx(np.sqrt(others + (moved * 0.016) ** 2), rel=0.02)


def test_what_cannot_be_used_is_one_line(log, tmp_path, capsys):
    said = refused(capsys, "points", log, "--limit", "least_s=500")
    assert "; expected 500 s (least_s) with N1 above 20 %" in said and "than mach 0.006, alti" in said
    said = refused(capsys, "points", log, "--limit", "n1_pct=1e-4")
    assert "no steady window, n1_pct_" in said and " s at most; expected" in said
    assert "--limit moch=1" in refused(capsys, "points", log, "--limit", "moch=1")
    marks = tmp_path / "marks.csv"
    marks.write_text("start_s,end_s\n50,5\n")
    assert "data row 1" in refused(capsys, "points", log, "--marks", marks)
    marks.write_text("start_s,end_s\n5000,5100\n")
    out = tmp_path / "points.csv"
    assert "no samples" in refused(capsys, "points", log, "--marks", marks, "-o", out)
    assert not out.exists()
    page = tmp_path / "page.pdf"
    for verb in ("points", "performance", "transients"):
        assert "ends in .html" in refused(capsys, verb, log, "--report", page) and not page.exists()
    long = refused(capsys, "points", log, "--marks", "n1_left")
    assert "n1_pct_left" in long and len(long) < 300
    assert ".csv or .parquet" in refused(capsys, "points", log, "-o", tmp_path / "points.txt")
    record = made_flight()
    write_recording(record.select([name for name in record.channels if name != "mach"]), log)
    assert "no air data" in refused(capsys, "points", log)
    write_recording(record.window(20.0, 20.9), log)
    assert all("no steady window: it is 0." in refused(capsys, verb, log) for verb in ("points", "performance"))


def test_a_mark_that_reaches_beyond_the_log_is_no_steady_point(log):
    end_s = read_flight(log).record.time_s[-1]
    (point,) = find_points(read_flight(log), windows=[Window(end_s - 20.0, end_s + 30.0, "late")]).points
    assert point.missing_s["samples"] == pytest.approx(30, abs=1) and not point.steady


def test_a_recording_without_air_data_is_told_so(tmp_path, capsys):
    path, seconds = tmp_path / "flight.npz", np.arange(100.0)
    np.savez(path, time=seconds, lh_engine_fan_N1=seconds, rh_engine_fan_N1=seconds)
    for verb in ("points", "performance", "transients"):
        assert "no air data: no values of mach; expected mach, " in refused(capsys, verb, path)


def sheet_fuel():
    """(left, right) kg/s of the level points as the crew wrote them."""
    rows = [line.split(",") for line in SHEET.read_text().splitlines() if line.startswith("clcd1,")]
    return np.array([[float(row[9]), float(row[10])] for row in rows]) * POUND_PER_HOUR_KG_S


@pytest.mark.skipif(not FLIGHT.exists(), reason="no PH-LAB recordings here")
def test_points_of_a_recorded_flight_agree_with_its_data_sheet():
    flight = read_flight(FLIGHT)
    marked = find_points(flight, marks="measurement_running").points
    found = find_points(flight).points
    sheet = sheet_fuel()
    level = [marked[place] for place in (1, 2, 3, 4, 6, 7)]  # the first two marks are a trial and its repetition
    for point, written in zip(level, sheet, strict=True):
        assert point.steady
        said = [point.values[f"fuel_flow_kg_s_{engine}"].mean for engine in ENGINES]
        assert said == pytest.approx(written, rel=0.01)
        same = [p for p in found if p.start_s <= point.start_s + 5 and p.end_s >= point.end_s - 5]
        assert len(same) == 1  # one found window holds the marked one
        for engine in ENGINES:
            name = f"thrust_N_{engine}"
            assert same[0].values[name].mean == pytest.approx(point.values[name].mean, rel=0.01)


def test_the_report_draws_the_terms_of_the_band_at_every_point(tmp_path, capsys):
    """A raw log and its estimates say the same, what `thrustd budget` says there."""
    raw, marks, page = ROOT / "replay_logs" / "throttle-steps.mcap", tmp_path / "marks.csv", tmp_path / "points.html"
    marks.write_text("start_s,end_s,name\n62,90,low\n140,170,high\n")
    estimates = tmp_path / "estimates.mcap"
    assert main(["replay", str(raw), "-o", str(estimates)]) == 0
    capsys.readouterr()
    found = []
    for log in (raw, estimates):
        assert main(["points", str(log), "--marks", str(marks), "--report", str(page), "--json"]) == 0
        found.append([point["budgets"] for point in json.loads(capsys.readouterr().out)["points"]])
    assert found[0] == found[1] and [len(each) for each in found[0]] == [2, 2]
    assert main(["budget", str(raw), "--at", "140", "170", "--json"]) == 0
    for drawn, printed in zip(found[0][1], json.loads(capsys.readouterr().out)["engines"], strict=True):
        assert drawn["thrust_n"] == pytest.approx(printed["thrust_n"], rel=0.01)
        assert [row["term"] for row in drawn["rows"]] == [row["term"] for row in printed["rows"]]
        *mine, rest = [row["std_n"] for row in drawn["rows"]]
        *theirs, other_rest = [row["std_n"] for row in printed["rows"]]
        assert mine == pytest.approx(theirs, rel=0.02, abs=0.1)
        # the rest is what is left of the band's square: 30 means of a second and 29 samples tell that to a thousandth
        assert abs(rest**2 - other_rest**2) < 1e-3 * printed["fused_n"] ** 2
    text = page.read_text()
    assert text.count("<img") == 2 and "Budget: what the band is made of" in text
    assert "left engine, largest term of the band of the mounts: stiffness (2 of 2 points)" in text


def test_only_engines_with_estimates_are_asked_where_the_bus_tells_of_another(tmp_path):
    """One engine has transducers; fan speeds of both are in its log."""
    made = made_flight()
    columns = {name: each for name, each in made.channels.items() if not name.startswith("estimate_") or "left" in name}
    path = tmp_path / "one.npz"
    np.savez(path, time_s=made.time_s, **columns)
    flight = read_flight(path)
    assert flight.engines == ("left",) and flight.fused
    assert find_points(flight).points[0].values["thrust_N_left"].mean == pytest.approx(2250.0, abs=20.0)


def test_estimates_without_terms_say_what_to_do(log, capsys):
    assert main(["points", str(log)]) == 0
    assert "terms of the band: not in this log" in capsys.readouterr().out.replace("\n", " ")
