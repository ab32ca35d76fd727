"""Engines and sources against each other."""

from math import isnan, nan

import pytest

from thrustd.core.types import Estimate
from thrustd.sensors.cross_check import cross_checks


def estimate(engine, thrust_n, mount_n=nan, brochure_n=nan):
    return Estimate(7, engine, thrust_n, 50, 0, mount_n, 60, brochure_n, 90, nan, nan, nan, 0, 0, 0.5, 0)


def test_each_engine_is_told_what_its_sources_and_the_others_say():
    left, right = cross_checks([estimate(0, 5000.0, 5100.0, 4900.0), estimate(1, 4800.0, 4850.0)])
    assert (left.t_ns, left.engine, left.source_residual_n, left.asymmetry_n) == (7, 0, 200.0, 200.0)
    assert (right.engine, right.asymmetry_n) == (1, -200.0)
    assert isnan(right.source_residual_n)


def test_of_three_engines_each_is_compared_with_the_mean_of_the_others():
    asymmetries_n = [check.asymmetry_n for check in cross_checks([estimate(i, n) for i, n in enumerate((3, 4, 8))])]
    assert asymmetries_n == pytest.approx([-3.0, -1.5, 4.5])


def test_a_single_engine_has_nobody_to_be_compared_with():
    (alone,) = cross_checks([estimate(0, 5000.0, 5100.0, 4900.0)])
    assert isnan(alone.asymmetry_n)
    assert alone.source_residual_n == 200.0
