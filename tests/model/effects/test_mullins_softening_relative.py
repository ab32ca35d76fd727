"""Damage that grows with the largest deformation, and damage by the share of it alone."""

import numpy as np
import pytest

from thrustd.model.effects import effect_named

X = np.concatenate((np.linspace(0.0, 1.0, 50), np.linspace(1.0, 0.2, 50), np.linspace(0.2, 1.2, 50)))
X_MAX = np.maximum.accumulate(X)


def kept(law, **shapes):
    stage = effect_named(law).stage({"softening": 0.1, "known_max_mm": 0.0, **shapes}, 0.05)
    return stage.run(stage.start(X[:1], 1.0), X[:, None], np.ones(len(X)))


def test_the_way_grows_with_the_maximum():
    found = kept("mullins_softening_relative", m_mm=0.1, beta=0.4, exponent=1.5)
    assert found == pytest.approx(1.0 - 0.1 * (1.0 - np.exp(-(((X_MAX - X) / (0.1 + 0.4 * X_MAX)) ** 1.5))), rel=1e-12)
    assert np.all(found[X >= X_MAX] == 1.0) and found.min() < 0.95


@pytest.mark.parametrize("exponent", [0.5, 1.0, 2.0])
def test_the_same_share_softens_alike_below_every_maximum(exponent):
    found = kept("mullins_softening_ratio", exponent=exponent)
    share = np.divide(X, X_MAX, out=np.ones(len(X)), where=X_MAX > 0.0)
    assert found == pytest.approx(1.0 - 0.1 * (1.0 - share**exponent), rel=1e-12)


def test_the_share_is_the_limit_of_a_way_that_grows():
    near = kept("mullins_softening_relative", m_mm=1e-9, beta=200.0, exponent=1.0, softening=0.2)
    share = kept("mullins_softening_ratio", exponent=1.0, softening=0.2 / 200.0)
    assert near == pytest.approx(share, abs=1e-5)


def test_what_is_broken_is_missed_on_a_new_way_too():
    found = kept("mullins_softening_damage", m_mm=0.5, exponent=2.0)
    assert found == pytest.approx(1.0 - 0.1 * (1.0 - np.exp(-((X_MAX / 0.5) ** 2.0))), rel=1e-12)
    assert np.all(np.diff(found) <= 0.0)
