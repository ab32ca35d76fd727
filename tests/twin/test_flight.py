"""Simulated flights: what is on the wire decodes to what the twin did."""

import json
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from tests.wire.one_by_one import AdcSample, adc_items, can_items
from thrustd.__main__ import main
from thrustd.core.errors import RecordingError
from thrustd.core.types import Fault, Frame, Reading, Tick
from thrustd.records.files import read_recording, write_recording
from thrustd.records.recording import make_recording
from thrustd.sources.mcap_log import LogFile
from thrustd.twin.aircraft import as_flown
from thrustd.twin.airframe import ENGINES, MOUNTS, carried_n, draw_airframe, settled
from thrustd.twin.flight import Rates, Truth, fly, scripted_flight, write_flight
from thrustd.twin.sensors import COUNT_MM
from thrustd.wire.adc_frames import AdcDecoder
from thrustd.wire.can_decoder import CanDecoder
from thrustd.wire.can_frames import ICD_INPUT_ROWS, ICD_OPTIONAL_ROWS
from thrustd.wire.can_table import CanTable, CanUnits
from thrustd.wire.log_layout import LogHeader

DBC = Path(__file__).resolve().parents[2] / "deploy" / "canaerospace.dbc"
SEED = 11


@pytest.fixture(scope="module")
def table():
    return CanTable.from_dbc(DBC.read_text(), ICD_INPUT_ROWS, CanUnits())


@pytest.fixture(scope="module")
def flight():
    return scripted_flight(150.0, SEED)


@pytest.fixture(scope="module")
def items(flight, table):
    return list(fly(*flight, table, SEED))


def decoded(items, table, sample_hz=100.0):
    """(samples, readings by (signal, index), faults)."""
    adc, can = AdcDecoder(4, sample_hz), CanDecoder(table)
    samples, readings, faults = [], defaultdict(list), []
    for item in items:
        if isinstance(item, Frame):
            for out in adc_items(adc, item.t_ns, item.data) if item.channel == "adc" else can_items(can, item):
                if isinstance(out, AdcSample):
                    samples.append(out)
                elif isinstance(out, Reading):
                    readings[out.signal, out.index].append(out)
                else:
                    faults.append(out)
    return samples, readings, faults


def test_arrival_order_and_kinds(items):
    times_ns = [item.t_ns for item in items]
    assert times_ns == sorted(times_ns)
    kinds = {type(item) for item in items}
    assert kinds == {Frame, Tick, Truth}


def test_same_seed_same_bytes(flight, table, items):
    assert list(fly(*flight, table, SEED)) == items


def test_a_flight_whose_truth_nobody_asks_for_is_the_same_on_the_wire(table):
    profile, airframe = scripted_flight(25.0, SEED)
    told, untold = (list(fly(profile, airframe, table, SEED, Rates(truth_hz=hz))) for hz in (20.0, 0.0))
    assert [item for item in told if not isinstance(item, Truth)] == untold


def test_the_crews_mark_of_a_recording_is_said_where_the_bus_has_it(flight, table):
    profile, airframe = flight
    marked = profile.with_channels(mark=np.where(abs(profile.time_s - 60.0) < 20.0, 3.0, 0.0))
    wide = CanTable.from_dbc(DBC.read_text(), (*ICD_INPUT_ROWS, *ICD_OPTIONAL_ROWS), CanUnits())
    said = decoded(fly(marked, airframe, wide, SEED), wide)[1]["mark", 0]
    high = [one.t_ns * 1e-9 for one in said if one.value == 3.0]
    assert high[-1] - high[0] == pytest.approx(40.0, abs=1.0)
    assert ("mark", 0) not in decoded(fly(marked, airframe, table, SEED), table)[1]


def test_nothing_is_lost_on_a_healthy_wire(items, table, flight):
    samples, readings, faults = decoded(items, table)
    assert faults == []
    assert len(samples) == 14995  # the profile's last sample is at 149.95 s
    assert len(readings["accel_x_g", 0]) == pytest.approx(14995, abs=1)
    assert len(readings["n1_pct", 1]) == pytest.approx(1500, abs=1)
    assert len(readings["temperature_degC", 3]) == pytest.approx(150, abs=1)


