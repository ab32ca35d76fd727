"""Measures of error: what is not known does not count, per cent only where the force is large."""

import numpy as np
import pytest

from thrustd.core.measures import percents, rms


def test_rms_leaves_out_what_is_not_known():
    assert rms(np.array([3.0, np.nan, 4.0])) == pytest.approx(np.sqrt(12.5))


def test_percents_are_of_large_forces_only():
    found = percents(np.array([50.0, -30.0, 10.0, np.nan]), np.array([1000.0, -3000.0, 2000.0, 4000.0]))
    assert found.tolist() == [1.0]
    assert percents(np.array([30.0]), np.array([3000.0]), above_n=4000.0).tolist() == []
