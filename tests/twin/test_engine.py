"""The twin's engine: reference points, spool-up, and how it differs from the nominal relation."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from thrustd.core.atmosphere import SEA_LEVEL_PA, static_pressure_pa
from thrustd.twin.engine import (
    IDLE_N1_PCT,
    TAKE_OFF_N1_PCT,
    Health,
    draw_health,
    fuel_ratio,
    net_thrust_n,
    spool_rate_pct_s,
    steady_fuel_kg_s,
    true_thrust_n,
)

NOMINAL = Health(0.0, 0.0, 0.0, 1.0)


def static_thrust(n1_pct, health=NOMINAL, time_s=None):
    n1_pct = np.asarray(n1_pct, float)
    zeros = np.zeros_like(n1_pct)
    time_s = np.arange(len(n1_pct)) * 0.05 if time_s is None else time_s
    return true_thrust_n(time_s, n1_pct, zeros, zeros, zeros + 288.15, health)


def spool_up(altitude_m=0.0, dt_s=0.05):
    n1 = [IDLE_N1_PCT]
    while len(n1) < 1000:
        n1.append(n1[-1] + dt_s * spool_rate_pct_s(n1[-1], TAKE_OFF_N1_PCT, altitude_m))
    return np.array(n1)


def test_static_reference_points():
    assert net_thrust_n(0.177, 0.0, 0.0, 288.15) == pytest.approx(11121, rel=0.03)
    assert net_thrust_n(0.164, 0.0, 0.0, 288.15) == pytest.approx(10431, rel=0.03)


@given(st.floats(0.05, 1.65), st.floats(0.0, 0.45), st.floats(0.0, 9000.0), st.floats(220.0, 310.0))
def test_thrust_rises_with_fuel(corrected, mach, altitude_m, static_k):
    """Up to 115 % corrected fan speed at Mach 0.45."""
    fuel = 0.177 * corrected * static_pressure_pa(altitude_m) / SEA_LEVEL_PA * np.sqrt(static_k / 288.15)
    assert net_thrust_n(fuel * 1.02, mach, altitude_m, static_k) > net_thrust_n(fuel, mach, altitude_m, static_k)


def test_thrust_falls_with_speed():
    assert net_thrust_n(0.1, 0.4, 3000.0, 270.0) < net_thrust_n(0.1, 0.0, 3000.0, 270.0)


def test_idle_to_95_percent_of_take_off_thrust_takes_8_to_13_seconds():
    thrust_n = static_thrust(spool_up())
    assert 8.0 < 0.05 * np.argmax(thrust_n > 0.95 * thrust_n[-1]) < 13.0


def test_an_engine_that_stands_still_gives_nothing():
    assert static_thrust([0.0, 0.0, 4.0, 4.0]).tolist() == [0.0] * 4


@pytest.mark.parametrize("seed", range(20))
def test_every_engine_is_two_to_four_percent_off(seed):
    health = draw_health(np.random.default_rng(seed), 0)
    assert 0.02 <= abs(health.bias) <= 0.04
    steady = [90.0] * 10
    assert static_thrust(steady, health)[0] / static_thrust(steady)[0] - 1 == pytest.approx(health.bias, abs=1e-3)


def test_a_lead_shows_in_transients_only():
    lead = Health(0.0, 0.0, 0.4, 1.0)
    n1 = spool_up()
    difference_n = static_thrust(n1, lead) - static_thrust(n1)
    assert difference_n.max() > 300
    assert abs(difference_n[-1]) < 1


@pytest.mark.parametrize("lead_s", [-0.4, 0.4])
def test_a_throttle_that_is_cut_takes_thrust_from_the_first_moment_on_and_never_leaps(lead_s):
    n1 = np.interp(np.arange(60) / 20, (0.5, 2.5), (95.0, 40.0))
    cut_n, plain_n = static_thrust(n1, Health(0.0, 0.0, lead_s, 1.0)), static_thrust(n1)
    assert np.diff(cut_n[:50]).max() < 1e-9  # until the speed rests
    assert np.diff(cut_n).min() > 2.0 * np.diff(plain_n).min()


def test_drift_grows_with_time():
    drifting = Health(0.0, 0.01, 0.0, 1.0)
    thrust_n = static_thrust([90.0, 90.0], drifting, np.array([0.0, 3600.0]))
    assert thrust_n[1] / thrust_n[0] == pytest.approx(1.01)


def test_fuel_ratio_finds_the_thirsty_engine():
    time_s = np.arange(200) / 10
    n1, mach, altitude_m = np.full(200, 80.0), np.full(200, 0.3), np.full(200, 3000.0)
    fuel = 1.06 * steady_fuel_kg_s(n1, mach, altitude_m, np.full(200, 270.0))
    assert fuel_ratio(time_s, n1, fuel, mach, altitude_m, np.full(200, 270.0)) == pytest.approx(1.06)
