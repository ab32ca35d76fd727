"""Softening by the mount's own oscillation: as much as its amplitude says, gone when it has healed."""

import numpy as np
import pytest

from thrustd.model.effects import effect_named

P = {"softening": 0.1, "amplitude_c_mm": 0.05, "exponent_m": 0.5, "slow_s": 1.0, "breakdown_s": 5.0, "recovery_s": 5.0}
DT_S = 0.01
T = np.arange(0.0, 120.0, DT_S)


def softened(parameters, d):
    effect = effect_named("payne_own")
    return 1.0 - effect.stage(effect.neutral() | parameters, DT_S).from_rest({"deformation_mm": d}, np.ones(len(d)))


@pytest.mark.parametrize("amplitude_mm", [0.02, 0.05, 0.2])
def test_a_sine_of_that_amplitude_breaks_what_kraus_says(amplitude_mm: float):
    found = softened(P, 0.7 + amplitude_mm * np.sin(2 * np.pi * 2.0 * T))
    expected = 0.1 * amplitude_mm / (amplitude_mm + 0.05)
    assert found[-500:].mean() == pytest.approx(expected, rel=0.02)


def test_it_heals_in_its_own_time():
    shaken = 0.7 + 0.1 * np.sin(2 * np.pi * 2.0 * T) * (T < 60.0)
    slow, quick = (softened(P | {"recovery_s": s}, shaken) for s in (50.0, 5.0))
    end = np.searchsorted(T, 80.0)
    assert slow[end] > 2.0 * quick[end]
    assert quick[-1] < 0.02 * quick[np.searchsorted(T, 59.0)]


def test_a_steady_load_breaks_nothing():
    assert not softened(P, np.full(len(T), 0.9)).any()