def test_readings_say_what_the_profile_did(items, table, flight):
    profile = flight[0]
    _, readings, _ = decoded(items, table)
    for signal, column, within in (
        ("n1_pct", "n1_pct_left", 1.0),
        ("mach", "mach", 0.005),
        ("sat_degC", "sat_degC", 0.6),
    ):
        times_s = np.array([r.t_ns for r in readings[signal, 0]]) / 1e9
        values = np.array([r.value for r in readings[signal, 0]])
        assert values == pytest.approx(np.interp(times_s, profile.time_s, profile[column]), abs=within)


def test_deformations_follow_what_the_mounts_carry(items, table, flight):
    """Engines off: the LVDT's zero. Take-off: stiffness of table 4.1 within friction, relaxation and stiffening."""
    profile, airframe = flight
    samples, _, _ = decoded(items, table)
    mm = np.array([s.counts for s in samples]) * COUNT_MM
    zeros_mm = [lvdt.zero_mm for lvdt in airframe.lvdts]
    assert mm[:1000].mean(axis=0) == pytest.approx(zeros_mm, abs=3e-3)  # metal expands a little
    thrust_n = np.stack([profile[f"thrust_N_{engine}"] for engine in ENGINES])
    accel_g = np.stack([profile[name] for name in ("accel_x_g", "accel_y_g", "accel_z_g")])
    loads_n = carried_n(airframe, thrust_n, accel_g)
    at = int(np.argmax(loads_n[0]))
    sample = round(profile.time_s[at] * 100)
    for number, spring_n_mm in enumerate((5079, 5954, 5079, 5954)):
        stiffness = loads_n[number, at] / (mm[sample, number] - zeros_mm[number])
        assert stiffness / spring_n_mm == pytest.approx(1.08, abs=0.1)


def test_truth_adds_up(items):
    rows = defaultdict(dict)
    for item in items:
        if isinstance(item, Truth):
            rows[item.t_ns][item.name] = item.value_n
    assert len(rows) == 2999
    for row in list(rows.values())[::100]:
        assert set(row) == {*ENGINES, *MOUNTS}
        assert row["left"] == pytest.approx(row["left_upper"] + row["left_lower"])


def test_accelerating_unloads_the_mounts():
    airframe = draw_airframe(1)
    thrust_n = np.full((2, 1), 5000.0)
    rest, pushed = (carried_n(airframe, thrust_n, np.array([[along_g], [0.0], [1.0]])) for along_g in (0.0, 0.1))
    assert (rest - pushed)[:2].sum() == pytest.approx(373 * 9.80665 * 0.1)
    assert rest[:2].sum() == pytest.approx(5000)


@pytest.mark.parametrize("adc_hz", [50.0, 1000.0])
def test_other_rates(flight, table, adc_hz):
    profile, airframe = flight
    items = list(fly(profile.window(100, 110), airframe, table, 1, Rates(adc_hz=adc_hz, accel_hz=200.0)))
    samples, readings, faults = decoded(items, table, adc_hz)
    assert faults == []
    assert len(samples) / (readings["accel_z_g", 0][-1].t_ns / 1e9 - 100) == pytest.approx(adc_hz, rel=0.02)
    assert len(readings["accel_z_g", 0]) == pytest.approx(200 * 10, abs=25)


def test_the_log_holds_the_events(flight, table, items, tmp_path):
    path = tmp_path / "flight.mcap"
    profile, airframe = flight
    write_flight(path, profile, airframe, table, LogHeader(engines=ENGINES, mounts=MOUNTS), SEED)
    events = [item for item in items if not isinstance(item, Truth)]
    assert list(LogFile(path).events()) == events
    record = read_recording(path)
    assert "thrust_N_left" in record
    assert not any(isinstance(event, Fault) for event in events)


def test_a_scripted_flight_is_a_flight(flight):
    profile, _ = scripted_flight(900.0, 3)
    assert profile["n1_pct_left"][0] == 0
    assert profile["thrust_N_left"][0] == 0
    assert profile["mach"].max() > 0.25
    assert profile["pressure_altitude_m"].max() > 500
    assert profile["accel_z_g"].min() < 0.15  # a parabola
    assert profile["accel_z_g"].max() > 1.6
    assert profile["fuel_flow_kg_s_right"].max() > profile["fuel_flow_kg_s_left"].max()


