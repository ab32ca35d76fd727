"""The simulated isolator behaves like the rubber it stands for."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from thrustd.twin.mount import LOWER, UPPER, advance, at_rest

FRICTIONLESS = UPPER._replace(friction_n=(), friction_mm=())


def hold(mount, force_n, seconds, sample_hz=20.0, **channels):
    ramp = np.linspace(0, force_n, round(sample_hz))
    forces = np.concatenate((ramp, np.full(round(seconds * sample_hz), force_n)))
    return advance(mount, at_rest(mount), forces, 1 / sample_hz, **channels)


@pytest.mark.parametrize(("mount", "spring_n_mm"), [(UPPER, 5079), (LOWER, 5954)])
def test_settled_spring_rate_is_the_catalogues(mount, spring_n_mm):
    force_n = 0.8 * spring_n_mm
    settled = hold(mount._replace(friction_n=(), friction_mm=()), force_n, 100e3, 1.0)[-1]
    assert settled == pytest.approx(0.8, rel=0.01)


def test_a_few_kilonewtons_give_about_a_millimetre():
    assert hold(UPPER, 5500.0, 600)[-1] == pytest.approx(1.03, abs=0.05)


def test_forward_thrust_is_positive_and_the_mount_is_symmetric():
    assert hold(UPPER, 2000.0, 10)[-1] > 0
    assert hold(UPPER, -2000.0, 10) == pytest.approx(-hold(UPPER, 2000.0, 10))


def test_it_creeps_under_constant_force():
    mm = hold(UPPER, 5000.0, 600)
    assert (np.diff(mm[20:]) >= -1e-9).all()
    assert mm[-1] - mm[20] > 0.02


def test_it_stiffens():
    assert hold(UPPER, 6000.0, 60)[-1] < 2.9 * hold(UPPER, 2000.0, 60)[-1]


def test_dynamic_stiffness_exceeds_static_by_table_4_2():
    sample_hz = 1000.0
    time_s = np.arange(4000) / sample_hz
    small_n = 20 * np.sin(2 * np.pi * 20 * time_s)
    mm = advance(FRICTIONLESS, at_rest(FRICTIONLESS), small_n, 1 / sample_hz)[2000:]
    stiffness = 20 / ((mm.max() - mm.min()) / 2)
    assert stiffness / FRICTIONLESS.stiffness_n_mm == pytest.approx(1.2, abs=0.06)


def test_a_small_force_without_friction_superposes():
    rng = np.random.default_rng(0)
    first, second = rng.normal(size=(2, 500)) * 5
    run = lambda force_n: advance(FRICTIONLESS, at_rest(FRICTIONLESS), force_n, 0.05)  # noqa: E731
    assert run(first + second) == pytest.approx(run(first) + run(second), abs=1e-8)


def test_friction_leaves_a_loop_that_time_does_not_close():
    levels = np.repeat([2000.0, 6000.0, 2000.0], 20000)
    with_friction = advance(UPPER, at_rest(UPPER), levels, 0.1)
    without = advance(FRICTIONLESS, at_rest(FRICTIONLESS), levels, 0.1)
    loop_mm = with_friction[59999] - with_friction[19999]
    assert loop_mm > without[59999] - without[19999] + 0.02


@settings(max_examples=20, deadline=None)
@given(st.lists(st.floats(-8000, 8000), min_size=1, max_size=50), st.sampled_from([0.001, 0.01, 0.05, 1.0]))
def test_the_solved_deformation_carries_the_force(forces, dt_s):
    """Ramps to any force: the elastic, relaxing and slipping parts add up to it."""
    state = at_rest(UPPER)
    advance(UPPER, state, np.array(forces), dt_s)
    carried = state.scalar[1] + np.dot(UPPER.relaxation, state.relaxing) + state.friction.sum()
    assert carried == pytest.approx(forces[-1], abs=1e-3)


@pytest.mark.parametrize("sample_hz", [20.0, 1000.0])
def test_any_rate_tells_the_same_story(sample_hz):
    def run(rate_hz):
        time_s = np.arange(1, round(60 * rate_hz) + 1) / rate_hz
        return advance(UPPER, at_rest(UPPER), 3000 * (1 - np.cos(0.3 * time_s)), 1 / rate_hz)[-1]

    assert run(sample_hz) == pytest.approx(run(100.0), abs=1e-3)


def test_blocks_join_without_a_seam():
    forces = 3000 + 2000 * np.sin(np.arange(3000) / 50)
    state = at_rest(UPPER)
    parts = [advance(UPPER, state, piece, 0.01) for piece in np.split(forces, [700, 1999])]
    assert np.array_equal(np.concatenate(parts), advance(UPPER, at_rest(UPPER), forces, 0.01))


def test_engine_weight_effect_of_the_thesis():
    """500 N more on a mount that carries 1081 N at 1 g: about 5 um less at 6 kN."""
    more_g = 500 / 1081
    change_mm = hold(UPPER, 6000.0, 60, accel_z_g=1 + more_g)[-1] - hold(UPPER, 6000.0, 60)[-1]
    assert change_mm == pytest.approx(-0.005, abs=0.0005)


def test_warmth_changes_little():
    change_mm = hold(UPPER, 5000.0, 60, temperature_degc=60.0)[-1] - hold(UPPER, 5000.0, 60)[-1]
    assert 0 < change_mm < 0.02


def test_dahl_friction_and_damping_resist():
    rubbed = FRICTIONLESS._replace(dahl_n=300.0, dahl_n_mm=10000.0)
    damped = FRICTIONLESS._replace(damping_n_s_mm=500.0)
    plain = hold(FRICTIONLESS, 3000.0, 5)
    assert hold(rubbed, 3000.0, 5)[-1] < plain[-1] - 0.02
    assert hold(damped, 3000.0, 5)[19] < plain[19] - 0.02
    assert hold(damped, 3000.0, 5)[-1] == pytest.approx(plain[-1], abs=1e-3)
