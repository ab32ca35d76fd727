"""A canted axis: the engine's mass along the body, and its sine of the vertical beyond 1 g, both late."""

import numpy as np
import pytest

from thrustd.model.effects.axial_inertia import EFFECT as ALIGNED
from thrustd.model.effects.axial_inertia_canted import EFFECT

DT_S = 0.05
P = {"mass_kg": 170.0, "across_kg": 170.0 * np.sin(np.radians(1.0)), "lag_s": 0.2}


def _force(effect, p, u):
    stage = effect.stage(p, DT_S)
    return stage.run(stage.start(u[0], 0.0), u, np.zeros(len(u)))


def test_at_one_g_it_is_the_plain_law():
    u = np.tile([0.1, 1.0], (100, 1))
    np.testing.assert_allclose(_force(EFFECT, P, u), _force(ALIGNED, {"mass_kg": 170.0}, u[:, :1]), rtol=1e-12)


def test_a_pull_up_shows_the_sine_of_the_angle_late():
    u = np.column_stack((np.zeros(100), np.where(np.arange(100) < 20, 1.0, 2.0)))
    force = _force(EFFECT, P, u)
    assert force[19] == 0.0
    assert force[-1] == pytest.approx(P["across_kg"] * 9.80665, rel=1e-6)
    assert force[20 + 4] == pytest.approx(force[-1] * (1.0 - np.exp(-5 * DT_S / 0.2)), rel=1e-6)
