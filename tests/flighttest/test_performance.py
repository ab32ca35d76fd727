"""The drag polar: what was put in comes out, inside its interval, whatever the source of the error."""

import json
from dataclasses import replace

import msgspec
import numpy as np
import pytest

from benchmarks.level_points import Polar, level_points
from tests.cli.test_bad_input import refused
from tests.conftest import PH_LAB, ROOT
from thrustd.__main__ import main
from thrustd.core.aircraft import Wing, read_aircraft
from thrustd.core.errors import RecordingError
from thrustd.core.steady import SteadyLimits
from thrustd.flighttest.flight import Flight, read_flight
from thrustd.flighttest.flown import flown
from thrustd.flighttest.mass_sheet import MassSheet
from thrustd.flighttest.performance import performance
from thrustd.flighttest.performance_report import answer
from thrustd.flighttest.polar import Polar as FlownPolar
from thrustd.flighttest.polar import PolarPoints, fit_polar
from thrustd.flighttest.steps import gain_of, throttle_steps
from thrustd.records.files import write_recording
from thrustd.twin.airframe import draw_airframe

AIRCRAFT = ROOT / "deploy" / "citation-ii.toml"
ENGINES = ("left", "right")
TRUE = Polar()
SHEET = "empty_kg = 4157.2\npayload_kg = 695.0\nfuel_kg = 1837.0\nstd_kg = 30.0\n"


@pytest.fixture(scope="module")
def wing():
    found = read_aircraft(AIRCRAFT.read_text(), "citation-ii.toml").wing
    assert isinstance(found, Wing)
    return found


@pytest.fixture(scope="module")
def profile():
    return level_points(3, draw_airframe(3).healths, TRUE)


def estimated(profile, bias_n=(0.0, 0.0), std_n=40.0, accel_zero_g=0.0):
    """The profile as a flight with estimates that are off by a constant per engine."""
    columns = {"accel_x_g": profile["accel_x_g"] + accel_zero_g}
    n = len(profile)
    for engine, off in zip(ENGINES, bias_n, strict=True):
        thrust_n = profile[f"thrust_N_{engine}"]
        columns |= {f"thrust_N_{engine}": thrust_n + off, f"thrust_std_N_{engine}": np.full(n, std_n)}
        columns |= {f"brochure_N_{engine}": 1.03 * thrust_n, f"brochure_std_N_{engine}": np.full(n, 120.0)}
    return Flight(profile.with_channels(**columns), ENGINES, True)


def polars(flight, wing):
    found = performance([flown(flight, wing, None, SteadyLimits())], wing, True)
    return {polar.of: polar for polar in found.polars}


def test_the_true_polar_is_in_a_narrow_interval(profile, wing):
    found = polars(estimated(profile, (60.0, -20.0)), wing)
    for of in ("fused thrust, accelerometer", "fused thrust, energy height"):
        polar = found[of]
        assert polar.points == 7
        assert polar.zero_lift_drag.value == pytest.approx(TRUE.zero_lift, rel=0.03)
        assert polar.zero_lift_drag.low <= TRUE.zero_lift <= polar.zero_lift_drag.high
        assert polar.oswald.low <= 1 / (np.pi * wing.aspect_ratio * TRUE.factor) <= polar.oswald.high
        assert polar.zero_lift_drag.high - polar.zero_lift_drag.low < 0.08 * TRUE.zero_lift
    brochure = found["brochure thrust, accelerometer"].zero_lift_drag
    assert brochure.value > 1.015 * TRUE.zero_lift and brochure.low <= TRUE.zero_lift <= brochure.high


def test_a_wider_thrust_band_is_a_wider_interval_and_the_budget_says_so(profile, wing):
    narrow, wide = (
        polars(estimated(profile, std_n=std_n), wing)["fused thrust, accelerometer"] for std_n in (20.0, 80.0)
    )
    assert wide.budget_zero_lift_drag["thrust"] == pytest.approx(4 * narrow.budget_zero_lift_drag["thrust"], rel=0.1)
    assert wide.zero_lift_drag.systematic_u95 > 2.5 * narrow.zero_lift_drag.systematic_u95


