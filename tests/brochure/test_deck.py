"""The shipped deck over the whole envelope, its reference points, its sources, and decks that are refused."""

import json
from math import isnan, nan
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from thrustd.brochure.deck import Deck, total_ratios
from thrustd.brochure.deck_curves import DeckInputs, estimate
from thrustd.core.errors import DeckError

PATH = Path(__file__).parents[2] / "models" / "brochure" / "jt15d-4.json"
TEXT = PATH.read_text()
DECK = Deck.from_json(TEXT, PATH.name)
FOOT_M = 0.3048

mach = st.floats(0.0, 0.7)
altitude_m = st.floats(0.0, 43_000 * FOOT_M)
isa_k = st.floats(-40.0, 35.0)
engine = st.sampled_from((0, 1))


def inputs(fuel=nan, n1=nan, n2=nan, mach=0.3, altitude_m=3000.0, isa_k=0.0, n1_rate=0.0):
    sat_degc = max(15.0 - 0.0065 * altitude_m, -56.5) + isa_k
    return DeckInputs(fuel, n1, n2, mach, altitude_m, sat_degc, n1_rate)


@given(mach, altitude_m, isa_k, engine, st.floats(20.0, 104.0), st.floats(0.05, 5.0))
def test_more_fan_speed_is_more_thrust(mach, altitude_m, isa_k, engine, n1, more):
    low = DECK.estimate(inputs(n1=n1, mach=mach, altitude_m=altitude_m, isa_k=isa_k), engine)
    high = DECK.estimate(inputs(n1=n1 + more, mach=mach, altitude_m=altitude_m, isa_k=isa_k), engine)
    assert high.thrust_n > low.thrust_n


@given(mach, altitude_m, isa_k, engine, st.floats(0.005, 0.2), st.floats(0.0005, 0.02))
def test_more_fuel_is_more_thrust(mach, altitude_m, isa_k, engine, fuel, more):
    low = DECK.estimate(inputs(fuel, mach=mach, altitude_m=altitude_m, isa_k=isa_k), engine)
    high = DECK.estimate(inputs(fuel + more, mach=mach, altitude_m=altitude_m, isa_k=isa_k), engine)
    assert high.thrust_n > low.thrust_n


@given(mach, altitude_m, isa_k, engine, st.floats(20.0, 104.0))
def test_smooth_in_fan_speed(mach, altitude_m, isa_k, engine, n1):
    """C1: the slopes on both sides of any point agree, knots and edges of the box included."""
    h = 1e-4
    below, at, above = (
        DECK.estimate(inputs(n1=n1 + d, mach=mach, altitude_m=altitude_m, isa_k=isa_k), engine).thrust_n
        for d in (-h, 0.0, h)
    )
    slope = (above - below) / (2 * h)
    assert abs((above - at) - (at - below)) / h < 1e-2 * slope + 0.5


def largest_bend(fuel_kg_s, thrust_n):
    """Largest change of slope from one step to the next, as a part of the mean slope."""
    slopes = np.diff(thrust_n) / np.diff(fuel_kg_s)
    return np.max(np.abs(np.diff(slopes))) / np.mean(slopes)


@settings(max_examples=30)
@given(mach, altitude_m, isa_k, engine)
def test_smooth_in_fuel_flow(mach, altitude_m, isa_k, engine):
    """Half the step, half the bend: a kink would bend by as much however short the step is."""
    fuel_kg_s = np.linspace(0.003, 0.2, 1601)
    thrust_n = np.array(
        [
            DECK.estimate(inputs(fuel, mach=mach, altitude_m=altitude_m, isa_k=isa_k), engine).thrust_n
            for fuel in fuel_kg_s.tolist()
        ]
    )
    assert largest_bend(fuel_kg_s, thrust_n) < 0.7 * largest_bend(fuel_kg_s[::2], thrust_n[::2]) + 1e-3


@given(mach, altitude_m, isa_k, st.floats(0.01, 0.2))
def test_smooth_in_mach(mach, altitude_m, isa_k, fuel):
    h = 1e-4
    mach = max(mach, h)
    below, at, above = (
        DECK.estimate(inputs(fuel, mach=mach + d, altitude_m=altitude_m, isa_k=isa_k), 0).thrust_n for d in (-h, 0.0, h)
    )
    assert abs(above - 2 * at + below) < 1.0


@pytest.mark.parametrize(
    ("fuel_kg_s", "thrust_n", "within"), [(0.177, 11121, 0.02), (0.164, 10431, 0.02), (0.0261, 778, 0.02)]
)
def test_static_reference_points(fuel_kg_s, thrust_n, within):
    estimate = DECK.estimate(inputs(fuel_kg_s, mach=0.0, altitude_m=0.0), 0)
    assert estimate.thrust_n == pytest.approx(thrust_n, rel=within)
    assert estimate.extrapolating  # no pair of the brochure program lies there


def test_extrapolation_widens_the_band():
    inside = DECK.estimate(inputs(0.06, mach=0.35, altitude_m=3000.0), 0)
    outside = DECK.estimate(inputs(0.06, mach=0.65, altitude_m=3000.0), 0)
    assert not inside.extrapolating
    assert outside.extrapolating
    assert outside.std_n / outside.thrust_n > inside.std_n / inside.thrust_n


