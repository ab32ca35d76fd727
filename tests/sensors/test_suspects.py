"""Since when a fault has been the likeliest: named when its sensor's own watch has seen enough, never twice."""

import numpy as np

from thrustd.sensors.onsets import FUEL_OFF, MOUNTS_OFF, N_HYPOTHESES, WELL
from thrustd.sensors.suspects import NAMED_AFTER_S, Suspects


def at(s):
    return round(s * 1e9)


def likeliest(which):
    rows = np.zeros((1, N_HYPOTHESES, 3))
    rows[0, which, 0], rows[0, WELL, 0] = 0.9, 0.1
    return rows


def test_a_fault_that_was_likely_for_long_is_named_as_soon_as_it_is_found():
    nobody, found = np.array([WELL]), np.array([FUEL_OFF])
    suspects = Suspects(nobody)
    suspects.look(at(10.0), nobody, likeliest(FUEL_OFF))
    suspects.look(at(11.0), nobody, likeliest(FUEL_OFF))
    assert suspects.nameable(at(11.0), nobody) == [WELL]
    suspects.look(at(10.1 + NAMED_AFTER_S), found, likeliest(FUEL_OFF))
    assert suspects.nameable(at(10.1 + NAMED_AFTER_S), found) == [FUEL_OFF]


def test_a_fault_that_is_found_at_once_waits_for_its_sensors_own_watch():
    found = np.array([MOUNTS_OFF])
    suspects = Suspects(np.array([WELL]))
    suspects.look(at(10.0), found, likeliest(MOUNTS_OFF))
    assert suspects.nameable(at(9.9 + NAMED_AFTER_S), found) == [WELL]
    assert suspects.nameable(at(10.1 + NAMED_AFTER_S), found) == [MOUNTS_OFF]


def test_another_fault_waits_anew_and_one_that_was_found_stays_named():
    mounts, fuel = np.array([MOUNTS_OFF]), np.array([FUEL_OFF])
    suspects = Suspects(mounts)  # as after a restart
    suspects.look(at(10.0), mounts, likeliest(FUEL_OFF))
    assert suspects.nameable(at(10.0), mounts) == [MOUNTS_OFF]
    suspects.look(at(12.0), fuel, likeliest(FUEL_OFF))
    assert suspects.nameable(at(12.0), fuel) == [WELL]
