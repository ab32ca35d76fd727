"""Fuel flow says the level, N1 carries it through a transient, and a missing input is lived without."""

from math import isnan, nan

import pytest

from thrustd.brochure.hand_over import BOUND, START_STD, HandOver, hand_over

STEP_S = 0.1
FUEL_N, N1_N = 3300.0, 3000.0  # N1's line is 10 % low on this engine


class Engine:
    """One engine's hand-over, ten readings a second."""

    def __init__(self):
        self.learnt = HandOver()

    def step(self, n1_pct, n1_rate_pct_s, fuel_n=FUEL_N, n1_n=N1_N):
        """(thrust, slow one sigma) of a deck with 100 N."""
        return hand_over(self.learnt.row, STEP_S, 100.0, fuel_n, n1_n, n1_pct, n1_rate_pct_s)[:2]


def steady(seconds=60):
    engine = Engine()
    for _ in range(seconds * 10):
        last = engine.step(70.0, 0.0)
    return engine, last


def test_steady_thrust_is_the_fuel_flows_and_gets_surer():
    _, first_std_n = Engine().step(70.0, 0.0)
    _, (thrust_n, std_n) = steady()
    assert thrust_n == pytest.approx(FUEL_N, rel=0.005)
    assert std_n < first_std_n


def test_no_more_is_learnt_of_a_fuel_flow_than_its_prior_allows():
    """One that reads half as much again is somebody's fault, and no new normal."""
    engine = Engine()
    for _ in range(6000):
        thrust_n, _ = engine.step(70.0, 0.0, fuel_n=1.5 * N1_N)
    assert thrust_n == pytest.approx(N1_N * (1.0 + BOUND * START_STD))


def test_a_fuel_flow_that_leads_in_a_slam_is_not_followed():
    engine, _ = steady()
    assert engine.step(70.8, 8.0, fuel_n=1.4 * FUEL_N)[0] == pytest.approx(FUEL_N, rel=0.03)


def test_what_was_learnt_stays_when_fuel_flow_is_missing():
    engine, _ = steady()
    assert engine.step(70.0, 0.0, fuel_n=nan)[0] == pytest.approx(FUEL_N, rel=0.005)


def test_noise_of_n1_is_no_travel():
    """Without fuel flow what was learnt ages with the throttle: 85 s of a fan that rests are 1 %, 20 % of N1 4 %."""
    engine, (_, before_n) = steady()
    for i in range(850):
        _, rested_n = engine.step(70.0 + 0.1 * (-1) ** i, 0.0, fuel_n=nan)
    assert rested_n == pytest.approx(before_n, rel=0.05)
    for i in range(200):
        _, moved_n = engine.step(70.0 + 0.1 * i, 1.0, fuel_n=nan)
    assert moved_n == pytest.approx(((0.01 * 20**0.5 * N1_N) ** 2 + rested_n**2) ** 0.5, rel=0.05)


def test_fuel_flow_stands_alone_without_n1_and_nothing_is_nothing():
    engine, _ = steady()
    assert engine.step(nan, nan, n1_n=nan)[0] == pytest.approx(FUEL_N)
    assert isnan(engine.step(nan, nan, nan, nan)[0])


def test_what_was_learnt_survives_a_restart():
    engine, _ = steady()
    other = Engine()
    assert other.learnt.restore(engine.learnt.snapshot())
    assert other.step(70.0, 0.0, fuel_n=nan) == engine.step(70.0, 0.0, fuel_n=nan)


@pytest.mark.parametrize("junk", [[], [0.0, -1.0, 70.0, 8.0], [None] * 4, [1e9, 0.001, 70.0, 8.0]])
def test_junk_is_not_taken_over(junk):
    learnt = HandOver()
    before = learnt.snapshot()
    assert not learnt.restore(junk)
    assert learnt.snapshot() == before
