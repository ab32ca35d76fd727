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
