"""The mixture's median and band."""

import numpy as np
import pytest
from scipy.stats import norm

from thrustd.fusion.mixture import Weighed, mix


def test_one_hypothesis_is_left_as_it_is():
    assert mix(3000.0, 40.0, Weighed(np.array([[1.0, 0.0, 0.0]]), 0, 0.0, np.ones(1))) == (3000.0, 40.0)


@pytest.mark.parametrize("p", [0.005, 0.02, 0.1, 0.3, 0.5])
def test_the_band_is_the_mixture_s(p):
    rows = np.array([[1.0 - p, 0.0, 1.0], [p, -400.0, 100.0]])
    thrust_n, std_n = mix(3000.0, 40.0, Weighed(rows, 0, 0.0, np.ones(2)))

    def below(x_n):
        return (1.0 - p) * norm.cdf(x_n, 3000.0, 40.0) + p * norm.cdf(x_n, 2600.0, 100.0)

    assert below(thrust_n) == pytest.approx(0.5, abs=1e-3)
    ends = [max(below(thrust_n - z * std_n), 1.0 - below(thrust_n + z * std_n)) / norm.sf(z) for z in (1.96, 3.0)]
    assert max(ends) == pytest.approx(1.0, abs=0.02)  # 95 % or three sigmas, whichever is further out; none is beyond


def test_an_unlikely_one_does_not_pull_the_thrust_but_widens_the_band():
    thrust_n, std_n = mix(
        3000.0, 40.0, Weighed(np.array([[0.92, 0.0, 1.0], [0.08, -600.0, 100.0]]), 0, 0.0, np.ones(2))
    )
    assert abs(thrust_n - 3000.0) < 10.0 and std_n > 200.0


def test_what_nobody_corrected_widens_those_that_take_the_mounts_word():
    """The estimate stays; a hypothesis that the mounts are off says the same errors and has them once."""
    rows = np.array([[0.9, 0.0, 1.0], [0.1, -400.0, 200.0]])
    (bare_n, _), (thrust_n, std_n) = (
        mix(3000.0, 40.0, Weighed(rows, 0, u, np.array([1.0, 0.0]))) for u in (0.0, 300.0)
    )
    assert thrust_n == bare_n

    def below(x_n):
        return 0.9 * norm.cdf(x_n, 3000.0, np.hypot(40.0, 300.0)) + 0.1 * norm.cdf(x_n, 2600.0, 200.0)

    ends = [max(below(thrust_n - z * std_n), 1.0 - below(thrust_n + z * std_n)) / norm.sf(z) for z in (1.96, 3.0)]
    assert max(ends) == pytest.approx(1.0, abs=0.02)
    alone = Weighed(np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), 0, 300.0, np.ones(2))
    assert mix(3000.0, 40.0, alone) == (3000.0, pytest.approx(np.hypot(40.0, 300.0)))


def test_what_was_said_of_an_engine_while_it_ran_says_nothing_once_it_is_off():
    rows = np.array([[0.2, 0.0, 1.0], [0.8, 300.0, 90.0]])
    assert mix(-430.0, 800.0, Weighed(rows, 0, 400.0, np.ones(2)), True) == (-430.0, 800.0)


def test_what_filter_and_bank_are_apart_by_is_in_the_band_of_each_and_moves_no_estimate():
    rows = np.array([[0.9, 0.0, 1.0], [0.1, -400.0, 200.0]])
    weighed = Weighed(rows, 0, 300.0, np.array([1.0, 0.0]))
    (bare_n, narrow_n), (thrust_n, wide_n) = (mix(3000.0, 40.0, weighed, False, apart_n) for apart_n in (0.0, -500.0))
    assert thrust_n == bare_n and wide_n > max(narrow_n, 500.0)
    alone = Weighed(np.array([[1.0, 0.0, 0.0]]), 0, 0.0, np.ones(1))
    assert mix(3000.0, 40.0, alone, False, 30.0) == (3000.0, pytest.approx(50.0))
