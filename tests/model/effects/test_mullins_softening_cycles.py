"""Damage that takes some cycles of the largest deformation."""

import numpy as np
import pytest

from thrustd.model.effects import effect_named

P = {"softening": 0.2, "m_mm": 0.5, "known_max_mm": 0.0, "exponent": 1.5, "way": 4.0, "deadband_mm": 0.0}
TURN = np.sin(2 * np.pi * np.arange(1000) / 1000)
X = np.concatenate([size * np.tile(TURN, 5) for size in (0.4, 0.8)])


def softened(x=X, **given):
    stage = effect_named("mullins_softening_cycles").stage(P | given, 0.05)
    return 1.0 - stage.from_rest({"deformation_mm": x}, np.ones(len(x)))


def full(size_mm):
    return 0.2 * (1.0 - np.exp(-((size_mm / 0.5) ** 1.5)))


def test_each_cycle_of_one_size_breaks_the_same_share_of_what_is_left():
    left = full(0.4) - softened()[999:5000:1000]
    assert left[1:] / left[:-1] == pytest.approx(np.exp(-4.0 / 4.0), rel=0.01)
    assert np.all(np.diff(softened()) >= 0.0)


def test_many_cycles_end_where_damage_by_the_largest_deformation_is_at_once():
    at_once = effect_named("mullins_softening_damage").stage(P, 0.05).from_rest({"deformation_mm": X}, np.ones(len(X)))
    assert 1.0 - at_once[-1] == pytest.approx(full(0.8), rel=1e-5)
    assert softened(way=0.5)[-1] == pytest.approx(full(0.8), rel=1e-5)


def test_either_side_breaks_alike_and_how_fast_it_moves_is_nothing():
    assert softened(-X) == pytest.approx(softened(), rel=1e-12)
    assert softened(X[::2])[-1] == pytest.approx(softened()[-1], rel=1e-3)


def test_what_was_there_before_is_broken():
    assert softened(known_max_mm=1.0) == pytest.approx(np.full(len(X), full(1.0)), rel=1e-12)


def test_noise_within_the_play_breaks_nothing():
    rng = np.random.default_rng(0)
    still = np.append(0.4 * np.linspace(0.0, 1.0, 100), 0.4 + rng.uniform(-1e-3, 1e-3, 50_000))
    assert softened(still)[-1] == pytest.approx(full(0.4), rel=0.05)
    assert softened(still, deadband_mm=1.1e-3)[-1] == pytest.approx(softened(still[:100])[-1], rel=0.01)
