"""Mullins softening of the whole force by Ogden and Roxburgh."""

import math

import numpy as np
import pytest

from thrustd.model.effects import effect_named

SOFTENING, M_MM, BETA = 0.1, 0.3, 0.4


def test_it_comes_back_as_far_below_the_maximum_as_its_two_lengths_say() -> None:
    """s erf((W_max - W) / (m^2 + beta W_max)) after loads of 0.5 and 2 mm, on the way back and at nothing."""
    effect = effect_named("mullins_softening")
    p = effect.neutral() | {"softening": SOFTENING, "m_mm": M_MM, "beta": BETA}
    x_mm = np.array([0.0, 0.5, 0.0, 1.0, 2.0, 1.0, 0.0])
    stage = effect.stage(p, 0.05)
    gain = stage.run(stage.start(x_mm[:1], 1.0), x_mm[:, None], np.ones(len(x_mm)))
    largest = np.maximum.accumulate(x_mm)
    away = (largest**2 - x_mm**2) / (M_MM**2 + BETA * largest**2)
    assert gain == pytest.approx([1.0 - SOFTENING * math.erf(w) for w in away])
    assert gain[[0, 1, 3, 4]] == pytest.approx(1.0)  # virgin
