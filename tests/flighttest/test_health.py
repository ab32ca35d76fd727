"""Health over flights: a loss is named with its engine, a healthy fleet is not, conditions are no change."""

import json
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from tests.flighttest.scene import ENGINES, made_flight
from thrustd.__main__ import main
from thrustd.api.flights import health
from thrustd.core.calibration import Calibration, MountCalibration, Zero, write_calibration
from thrustd.core.errors import RecordingError, UsageError
from thrustd.flighttest.fleet_health import fleet_health
from thrustd.flighttest.fleet_report import figure, lines
from thrustd.flighttest.flight import read_flight
from thrustd.flighttest.health import _mounts, health_rows, taken_mm
from thrustd.flighttest.trend import FEWEST, hours_to, judge
from thrustd.installation.installation import CONFIG, installation_from_files, read_installation
from thrustd.installation.shipped import read_deck, shipped
from thrustd.records.files import write_recording
from thrustd.twin.airframe import draw_airframe
from thrustd.twin.flight import scripted_flight, write_flight
from thrustd.twin.installation import PLAIN
from thrustd.wire.can_frames import ICD_INPUT_ROWS

HOURS = np.arange(1.0, 31.0)


def test_a_trend_a_step_and_nothing():
    rng = np.random.default_rng(3)
    noise = 0.3 * rng.standard_normal(30)
    trend = judge(HOURS, noise - 0.1 * HOURS)
    assert trend.kind == "trend" and trend.slope_low <= -0.1 <= trend.slope_high
    step = judge(HOURS, noise + np.where(HOURS > 12, 2.0, 0.0))
    assert (step.kind, step.since_flight) == ("step", 13) and step.change == pytest.approx(2.0, abs=0.3)
    assert judge(HOURS, noise).kind == "steady"
    assert judge(HOURS, noise - 0.1 * HOURS, least=5.0).kind == "steady"  # too small to matter


def test_healthy_series_are_not_named_however_often_one_looks():
    rng = np.random.default_rng(4)
    series = rng.standard_normal((60, 30))
    named = [n for line in series for n in range(FEWEST, 31) if judge(HOURS[:n], line[:n]).changed]
    assert len(named) <= 1  # 60 series with odds of at most 1 in 100 each, in all their looks together


def test_gaps_in_a_series_and_too_few_flights():
    values = np.where(HOURS > 20, 5.0, 0.0) + 0.01 * np.sin(HOURS)
    values[[2, 7]] = np.nan
    assert judge(HOURS, values).since_flight == 21
    few = judge(HOURS[:4], values[:4])
    assert not few.changed and np.isnan(few.slope) and hours_to(1.0, few) == np.inf


def rows_of_fleet(seed, loss_pct=0.0, flights=20, zero_um=0.0):
    """Rows as `health_rows` makes them: other conditions on every flight, a deck that is wrong in them.

    The measured thrust tells the wear almost exactly, and the throttles are split now and then.
    """
    rng = np.random.default_rng(seed)
    rows = []
    for flight in range(flights):
        day = rng.uniform(-15, 15)
        about = {
            "file": f"{flight:02d}",
            "flight": f"{flight:02d}",
            "start_utc_s": 1e9 + 86400.0 * flight,
            "hours": 1.5,
        }
        windows = [(rng.uniform(60, 95), rng.uniform(0.2, 0.5), rng.uniform(500, 5000)) for _ in range(12)]
        for engine in ENGINES:
            zero_n = 25 * rng.standard_normal()
            for place, (n1, mach, altitude) in enumerate(windows):
                n1 += 10 * (place % 4 == 0) * (engine == "left")
                deck = 30 * (n1 - 40) * (1 + 0.2 * mach)
                off = 2 * mach + 0.05 * (n1 - 75) + 0.1 * day - loss_pct * flight / 29 * (engine == "left")
                at_n1 = off + 100 * zero_n / deck + 0.02 * rng.standard_normal()
                rows.append(about | {
                    "of": engine, "kind": "engine", "start_s": 40.0 * place, "seconds": 30.0, "mach": mach,
                    "pressure_altitude_m": altitude, "n1_corrected_pct": n1, "sat_degC": 15 - 0.0065 * altitude + day,
                    "thrust_N": deck * (1 + at_n1 / 100), "thrust_at_n1_pct": at_n1, "deck_N": deck,
                    "fuel_at_n1_pct": off + 0.3 * rng.standard_normal(), "n2_at_n1_pct": 0.3 * rng.standard_normal(),
                    "load_share": 0.46 + 0.001 * rng.standard_normal(),
                })  # fmt: skip
        rows.append(about | {"of": "left_upper", "kind": "mount", "zero_mm": 1e-3 * zero_um * flight / flights})
    return rows