def test_a_recording_needs_its_channels():
    record = make_recording("flown.npz", {"time_s": [0.0, 1.0], "mach": [0.1, 0.1]})
    with pytest.raises(RecordingError, match="no values in column 'pressure_altitude_m', which the twin needs"):
        as_flown(record, draw_airframe(1).healths)


def idling(n1_pct=29.0, n=600):
    """A recording of an aircraft that stands and idles."""
    flat = {"mach": 0.0, "pressure_altitude_m": 100.0, "sat_degC": 15.0, "accel_x_g": 0.02, "accel_z_g": 1.0}
    for side in ENGINES:
        flat |= {
            f"n1_pct_{side}": n1_pct,
            f"n2_pct_{side}": 48.0,
            f"fuel_flow_kg_s_{side}": 0.025,
            f"itt_degC_{side}": 500,
        }
    return make_recording(
        "idling", {"time_s": 9.0 + np.arange(n) / 10.0, **{k: np.full(n, v) for k, v in flat.items()}}
    )


def test_engines_are_started_in_front_of_a_recording():
    record, healths = idling(), draw_airframe(2).healths
    plain, started = as_flown(record, healths), as_flown(record, healths, engine_start=True)
    front = len(started) - len(plain)
    assert started.time_s[0] == plain.time_s[0]
    assert np.diff(started.time_s) == pytest.approx(0.1)
    for name in plain.channels:
        assert started[name][front:] == pytest.approx(plain[name], rel=1e-3)
    for side, others in (("left", 400), ("right", 520)):
        for name in (f"n1_pct_{side}", f"n2_pct_{side}", f"fuel_flow_kg_s_{side}", f"thrust_N_{side}"):
            assert (started[name][:others] == 0.0).all()
            assert started[name][front - 100] == pytest.approx(plain[name][0], rel=1e-3)
    assert (np.abs(np.diff(started["n1_pct_left"])) < 0.5).all()


@pytest.mark.parametrize(("more", "minutes"), [((), 1.0), (("--minutes", "0.5"), 0.5), (("--minutes", "3"), 1.0)])
def test_a_recording_is_flown_for_as_long_as_was_asked_for(tmp_path, capsys, more, minutes):
    write_recording(idling(), tmp_path / "idling.csv")
    log = str(tmp_path / "flight.mcap")
    assert main(["simulate", "--recording", str(tmp_path / "idling.csv"), *more, "--json", "-o", log]) == 0
    assert json.loads(capsys.readouterr().out)["minutes"] == pytest.approx(minutes, abs=0.01)


def test_mounts_that_have_flown_do_not_come_back_to_where_they_were_new():
    airframe, nothing_n = draw_airframe(2), np.zeros(4)
    new, flown = settled(airframe, nothing_n), settled(airframe, nothing_n, flown=True)
    for before, after in zip(new, flown, strict=True):
        assert before.scalar[0] == 0.0
        assert 0.02 < after.scalar[0] < 0.05


def test_engines_that_run_already_are_not_started():
    with pytest.raises(RecordingError, match=r"idling: n1_pct_left is 80.0 % .* expected an idle of 15 to 45 %"):
        as_flown(idling(80.0), draw_airframe(2).healths, engine_start=True)


def test_a_real_recording_keeps_what_was_flown(table):
    data = Path(__file__).resolve().parents[3] / "shared" / "data" / "ph_lab" / "ftis_20180312_ref.npz"
    if not data.exists():
        pytest.skip("the PH-LAB recordings are not at hand")
    record = read_recording(data)
    airframe = draw_airframe(2)
    profile = as_flown(record, airframe.healths)
    assert np.array_equal(profile["n1_pct_left"], record["n1_pct_left"])
    assert 8000 < profile["thrust_N_left"].max() < 11500
    assert sum(1 for _ in fly(profile.window(100, 110), airframe, table, 1)) > 5000
