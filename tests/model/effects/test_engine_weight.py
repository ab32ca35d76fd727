"""What normal load does to a mount: a couple on the force, a stretch of the reading."""

import numpy as np
import pytest

from thrustd.model.effects import effect_named

NORMAL_G = np.array([1.0, 1.5, 0.0, 2.0])


def run(law, v, **told):
    stage = effect_named(law).stage(effect_named(law).neutral() | told, 0.05)
    return stage.run(stage.start(NORMAL_G[:1], v[0]), NORMAL_G[:, None], v)


def test_a_couple_is_the_same_at_every_thrust():
    for force_n in (0.0, 5000.0):
        found = run("engine_weight_couple", np.full(4, force_n), couple_n_g=300.0)
        assert found - force_n == pytest.approx([0.0, -150.0, 300.0, -300.0])


def test_a_stretch_grows_where_the_spring_is_stiffer():
    found = run("engine_weight_shift", np.full(4, 2.0), stretch_1_g=0.01, more_1_g_mm2=0.005)
    assert 1.0 - 2.0 / found == pytest.approx(0.03 * (NORMAL_G - 1.0))


def test_a_late_stiffening_settles_where_its_square_says():
    force = run("engine_weight_late", np.full(4, 5000.0), stiffening_1_n=1e-5, lag_s=1e-3, bend=0.5)
    m = NORMAL_G - 1.0
    assert force == pytest.approx(5000.0 * (1.0 + 1e-5 * 1081.0 * (m + 0.5 * m * m)), rel=1e-9)


def test_a_stiffening_comes_as_late_as_it_says():
    effect = effect_named("engine_weight_late")
    stage = effect.stage(effect.neutral() | {"stiffening_1_n": 1e-5, "lag_s": 2.0}, 0.05)
    normal_g = np.r_[1.0, np.full(40, 2.0)]
    found = stage.run(stage.start(normal_g[:1], 1.0), normal_g[:, None], np.ones(41)) - 1.0
    assert found[[0, 40]] == pytest.approx([0.0, 1e-5 * 1081.0 * (1.0 - np.exp(-1.0))])