@pytest.mark.parametrize("seed", range(3))
def test_the_engine_that_loses_thrust_is_named_at_equal_conditions(seed):
    changed = [one for one in fleet_health(rows_of_fleet(seed, 3.0)).changed if one.quantity == "thrust_at_n1_pct"]
    assert changed and {one.engine for one in changed} == {"left"}
    pair = next(one for one in changed if one.of == "left - right")
    assert pair.trend.slope_low <= -3.0 / 29 / 1.5 <= pair.trend.slope_high
    assert pair.trend.slope_high - pair.trend.slope_low < 0.02  # the wear is not explained away by what it does


@pytest.mark.parametrize("seed", range(3))
def test_days_and_conditions_are_no_change(seed):
    assert not fleet_health(rows_of_fleet(seed)).changed


def test_the_picture_shows_every_series():
    found = fleet_health(rows_of_fleet(1, 3.0, flights=8))
    shown = [axis for axis in figure(found).axes if axis.get_visible()]
    assert len(shown) == len(found.health) and all(axis.lines for axis in shown)
    assert shown[0].get_ylabel() == "thrust at equal N1, %"


def test_the_engine_that_wears_is_named_in_a_sentence():
    assert any(
        line.startswith("left: thrust at equal N1 changed by -") for line in lines(fleet_health(rows_of_fleet(0, 3.0)))
    )


def test_a_mount_says_by_when_it_has_to_be_calibrated():
    found = fleet_health(rows_of_fleet(1, zero_um=4.0))
    zero = next(one for one in found.health if one.quantity == "zero_mm")
    # 4 um in 20 flights of 1.5 h: 10 um in 75 h, that is 50 days at a flight a day
    assert zero.recalibrate_in_h == pytest.approx(75.0, rel=0.1)
    assert (zero.recalibrate_utc_s - 1e9) / 86400 == pytest.approx(zero.recalibrate_in_h / 1.5)


def test_the_date_is_that_of_the_present_use_however_few_the_flights():
    """Use counts between two beginnings: the last flight is not in it. A flight a day, 1.5 h each."""
    found = fleet_health(rows_of_fleet(2, flights=FEWEST, zero_um=4.0))
    zero = next(one for one in found.health if one.quantity == "zero_mm")
    assert (zero.recalibrate_utc_s - 1e9) / 86400 == pytest.approx(zero.recalibrate_in_h / 1.5)
    (said,) = [line for line in lines(found) if line.startswith("left_upper, zero: recalibrate by ")]
    date = datetime.fromtimestamp(zero.recalibrate_utc_s, UTC)
    assert said.endswith(f" h of flight after the first, {date:%Y-%m-%d} at the present use")


def test_rows_of_a_flight(tmp_path):
    path = tmp_path / "made.csv"
    off = made_flight()
    still = off.time_s < 20  # engines off on the ground
    columns = {f"n1_pct_{e}": np.where(still, 0.0, off[f"n1_pct_{e}"]) for e in ENGINES}
    record = off.with_channels(
        mach=np.where(still, 0.0, off["mach"]), deformation_mm_left_upper=np.where(still, 0.003, 0.5), **columns
    )
    write_recording(record, path)
    deck = read_deck()
    rows = health_rows(read_flight(path), deck)
    points = [row for row in rows if row["kind"] == "engine"]
    assert {row["of"] for row in points} == set(ENGINES) and len(points) >= 4
    for row in points:
        at_n1 = row["thrust_N"] / (1 + row["thrust_at_n1_pct"] / 100)
        assert row["thrust_N"] == pytest.approx(1000 + 5000 * row["mach"] + 100 * (row["of"] == "right"), rel=0.01)
        assert 500 < at_n1 < 8000
    (mount,) = (row for row in rows if row["kind"] == "mount")
    assert mount["of"] == "left_upper" and mount["zero_mm"] == pytest.approx(0.003)


def test_a_table_that_was_exported_says_that_its_zeros_are_gone(tmp_path):
    """The run had taken them off: they would be nothing on every flight."""
    for number, name in enumerate(("exported.csv", "raw.csv")):
        flight = made_flight(seed=number)
        mount = ("deformation_mm", "mount_force_n")[: 2 - number]
        said = {f"{each}_left_upper": np.zeros(len(flight)) for each in mount}
        write_recording(flight.with_channels(**said), tmp_path / name)
    found = health(sorted(tmp_path.glob("*.csv")))
    assert [Path(file).name for file in found.found.without_zeros] == ["exported.csv"]
    assert "no zeros of mounts in 1 of 2 flights: exported without; give the log" in found.lines


