"""Fuel flow says the level, N1 carries it through a transient, and a missing input is lived without."""

from math import isnan, nan

import pytest

from thrustd.brochure.deck import DeckEstimate
from thrustd.brochure.hand_over import HandOver

STEP_NS = 100_000_000
FUEL_N, N1_N = 3300.0, 3000.0  # N1's line is 10 % low on this engine


def deck(fuel_n=FUEL_N, n1_n=N1_N):
    return DeckEstimate(fuel_n, 100.0, "fuel_flow", False, False, fuel_n, n1_n, nan)


def steady(seconds=60):
    hand_over = HandOver()
    for k in range(seconds * 10):
        last = hand_over.step(k * STEP_NS, deck(), 70.0, 0.0)
    return hand_over, last, seconds * 10


def test_steady_thrust_is_the_fuel_flows_and_gets_surer():
    first = HandOver().step(0, deck(), 70.0, 0.0)
    _, last, _ = steady()
    assert last.thrust_n == pytest.approx(FUEL_N, rel=0.005)
    assert last.std_n < first.std_n


def test_a_fuel_flow_that_leads_in_a_slam_is_not_followed():
    hand_over, _, k = steady()
    slam = hand_over.step(k * STEP_NS, deck(fuel_n=1.4 * FUEL_N), 70.8, 8.0)
    assert slam.thrust_n == pytest.approx(FUEL_N, rel=0.03)


def test_what_was_learnt_stays_when_fuel_flow_is_missing():
    hand_over, _, k = steady()
    alone = hand_over.step(k * STEP_NS, deck(fuel_n=nan), 70.0, 0.0)
    assert alone.thrust_n == pytest.approx(FUEL_N, rel=0.005)


def test_noise_of_n1_is_no_travel():
    """Without fuel flow what was learnt ages with the throttle: 85 s of a fan that rests are 1 %, 20 % of N1 4 %."""
    hand_over, before, k = steady()
    for i in range(850):
        rested = hand_over.step((k + i) * STEP_NS, deck(fuel_n=nan), 70.0 + 0.1 * (-1) ** i, 0.0)
    assert rested.std_n == pytest.approx(before.std_n, rel=0.05)
    for i in range(850, 1050):
        moved = hand_over.step((k + i) * STEP_NS, deck(fuel_n=nan), 70.0 + 0.1 * (i - 850), 1.0)
    assert moved.std_n == pytest.approx(((0.01 * 20**0.5 * N1_N) ** 2 + rested.std_n**2) ** 0.5, rel=0.05)


def test_fuel_flow_stands_alone_without_n1_and_nothing_is_nothing():
    hand_over, _, k = steady()
    assert hand_over.step(k * STEP_NS, deck(n1_n=nan), nan, nan).thrust_n == pytest.approx(FUEL_N)
    assert isnan(hand_over.step((k + 1) * STEP_NS, deck(nan, nan), nan, nan).thrust_n)


def test_what_was_learnt_survives_a_restart():
    hand_over, _, k = steady()
    other = HandOver()
    assert other.restore(hand_over.snapshot())
    other.step((k - 1) * STEP_NS, deck(fuel_n=nan), 70.0, 0.0)
    here, there = (each.step(k * STEP_NS, deck(fuel_n=nan), 70.0, 0.0) for each in (hand_over, other))
    assert (there.thrust_n, there.std_n) == (here.thrust_n, here.std_n)


@pytest.mark.parametrize("junk", [[], [0.0, -1.0, 70.0, 8.0], [None] * 4, [1e9, 0.001, 70.0, 8.0]])
def test_junk_is_not_taken_over(junk):
    hand_over = HandOver()
    before = hand_over.snapshot()
    assert not hand_over.restore(junk)
    assert hand_over.snapshot() == before
