"""Influence of the numbers of effects in a regression."""

import numpy as np
import pytest

from thrustd.identify.regression.terms import APART, Seen, added, at_start
from thrustd.model.effect import Effect
from thrustd.model.effects import effect_named, shelf


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


@pytest.mark.parametrize("effect", shelf().values(), ids=lambda effect: effect.name)
def test_between_the_walls_of_every_shape_lies_where_it_begins(effect: Effect) -> None:
    """Also of shapes whose bounds have either sign: no wall is without a number."""
    for start in range(max(len(p.starts) for p in effect.parameters)):
        begins = {p.name: p.starts[start % len(p.starts)] for p in effect.parameters if p.starts and not p.amplitude}
        term = at_start(effect, {p.name: 1.0 for p in effect.parameters if p.amplitude}, begins)
        assert np.all(term.walls()[:, 0] <= 0.0)
        assert np.all(term.walls()[:, 1] >= 0.0)


def test_a_shape_at_its_wall_has_the_slope_of_the_side_that_it_may_go_to() -> None:
    """Half the secant would reach beyond: a slope of half the size was taken there."""
    moved = np.cumsum(0.003 * np.random.default_rng(3).standard_normal(5_000))
    term = at_start(effect_named("hysteresis"), {"friction_n": 50.0}, {"yield_mm": 0.03, "deadband_mm": 0.0})
    seen, places = Seen(moved, {"deformation_mm": moved}, 0.05, 0.0), np.arange(len(moved))
    wall = term.walls()[1, 0]
    here, inward = (added(term, np.array([1.0, at]), seen, places)[0] for at in (wall, wall + APART))
    slope = added(term, np.array([1.0, wall]), seen, places)[1][:, 1]
    assert slope == pytest.approx((inward - here) / APART)
