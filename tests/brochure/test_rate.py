"""The rate of a signal that comes in samples."""

from math import isnan, nan

import pytest

from thrustd.brochure.rate import smooth_rate


def test_the_rate_of_a_ramp_is_its_slope():
    lagged = nan
    for k in range(200):
        rate, lagged = smooth_rate(lagged, 0.1 * k, 0.02)
    assert rate == pytest.approx(5.0, rel=0.05)
    rate, lagged = smooth_rate(lagged, nan, 0.02)
    assert isnan(rate)
    assert smooth_rate(lagged, 50.0, 0.02)[0] == 0.0
