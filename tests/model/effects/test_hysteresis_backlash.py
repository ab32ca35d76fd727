"""Friction behind a free play against a slider that a spring with a gap drags along."""

import numpy as np
import pytest

from thrustd.model.effects.hysteresis_backlash import EFFECT

FRICTION_N, YIELD_MM, PLAY_MM = 800.0, 0.4, 1.5


def damper(x: np.ndarray, friction_n: float, yield_mm: float, play_mm: float) -> np.ndarray:
    """Force (n,) of readings x (n,), mm: the slider stays until the spring would hold more than the friction."""
    slider, force = 0.0, []
    for at in x:
        slider = min(max(slider, at - play_mm - yield_mm), at + play_mm + yield_mm)
        away = at - slider
        stretched = away - min(max(away, -play_mm), play_mm)
        force.append(friction_n * stretched / yield_mm)
    return np.array(force)


def test_force_is_that_of_a_slider_dragged_by_a_spring_with_a_gap():
    x = np.cumsum(np.random.default_rng(1).normal(0.0, 0.3, 500))
    x -= x[0]
    stage = EFFECT.stage({"friction_n": FRICTION_N, "yield_mm": YIELD_MM, "play_mm": PLAY_MM}, 0.01)
    state = stage.start(x[:1], 50.0)
    found = np.array([stage.step(state, stage.c, x[k : k + 1], 50.0) for k in range(len(x))])
    expected = damper(x, FRICTION_N, YIELD_MM, PLAY_MM)
    assert found - 50.0 == pytest.approx(expected, abs=1e-9 * FRICTION_N)
    assert expected.max() == pytest.approx(FRICTION_N)
    assert np.count_nonzero(expected == 0.0) > 50  # in the gap
