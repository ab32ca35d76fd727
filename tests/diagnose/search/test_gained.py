"""When a larger set of effects is better against a brochure, whose own error goes with power and throttle."""

from types import SimpleNamespace

import numpy as np

from thrustd.diagnose.search.ranking import gained


def fit(block_mse):
    mse = float(np.mean(block_mse))
    return SimpleNamespace(block_mse=block_mse, block_size=np.full(48, 100.0), mse=mse, by_brochure=True)


def test_one_take_off_does_not_hide_a_gain_in_nearly_every_block():
    removed = np.abs(50.0 * np.random.default_rng(1).standard_normal(48))
    removed[5] = 8000.0  # the take-off
    assert gained(fit(300.0 + removed), fit(np.full(48, 300.0)))


def test_a_gain_of_a_few_blocks_beside_as_many_losses_is_none():
    """What the surface of a deck leaves, and a law that happens to be like it in a few blocks."""
    chance = 15.0 * np.random.default_rng(2).standard_normal(48)
    chance[[5, 38, 43]] = 1000.0
    assert not gained(fit(300.0 + chance), fit(np.full(48, 300.0)))