def test_the_band_is_that_of_fuel_flow():
    """Behind ram drag a per cent of fuel flow is more than one of net thrust."""
    for at in (inputs(0.06, mach=0.45, altitude_m=6000.0), inputs(0.15, mach=0.2, altitude_m=300.0)):
        here, there = DECK.estimate(at, 0), DECK.estimate(at._replace(fuel_flow_kg_s=at.fuel_flow_kg_s * 1.01), 0)
        spread = DECK.data.spread
        expected_n = spread.fuel_flow_relative * 100.0 * (there.thrust_n - here.thrust_n)
        more_n = spread.extrapolating_relative * here.thrust_n * here.extrapolating
        assert here.std_n == pytest.approx((expected_n**2 + spread.floor_n**2 + more_n**2) ** 0.5, rel=0.01)


def test_sources_by_what_is_there():
    both = inputs(0.06, 70.0, 80.0)
    assert DECK.estimate(both, 0).source == "fuel_flow"
    assert DECK.estimate(both._replace(n1_rate_pct_s=5.0), 0).source == "n1"
    assert DECK.estimate(both._replace(n1_rate_pct_s=5.0), 0).transient
    assert DECK.estimate(both._replace(fuel_flow_kg_s=nan), 0).source == "n1"
    assert DECK.estimate(both._replace(n1_pct=nan), 0).source == "fuel_flow"
    nothing = DECK.estimate(both._replace(n1_pct=nan, fuel_flow_kg_s=nan), 0)
    assert nothing.source == "none"
    assert isnan(nothing.thrust_n)
    assert isnan(DECK.estimate(both._replace(mach=nan), 0).thrust_n)
    assert isnan(DECK.estimate(both._replace(pressure_altitude_m=nan), 0).thrust_n)


def test_missing_temperature_is_isa_with_a_wider_band():
    known = DECK.estimate(inputs(0.06), 0)
    unknown = DECK.estimate(inputs(0.06)._replace(sat_degc=nan), 0)
    assert unknown.thrust_n == pytest.approx(known.thrust_n)
    assert unknown.std_n > known.std_n


def test_unknown_engine_has_the_fuel_source_only():
    estimate = DECK.estimate(inputs(0.06, 70.0, 80.0), 5)
    assert estimate.source == "fuel_flow"
    assert isnan(estimate.n1_thrust_n)


def test_standard_atmosphere():
    assert total_ratios(0.0, 0.0, 15.0) == pytest.approx((1.0, 1.0))
    assert total_ratios(0.0, 11000.0, nan) == pytest.approx((0.22336, 0.75187), rel=1e-4)  # ISO 2533
    assert total_ratios(0.0, 13000.0, nan)[0] == pytest.approx(0.16294, rel=2e-3)


def changed(path, value):
    deck = json.loads(TEXT)
    place = deck
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return json.dumps(deck)


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("", "not a brochure deck"),
        ("[1, 2]", "not a brochure deck"),
        ('{"schema": "thrustd.deck.v2"}', "thrustd.deck"),
        (changed(["surprise"], 1), "surprise"),
        (changed(["thrust", "speed_n"], [[0.0], [-1.0]]), "rise with fuel flow"),
        (changed(["thrust", "mach_box"], [0.5, 0.1]), "mach_box"),
        (changed(["spread", "fuel_flow_relative"], -0.1), "relative"),
        (changed(["n1", 0, "engine"], 1), "one curve per engine"),
        (changed(["n1", 0, "corrected_pct", 3], 20.0), "corrected_pct"),
        (changed(["n1", 0, "slope_per_pct", 3], 9.0), "slope_per_pct[3]"),
        (changed(["n2", 1, "log_fuel_flow"], [1.0, 2.0]), "same number"),
    ],
)
def test_bad_decks_are_refused_in_one_line(text, word):
    with pytest.raises(DeckError) as error:
        Deck.from_json(text, "bad.json")
    assert str(error.value).startswith("bad.json: ")
    assert word in str(error.value)
    assert "\n" not in str(error.value)


def test_a_fuel_flow_that_lies_does_not_move_the_place_on_the_deck():
    """What the spools stand for is in the middle; dF/d ln w and ln w are the bank's."""
    numbers = DECK.numbers(0)
    right = estimate(numbers, inputs(fuel=0.09, n1=80.0, n2=85.0))[9:]
    for wrong in (0.02, 0.3, nan):
        assert estimate(numbers, inputs(fuel=wrong, n1=80.0, n2=85.0))[9:] == pytest.approx(right, rel=0.2)


def test_many_instants_are_said_as_each_alone():
    rng = np.random.default_rng(6)
    rows = rng.uniform((0.01, 20.0, 50.0, 0.0, 0.0, -60.0, -5.0), (0.2, 105.0, 100.0, 0.8, 12e3, 40.0, 5.0), (300, 7))
    rows[rng.random(rows.shape) < 0.1] = nan
    each = [estimate(DECK.numbers(1), DeckInputs(*row)) for row in rows.tolist()]
    told = np.array([(*one[:2], *one[5:]) for one in each])
    said = DECK.along(rows, 1)
    assert np.array_equal(np.column_stack(said), told, equal_nan=True)
    named = [DECK.estimate(DeckInputs(*row), 1) for row in rows.tolist()]
    assert np.array_equal(said.n2_n, [one.n2_thrust_n for one in named], equal_nan=True)
    assert np.array_equal(said.per_fuel_n, [one.per_fuel_n for one in named], equal_nan=True)
