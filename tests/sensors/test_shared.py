"""What is wrong on all engines at once, on rows whose fault is known: the accelerometer, air data, or one engine."""

import numpy as np

from tests.sensors.test_evidence import INSTALLED, SHARE, flown
from thrustd.sensors import evidence, onsets
from thrustd.sensors.past import AIR_MACH, ALONG_G, T_S
from thrustd.sensors.shared import weigh_shared

MOUNTS, BROCHURE = np.array((SHARE, 1 - SHARE, 0, 0, 0)), np.array((0, 0, 1.0, 1.0, 1.0))
IDLE_N, BEGINS_S = 600.0, 300.0


def weighed(left, right, seconds, along_g=0.0):
    """(2, N_HYPOTHESES): probabilities so many seconds after the faults began, of each engine the time -> (5,).

    `along_g`: what the accelerometer has shown since then, of which the Mach number shows nothing.
    """
    heard, out = np.zeros(2, onsets.HEARD), np.zeros((2, onsets.N_HYPOTHESES, 3))
    for fault_of, said, row in zip((left, right), heard, out, strict=True):
        seen = flown(lambda t_s, of=fault_of: of(t_s - BEGINS_S), BEGINS_S + seconds, lambda t_s: IDLE_N)
        *_, (rows, n) = seen
        rows[:, ALONG_G] = along_g * (rows[:, T_S] > BEGINS_S)
        rows[:, AIR_MACH] = along_g * 9.81 / 340.0 * np.maximum(rows[:, T_S] - BEGINS_S, 0.0)
        evidence.weigh(rows, n, SHARE, onsets.WELL, INSTALLED, said, row)
    for e in range(2):
        weigh_shared(heard, e, onsets.WELL, out[e])
    assert np.allclose(out[:, :, 0].sum(axis=1), 1.0)
    return out[:, :, 0]


def healthy(since_s):
    return 0.0 * MOUNTS


def test_an_accelerometer_that_jumps_is_wrong_on_both_engines_at_once():
    """Not the mounts of both engines; nor air data, which say the same as before and miss no such acceleration."""
    for g in (-0.05, 0.05):
        p = weighed(*2 * [lambda since_s, n=3660.0 * g: n * (since_s > 0) * MOUNTS], 1.2, g)
        assert (p[:, onsets.ACCELERATION_OFF] > 0.99).all()


def test_the_mounts_of_one_engine_are_no_accelerometer():
    p = weighed(lambda since_s: 400.0 * (since_s > 0) * MOUNTS, healthy, 6.0)
    assert p[0].argmax() == onsets.MOUNTS_OFF and p[0, onsets.MOUNTS_OFF] > 0.9
    assert p[1, onsets.WELL] > 0.9


def test_a_mach_number_that_freezes_in_a_roll_is_no_accelerometer():
    """What no accelerometer does: 100 N a second, on both engines."""
    p = weighed(*2 * [lambda since_s: 100.0 * max(since_s, 0.0) * BROCHURE], 6.0, 0.35)
    assert (p[:, onsets.AIR_OFF] > 0.9).all()


def test_engines_that_are_well_share_nothing():
    p = weighed(healthy, healthy, 10.0)
    assert (p[:, onsets.ACCELERATION_OFF :] < 1e-3).all() and (p[:, onsets.WELL] > 0.9).all()
