"""Transients: throttle movements are measured, trouble is a candidate, and a healthy flight has none."""

import json

import numpy as np
import pytest

from tests.conftest import PH_LAB
from tests.flighttest.scene import ENGINES
from thrustd.__main__ import main
from thrustd.brochure.deck_curves import DeckInputs
from thrustd.flighttest.flight import Flight, read_flight
from thrustd.flighttest.transients import Transients, find_transients
from thrustd.flighttest.transients_report import figure, manoeuvres
from thrustd.installation.shipped import read_deck
from thrustd.records.files import write_recording
from thrustd.records.recording import make_recording

HZ = 10


@pytest.fixture(scope="module")
def deck():
    return read_deck()


def flown(deck, n1_pct, trouble_n=0.0, fuel=1.0):
    """Both engines at `n1_pct` (n,), in the air, thrust and fuel flow as the deck has them."""
    n, rng = len(n1_pct), np.random.default_rng(0)
    table = np.linspace(15, 105, 91)
    thrust = [deck.estimate(DeckInputs(np.nan, n1, np.nan, 0.3, 3000.0, -4.0, 0.0), 0).n1_thrust_n for n1 in table]
    flows = np.linspace(0.005, 0.25, 400)
    by_fuel = [
        deck.estimate(DeckInputs(w, np.nan, np.nan, 0.3, 3000.0, -4.0, 0.0), 0).fuel_flow_thrust_n for w in flows
    ]
    thrust_n = np.interp(n1_pct, table, thrust)
    columns = {"time_s": np.arange(n) / HZ, "mach": np.full(n, 0.3), "pressure_altitude_m": np.full(n, 3000.0),
               "sat_degC": np.full(n, -4.0)}  # fmt: skip
    for engine in ENGINES:
        noise = 3 * rng.standard_normal(n)
        columns |= {f"n1_pct_{engine}": n1_pct, f"mount_N_{engine}": thrust_n + noise,
                    f"fuel_flow_kg_s_{engine}": np.interp(thrust_n, by_fuel, flows)}  # fmt: skip
    columns["mount_N_left"] = columns["mount_N_left"] + trouble_n
    columns["fuel_flow_kg_s_left"] = columns["fuel_flow_kg_s_left"] * fuel
    return Flight(make_recording("flown", columns), ENGINES, True)


def test_a_spool_up_is_timed_with_its_overshoot_and_rate(deck):
    t = np.arange(600) / HZ
    n1 = np.interp(t, [0, 20, 28, 29, 31, 60], [50, 50, 90, 91.5, 90, 90])
    events = find_transients(flown(deck, n1), deck).events
    assert [(e.engine, e.kind) for e in events] == [("left", "spool up"), ("right", "spool up")]
    for event in events:
        assert event.start_s == pytest.approx(20, abs=0.5)
        assert event.seconds == pytest.approx(0.95 * 8, abs=0.5)
        assert event.overshoot_pct == pytest.approx(1.5, abs=0.2)
        assert event.largest_rate_pct_s == pytest.approx(5.0, rel=0.1)
        assert event.thrust_change_n > 2000


def test_the_picture_shows_every_manoeuvre(deck):
    t = np.arange(600) / HZ
    flight = flown(deck, np.interp(t, [0, 20, 28, 60], [50, 50, 90, 90]))
    flight = flight._replace(record=flight.record.with_channels(**{f"thrust_N_{e}": t for e in ENGINES}))
    found = find_transients(flight, deck)
    assert [[event.engine for event in events] for events in manoeuvres(found)] == [["left", "right"]]
    shown = [axis for axis in figure(flight, found).axes if axis.get_visible() and axis.lines]
    assert [axis.get_ylabel() for axis in shown] == ["N1, %", "net thrust, kN"]  # one panel, both engines in it
    assert figure(flight, Transients("nothing happened", [], {})).axes


def test_trouble_is_a_candidate_of_its_engine(deck):
    n1 = np.full(900, 80.0)
    dips = np.zeros(900)
    dips[300:306] = -1500.0
    surge = find_transients(flown(deck, n1, dips), deck).candidates
    assert {(e.engine, e.kind) for e in surge} == {("left", "surge candidate")}
    assert surge[0].start_s == pytest.approx(30.0, abs=1.0)
    for least in (0.05, 0.0):
        starved = np.where(np.arange(900) > 500, least, 1.0)
        out = find_transients(flown(deck, n1, fuel=starved), deck).candidates
        assert [(e.engine, e.kind) for e in out] == [("left", "flame-out candidate")]


def test_values_that_are_not_there_are_no_trouble_and_told(deck):
    n1 = np.full(1800, 80.0)
    flight = flown(deck, n1, 300.0)  # its thrust is off: the edges of a hole are steps
    for gone in (slice(600, 900), slice(1000, 1004)):
        for name in ("mach", "mount_N_left", "n1_pct_left"):
            column = flight.record[name].copy()
            column[gone] = np.nan
            found = find_transients(flight._replace(record=flight.record.with_channels(**{name: column})), deck)
            assert not found.events and (found.missing_s.get(name, 0) in (29, 30)) == (
                name != "mount_N_left" and gone.start == 600
            )


def test_throttle_and_steady_flight_give_no_candidate(deck):
    rng = np.random.default_rng(2)
    t = np.arange(3000) / HZ
    corners = np.arange(0, 301, 15)
    n1 = np.interp(
        t, np.repeat(corners, 2)[1:-1] + np.tile([0, 4], len(corners) - 1), np.repeat(rng.uniform(40, 95, 20), 2)
    )
    assert not find_transients(flown(deck, n1), deck).candidates


def test_the_verb(deck, tmp_path, capsys):
    log, page, table = tmp_path / "flown.csv", tmp_path / "t.html", tmp_path / "t.csv"
    n1 = np.interp(np.arange(600) / HZ, [0, 20, 28, 60], [50, 50, 90, 90])
    write_recording(flown(deck, n1).record, log)
    assert main(["transients", str(log), "--report", str(page), "-o", str(table), "--json"]) == 0
    events = json.loads(capsys.readouterr().out)["events"]
    assert len(events) == 2 and table.read_text().count("\n") == 3 and "spool up" in page.read_text()


@pytest.mark.skipif(not PH_LAB.exists(), reason="no PH-LAB recordings here")
def test_recorded_flights_have_spool_ups_and_no_alarm(deck):
    for name in ("ftis_20180312_ref", "openap_phlab_20170320_12"):
        flight = read_flight(PH_LAB / f"{name}.npz").per_second()
        found = find_transients(flight, deck)
        assert len(found.events) > 30 and not found.candidates
