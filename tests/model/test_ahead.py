"""Reading ahead by parts of a sample."""

import numpy as np
import pytest

from thrustd.model.ahead import ahead

T = np.arange(600, dtype=float)


@pytest.mark.parametrize("samples", [-3.25, 0.0, 0.5, 4.0, 17.8])
def test_a_slow_signal_is_itself_later(samples):
    def signal(t):
        return np.sin(2 * np.pi * t / 9.0) + np.cos(2 * np.pi * t / 83.0)

    assert ahead(signal(T), samples)[60:-60] == pytest.approx(signal(T + samples)[60:-60], abs=2e-3)


def test_no_lateness_is_the_signal_and_ends_are_held():
    v = np.random.default_rng(0).normal(size=400)
    assert ahead(v, 0.0) == pytest.approx(v, abs=1e-12)
    assert ahead(v, 2.0) == pytest.approx(np.concatenate((v[2:], v[-1:], v[-1:])), abs=1e-12)
    assert ahead(np.full(5, 3.0), 0.4) == pytest.approx(np.full(5, 3.0))


def test_noise_passes_alike_wherever_it_is_read():
    noise = np.random.default_rng(1).normal(size=200_000)
    assert min(float(np.std(ahead(noise, part))) for part in (0.25, 0.5, 0.75)) > 0.97