def test_the_zero_of_the_accelerometer_is_found_against_air_data(profile, wing):
    point = flown(estimated(profile, accel_zero_g=0.004), wing, None, SteadyLimits())
    assert abs(point.zero.mean_g - 0.004) < 2.5 * point.zero.std_g
    polar = polars(estimated(profile, accel_zero_g=0.004), wing)["fused thrust, accelerometer"]
    assert polar.zero_lift_drag.low <= TRUE.zero_lift <= polar.zero_lift_drag.high


def test_turns_are_left_out(profile, wing):
    flight = estimated(profile)
    first = flown(flight, wing, None, SteadyLimits()).windows[1]
    turning = (profile.time_s >= first.start_s) & (profile.time_s < first.end_s)
    accel_z = flight.record["accel_z_g"].copy()
    accel_z[turning] += 0.2
    point = flown(flight._replace(record=flight.record.with_channels(accel_z_g=accel_z)), wing, None, SteadyLimits())
    assert point.why.tolist().count(1) == 1 and point.used.sum() >= 6


def test_throttle_steps_tell_a_gain_of_the_thrust_and_no_zero(profile, wing):
    for gain, bias_n in ((1.0, (80.0, 80.0)), (1.05, (0.0, 0.0))):
        flight = estimated(profile, bias_n, accel_zero_g=0.002)
        columns = {f"thrust_N_{engine}": gain * flight.record[f"thrust_N_{engine}"] for engine in ENGINES}
        one = flown(flight._replace(record=flight.record.with_channels(**columns)), wing, None, SteadyLimits())
        steps = throttle_steps(one, FlownPolar(TRUE.zero_lift, TRUE.factor, np.eye(2), 0.0, 7))
        assert len(steps) >= 6
        for way in ("accel", "air"):
            found = gain_of(steps, way)
            assert abs(found.error - (gain - 1.0)) < max(found.u95, 0.01)


def test_total_least_squares_on_a_line_with_errors_on_both_sides():
    rng = np.random.default_rng(5)
    hits, slopes = 0, []
    for _ in range(40):
        true = np.linspace(0.05, 0.9, 12)
        lift2 = true + 0.04 * rng.standard_normal(12)
        drag = 0.02 + 0.05 * true + 0.0005 * rng.standard_normal(12)
        polar = fit_polar(PolarPoints(lift2, np.full(12, 0.04), drag, np.full(12, 0.0005), np.sqrt(true)))
        slopes.append(polar.factor)
        hits += abs(polar.zero_lift - 0.02) < 2.23 * np.sqrt(polar.covariance[0, 0])
    assert np.mean(slopes) == pytest.approx(0.05, rel=0.02)  # ordinary least squares would be 2 % low at 0.04
    assert hits >= 34


@pytest.mark.parametrize(("n", "top"), [(3, 0.9), (8, 0.06)])
def test_points_that_make_no_polar(n, top):
    lift2 = np.linspace(0.05, top, n)
    with pytest.raises(RecordingError, match="no drag polar"):
        fit_polar(PolarPoints(lift2, np.full(n, 0.01), 0.02 + 0.05 * lift2, np.full(n, 1e-4), np.sqrt(lift2)))


