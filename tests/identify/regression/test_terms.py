"""Influence of the numbers of effects in a regression."""

import numpy as np
import pytest

from thrustd.identify.regression.terms import Seen, added, at_start
from thrustd.model.effects import effect_named


@pytest.mark.parametrize("play_mm", [8e-4, 1.5e-3])
def test_slope_of_a_play_around_a_trembling_reading_is_that_of_a_secant(play_mm: float) -> None:
    """A play lets a single tremble through or not: what one of them does is no slope to follow."""
    rng = np.random.default_rng(3)
    moved = np.cumsum(0.003 * rng.standard_normal(20_000)) + 5e-4 * rng.standard_normal(20_000)
    term = at_start(effect_named("hysteresis_berg"), {"friction_n": 50.0}, {"yield_mm": 0.03, "deadband_mm": play_mm})
    seen, numbers = Seen(moved, {"deformation_mm": moved}, 0.05, 0.0), np.array([1.0, 0.0, 0.0])
    places, step = np.arange(len(moved)), np.array([0.0, 0.0, 0.2])
    secant = (added(term, numbers + step, seen, places)[0] - added(term, numbers - step, seen, places)[0]) / 0.4
    slope = added(term, numbers, seen, places)[1][:, 2]
    assert np.std(slope - secant) < np.std(secant)
