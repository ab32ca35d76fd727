"""Steps that go no further than their slopes are true for."""

import numpy as np
import pytest

from thrustd.identify.regression.bounds import bounded, inverse, within_reach


def test_what_is_held_lets_the_others_go_where_they_belong_beside_it() -> None:
    """One number wants to go to 17; it may go to 1, and its neighbour makes up for that."""
    matrix, right = np.array([[2.0, 1.0], [1.0, 3.0]]), np.array([2.0 * 17.0 + 4.0, 17.0 + 12.0])
    reach = np.array([-1.0, -np.inf]), np.array([1.0, np.inf])
    target, free = within_reach(matrix, right, np.zeros(2, bool), reach)
    assert np.allclose(target, [1.0, (right[1] - 1.0) / 3.0], rtol=1e-4)
    assert free.all()


def test_a_reach_without_end_holds_nothing() -> None:
    matrix, right = np.diag([1.0, 4.0]), np.array([30.0, -8.0])
    target, _ = within_reach(matrix, right, np.array([False, True]), (np.full(2, -np.inf), np.full(2, np.inf)))
    assert np.allclose(target, [30.0, 0.0])


def test_the_inverse_of_what_is_known_of_numbers_of_any_size():
    size = np.array([1e-7, 1.0, 1e6, 1e3])
    root = np.random.default_rng(0).standard_normal((4, 4))
    information = root @ root.T
    expected = np.linalg.inv(information) / np.outer(size, size)
    assert inverse(information * np.outer(size, size)) == pytest.approx(expected, rel=1e-6)
    twice = np.array([[1.0, 1.0], [1.0, 1.0]])  # of two numbers only their sum is known
    assert np.ones(2) @ inverse(twice) @ np.ones(2) == pytest.approx(1.0)


def test_numbers_that_rounding_left_without_a_minimum_have_one():
    """Two that act alike, less than nothing apart: on one processor, not on another, this ended a search."""
    matrix = np.array([[1.0, 1.0], [1.0, 1.0 - 1e-10]])
    found, _ = bounded(matrix, np.array([2.0, 2.0]), np.array([True, True]))
    assert found.min() >= 0.0
    assert found.sum() == pytest.approx(2.0, rel=1e-6)
