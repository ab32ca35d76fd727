"""Motion in measures of the record's own: the same in millimetres and seconds as in centimetres and hours."""

import numpy as np
import pytest

from thrustd.diagnose.compare.motion import motion_of, thinned

DT_S = 0.05


def steps(noise=3e-4, seed=0):
    """Ramps of two seconds to 0.8, 0.3, 1.0, 0.5 mm, each held for 28 s."""
    x = np.interp(np.arange(2400) * DT_S, [0, 2, 30, 32, 60, 62, 90, 92, 120], [0, 0.8, 0.8, 0.3, 0.3, 1, 1, 0.5, 0.5])
    return x + np.random.default_rng(seed).normal(0, noise, len(x))


def test_holds_are_told_from_ramps_and_remember_the_last_movement():
    motion = motion_of(steps(), DT_S)
    assert motion.moving.mean() == pytest.approx(8 / 120, abs=0.02)
    assert [motion.direction[round(t / DT_S)] for t in (20, 50, 80, 110)] == [1, -1, 1, -1]
    assert motion.held_s[round(20 / DT_S)] == pytest.approx(18, abs=1)
    assert motion.since_s[round(50 / DT_S)] == pytest.approx(20, abs=0.5)
    assert motion.travel[-1] == pytest.approx(2.5, abs=0.05)
    assert motion.stroke == pytest.approx(0.7, abs=0.2)
    assert motion.newest[round(61.8 / DT_S)] and not motion.newest[round(45 / DT_S)]


@pytest.mark.parametrize(("length", "time"), [(1e-3, 1.0), (25.4, 3600.0), (1.0, 1e-3)])
def test_nothing_depends_on_units(length, time):
    one, other = motion_of(steps(), DT_S), motion_of(steps() * length, DT_S * time)
    assert np.mean(one.moving == other.moving) > 0.999
    assert np.array_equal(one.direction, other.direction)
    assert other.typical == pytest.approx(one.typical * length / time)


@pytest.mark.parametrize("column", [np.zeros(50), np.ones(3), np.array([0.0]), np.arange(30.0)])
def test_odd_records_have_a_motion(column):
    motion = motion_of(column, 1.0)
    assert len(motion.moving) == len(column) and np.isfinite(motion.velocity).all()
    assert len(thinned(motion, 7).since_s) == -(-len(column) // 7)