def test_the_verb_and_its_files(profile, tmp_path, capsys):
    log = tmp_path / "flight.parquet"
    write_recording(replace(profile, name="flight"), log)  # thrust_N is the truth: the verb asks the deck
    page, table = tmp_path / "polar.html", tmp_path / "points.csv"
    plain = "flight", "name", "mach", "c_l", "c_d", "c_d_u95", "left_out", "why"
    assert main(["performance", str(log), "--report", str(page), "-o", str(table), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["polars"][0]["of"] == "brochure thrust, accelerometer"
    interval = said["polars"][0]["zero_lift_drag"]
    assert interval["low"] <= TRUE.zero_lift <= interval["high"]
    assert (
        f"{interval['value']:.4f}" in page.read_text() and table.read_text().count("\n") == 9
    )  # seven levels, the ground, the heads
    units = "_s", "_m", "_n", "_pct"
    assert not [
        name for name in said["points"][0] if name not in plain and not name.removesuffix("_u95").endswith(units)
    ]
    course = said["known"][0]
    assert (course["zero_lift_drag"], course["zero_lift_drag_inside"], course["oswald_inside"]) == (0.04, False, True)
    assert said["excess_rms_n"] > 0 and {way: gain["steps"] for way, gain in said["gains"].items()}["air"] > 5
    assert main(["performance", str(log)]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "known: C_D0 0.04, outside 0.0" in printed and "e 0.8, inside" in printed
    gain = said["gains"]["accel"]
    assert f"{100 * gain['error']:+.1f} +- {100 * gain['u95']:.1f} % (95 %)" in printed
    assert f"{said['excess_rms_n']:.0f} N rms" in printed and "0.00000" not in printed


def test_what_cannot_be_used_is_one_line(profile, tmp_path, capsys):
    log, sheet = tmp_path / "flight.parquet", tmp_path / "mass.toml"
    bare = profile.select([name for name in profile.channels if name != "mass_kg"])
    write_recording(bare, log)
    assert "no mass" in refused(capsys, "performance", log)
    sheet.write_text("empty_kg = 4157\n")
    assert "payload_kg" in refused(capsys, "performance", log, "--mass-sheet", sheet)
    sheet.write_text(SHEET.replace("1837", "20"))
    assert "burns" in refused(capsys, "performance", log, "--mass-sheet", sheet)
    sheet.write_text(SHEET.replace("4157.2", "9165").replace("695", "1532").replace("1837", "4050"))
    assert "weighs 147" in (line := refused(capsys, "performance", log, "--mass-sheet", sheet)) and "kg?" in line
    sheet.write_text(SHEET)
    assert "the same recording as" in refused(capsys, "performance", log, log, "--mass-sheet", sheet)
    assert main(["performance", str(log), "--mass-sheet", str(sheet), "--json"]) == 0
    capsys.readouterr()
    write_recording(bare.select([name for name in bare.channels if name != "pitch_deg"]), log)
    assert "neither pitch_deg nor aoa_deg" in refused(capsys, "performance", log, "--mass-sheet", sheet)


def test_half_the_thrust_makes_no_polar(profile, tmp_path, capsys):
    log = tmp_path / "left.parquet"
    write_recording(profile.select([name for name in profile.channels if "right" not in name]), log)
    assert "n1_pct_left alone; expected all 2 engines" in refused(capsys, "performance", log)


def test_a_mass_that_nobody_knows_and_marks_over_one_another(profile, tmp_path, capsys):
    log, sheet, marks = tmp_path / "flight.parquet", tmp_path / "mass.toml", tmp_path / "marks.csv"
    write_recording(profile, log)
    sheet.write_text(SHEET.replace("std_kg = 30", "std_kg = 3000"))
    assert "std_kg = 3000; expected below 809" in refused(capsys, "performance", log, "--mass-sheet", sheet)
    marks.write_text("start_s,end_s,name\n900,960,one\n930,990,two\n1000,1060,three\n")
    assert "points one and two share 30 s; expected windows apart" in refused(
        capsys, "performance", log, "--marks", marks
    )
    assert main(["points", str(log), "--marks", str(marks)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "points one and two share 30 s: their means are not independent" in said and "two and three" not in said


@pytest.mark.skipif(not PH_LAB.exists(), reason="no PH-LAB recordings here")
def test_recorded_flights_agree_with_one_another(wing):
    names = ("openap_phlab_20170320_08", "openap_phlab_20170320_12", "openap_phlab_undated")
    found = []
    for name in names:
        one = flown(read_flight(PH_LAB / f"{name}.npz"), wing, None, SteadyLimits())
        found.append(performance([one], wing, False).polars[0])
    values = [polar.zero_lift_drag.value for polar in found]
    assert max(values) - min(values) < 0.0025  # students' flight tests of the aircraft: 0.020 to 0.023
    theirs = 0.0209
    assert all(polar.zero_lift_drag.low < theirs < polar.zero_lift_drag.high for polar in found)
    assert all(polar.oswald.low < 0.80 < polar.oswald.high for polar in found)


@pytest.mark.skipif(not PH_LAB.exists(), reason="no PH-LAB recordings here")
def test_marks_and_windows_found_tell_the_same_polar(wing):
    flight, sheet = read_flight(PH_LAB / "ftis_20180312_ref.npz"), MassSheet(4157.0, 695.0, 1837.0, 30.0)
    marks = None, "measurement_running"
    found, marked = (performance([flown(flight, wing, sheet, SteadyLimits(), mark)], wing, False) for mark in marks)
    for one, other in zip(found.polars, marked.polars, strict=True):
        assert abs(one.oswald.value - other.oswald.value) < min(one.oswald.random_u95, other.oswald.random_u95) / 2
    said = {point.name: point for point in marked.points}
    assert said["8"].counts_pct < 5 and said["8"].why == "air +6.8 mg"  # the highest C_L, kept
    assert said["1"].counts_pct < 5 and said["1"].why.startswith("moves")  # not steady
    assert max(point.counts_pct for point in marked.points) == 100.0 and not any(p.left_out for p in marked.points)


def test_one_point_with_wrong_air_data_counts_little_and_changes_little(profile, wing):
    flight = estimated(profile)
    window = flown(flight, wing, None, SteadyLimits()).windows[-1]
    accel_x = flight.record["accel_x_g"].copy()
    accel_x[(profile.time_s >= window.start_s) & (profile.time_s < window.end_s)] += 0.02
    found = performance(
        [flown(flight._replace(record=flight.record.with_channels(accel_x_g=accel_x)), wing, None, SteadyLimits())],
        wing, True,
    )  # fmt: skip
    assert found.points[-1].counts_pct < 1 and found.points[-1].why.startswith("air -")
    drag = found.polars[0].zero_lift_drag
    assert drag.low <= TRUE.zero_lift <= drag.high and drag.value == pytest.approx(TRUE.zero_lift, rel=0.03)


def test_an_efficiency_that_no_wing_has_is_remarked(profile, wing):
    flight = estimated(profile)
    light = flight.record.with_channels(mass_kg=0.75 * flight.record["mass_kg"])
    heavy = flight.record.with_channels(mass_kg=1.4 * flight.record["mass_kg"])
    anything = msgspec.structs.replace(wing, mass_kg=(1.0, 1e6))
    for record, remarked in ((light, False), (heavy, True)):
        one = flown(flight._replace(record=record), anything, None, SteadyLimits())
        assert any("above 1" in note for note in performance([one], anything, True).notes) == remarked
    with pytest.raises(RecordingError, match="is it in kg"):
        flown(flight._replace(record=heavy), wing, None, SteadyLimits())


def test_a_marked_window_without_air_data_for_a_while_says_so(profile, wing):
    flight = estimated(profile)
    window = flown(flight, wing, None, SteadyLimits()).windows[3]
    missing = (profile.time_s > window.start_s + 20) & (profile.time_s < window.start_s + 40)
    marked = (profile.time_s > window.start_s) & (profile.time_s < window.end_s)
    for gone, why in ((missing, ""), (marked, "values missing"), (marked | (profile.time_s < 30), "values missing")):
        columns = {"mach": np.where(gone, np.nan, profile["mach"]), "mark": np.where(marked, 1.0, 0.0)}
        for number, other in enumerate(flown(flight, wing, None, SteadyLimits()).windows, 2):
            inside = (profile.time_s > other.start_s + 5) & (profile.time_s < other.end_s - 5) & ~marked
            columns["mark"] = np.where(inside, float(number), columns["mark"])
        record = flight.record.with_channels(**columns)
        one = flown(flight._replace(record=record), wing, None, SteadyLimits(), "mark")
        found = performance([one], wing, True)
        (point,) = (point for point in found.points if point.name == "1")
        assert point.missing_s >= 19 and point.left_out == why
        assert any("point 1: values missing in" in line for line in answer(found).lines)
        assert found.polars[0].zero_lift_drag.value == pytest.approx(TRUE.zero_lift, rel=0.03)


def test_a_step_outside_its_interval_is_marked(profile, wing):
    flight = estimated(profile)
    one = flown(flight, wing, None, SteadyLimits())
    true = FlownPolar(TRUE.zero_lift, TRUE.factor, np.eye(2), 0.0, 7)
    step = throttle_steps(one, true)[0]
    later = flight.record.time_s > step.start_s
    off = {f"thrust_N_{engine}": flight.record[f"thrust_N_{engine}"] + 800.0 * later for engine in ENGINES}
    wrong = flight._replace(record=flight.record.with_channels(**off))
    assert throttle_steps(flown(wrong, wing, None, SteadyLimits()), true)[0].outside == ("accel", "air")
