"""Steps that go no further than their slopes are true for."""

import numpy as np

from thrustd.identify.regression.bounds import within_reach


def test_what_is_held_lets_the_others_go_where_they_belong_beside_it() -> None:
    """One number wants to go to 17; it may go to 1, and its neighbour makes up for that."""
    matrix, right = np.array([[2.0, 1.0], [1.0, 3.0]]), np.array([2.0 * 17.0 + 4.0, 17.0 + 12.0])
    reach = np.array([1.0, np.inf])
    target, free = within_reach(matrix, right, np.zeros(2, bool), np.zeros(2), reach)
    assert np.allclose(target, [1.0, (right[1] - 1.0) / 3.0], rtol=1e-4)
    assert free.all()


def test_a_reach_without_end_holds_nothing() -> None:
    matrix, right = np.diag([1.0, 4.0]), np.array([30.0, -8.0])
    target, _ = within_reach(matrix, right, np.array([False, True]), np.zeros(2), np.full(2, np.inf))
    assert np.allclose(target, [30.0, 0.0])