def test_a_copy_of_a_log_is_no_second_flight(tmp_path, capsys):
    first, second = made_flight(seed=0), made_flight(seed=1)
    write_recording(first, tmp_path / "a.csv")
    write_recording(first, tmp_path / "b.parquet")
    write_recording(second, tmp_path / "c.csv")
    files = [str(tmp_path / name) for name in ("a.csv", "b.parquet", "c.csv", "c.csv")]
    table = tmp_path / "table.parquet"
    assert main(["fleet", "health", *files, "-o", str(table), "--json", "--processes", "1"]) == 1
    said = capsys.readouterr()
    assert json.loads(said.out)["flights"] == [files[0], files[2]]
    assert said.err.count("the same recording as") == 2
    errors = {row["file"]: row["error"] for row in pq.read_table(table).to_pylist() if row["error"]}
    assert errors[files[1]] == f"{files[1]}: the same recording as {files[0]}; expected every recording once"
    with pytest.raises(UsageError, match=r"b\.parquet: the same recording as a\.csv"):
        health(files[:2])


def test_without_mounts_no_thrust_is_judged(tmp_path):
    for number in range(2):
        write_recording(made_flight(seed=number, estimates=False), tmp_path / f"{number}.csv")
    write_recording(made_flight(seed=2), tmp_path / "2.csv")
    found = health(sorted(tmp_path.glob("*.csv")))
    flights = {(one.of, one.quantity): one.trend.flights for one in found.found.health}
    assert flights["left", "thrust_at_n1_pct"] == 1 and flights["left", "fuel_at_n1_pct"] == 3
    assert "no mounts in 2 of 3 flights: nothing measures the thrust there" in found.lines


def test_an_engine_without_a_fan_speed_is_named(tmp_path):
    flight = made_flight()
    nothing = np.full(len(flight), np.nan)
    write_recording(flight.with_channels(n1_pct_right=nothing), tmp_path / "nan.csv")
    with pytest.raises(RecordingError, match="no values of n1_pct_right; expected the fan speed of every engine"):
        health([tmp_path / "nan.csv"])


def test_one_flight_names_no_engine(tmp_path):
    write_recording(made_flight(), tmp_path / "0.csv")
    answer = health([tmp_path / "0.csv"])
    found = answer.found
    assert answer.title == "Health over 1 flight" and answer.lines[0].startswith("1 flight; 6 or more")
    assert found.health and not any(one.engine for one in found.health)
    assert {row["quantity"]: row["unit"] for row in found.rows()}["load_share"] == "-"
    assert {row["unit"] for row in found.rows()} == {"%", "-"} and "slope_per_h" in found.rows()[0]


def test_the_verb(tmp_path, capsys):
    for flight in range(2):
        write_recording(made_flight(seed=flight), tmp_path / f"{flight}.csv")
    write_recording(made_flight(machs=(0.3,)).window(0, 5), tmp_path / "short.csv")
    table, page = tmp_path / "health.parquet", tmp_path / "health.html"
    files = [str(path) for path in sorted(tmp_path.glob("*.csv"))]
    arguments = ["fleet", "health", *files, "-o", str(table), "--report", str(page), "--json", "--processes", "1"]
    assert main(arguments) == 1  # one file has no steady window: it is a row with its error
    said = json.loads(capsys.readouterr().out)
    assert len(said["flights"]) == 2 and {one["of"] for one in said["health"]} >= {*ENGINES, "left - right"}
    assert all(one["trend"]["kind"] == "steady" for one in said["health"])
    assert "Health over 2 flights" in page.read_text()
    errors = [row["error"] for row in pq.read_table(table).to_pylist() if row["error"]]
    assert len(errors) == 1 and "no steady window" in errors[0]


@pytest.mark.parametrize("calibrated_um", [None, 5.0])
def test_a_mounts_zero_is_what_its_transducer_shows_whatever_was_taken_off_it(tmp_path, calibrated_um):
    """A run takes a part of it off its own samples after three seconds, a calibration file all of what it holds."""
    installation, seen = read_installation(shipped("deploy/hil.toml", "config")), []
    if calibrated_um is not None:
        zero = Zero(on="2026-01-01", mm=1e-3 * calibrated_um, std_mm=0.001)
        file = Calibration(on="2026-01-01", mount={"left_upper": MountCalibration(zeros=(zero,))})
        named = b'calibration = "calibration.toml"\n' + installation.files[CONFIG]
        more = {CONFIG: named, "calibration.toml": write_calibration(file).encode()}
        installation = installation_from_files({**installation.files, **more}, "test")
    profile, _ = scripted_flight(15.0, 4)
    table = installation.can_table(ICD_INPUT_ROWS)
    for zero_mm in (0.0, 0.008):
        path = tmp_path / f"{zero_mm}.mcap"
        airframe = draw_airframe(4, PLAIN._replace(zero_mm=(zero_mm, 0.0, 0.0, 0.0)))
        write_flight(path, profile, airframe, table, installation.log_header(), 4)
        zeros_mm = {row["of"]: row["zero_mm"] for row in _mounts(read_flight(path).per_second(), taken_mm(path))}
        seen.append(zeros_mm["left_upper"])
        assert taken_mm(path)["left_upper"] == pytest.approx(1e-3 * (calibrated_um or 0.0))
    assert seen[1] - seen[0] == pytest.approx(0.008, abs=2e-4)
