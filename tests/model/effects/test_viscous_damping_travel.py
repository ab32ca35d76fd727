"""Damping over the travel: as much as the two sizes say at either end, and never a drive."""

import numpy as np
import pytest

from thrustd.model.effects.viscous_damping import EFFECT as EVEN
from thrustd.model.effects.viscous_damping_travel import EFFECT

DT_S = 0.01


def _force(effect, p, x):
    stage = effect.stage(p, DT_S)
    return stage.run(stage.start(np.array([x[0]]), 0.0), x[:, None], np.zeros(len(x)))


def test_at_either_end_it_is_a_dashpot():
    x = np.arange(0.0, 1.0, 1e-4)
    p = {"damping_n_s_mm": 100.0, "change_n_s_mm": -60.0, "filter_s": 0.05, "range_mm": 1.0}
    force = _force(EFFECT, p, x)
    assert force[200] == pytest.approx((100.0 - 60.0 * x[200]) * 0.01, rel=0.03)
    assert force[-1] == pytest.approx(40.0 * 0.01, rel=0.01)
    same = p | {"change_n_s_mm": 0.0}
    np.testing.assert_array_equal(_force(EFFECT, same, x), _force(EVEN, {"damping_n_s_mm": 100.0, "filter_s": 0.05}, x))


def test_it_never_drives():
    x = np.cumsum(np.random.default_rng(3).normal(0.0, 0.02, 3000))
    p = {"damping_n_s_mm": 10.0, "change_n_s_mm": -80.0, "filter_s": 0.001, "range_mm": 0.5}
    force = _force(EFFECT, p, x)
    assert (force[1:] * np.diff(x) >= -1e-12).all()
