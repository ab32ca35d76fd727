"""Static curves beyond their ends."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from thrustd.model.curves import polynomial

CENTRE, SCALE, COEFFICIENTS = 2.0, 0.5, np.array([1.0, -2.0, 0.5, 3.0])


def through(v):
    curve = polynomial("curve", CENTRE, SCALE, COEFFICIENTS)
    v = np.atleast_1d(np.asarray(v, float))
    return curve.run(curve.start(np.empty(0), float(v[0])), np.empty((len(v), 0)), v)


def test_a_polynomial_is_itself_within_its_range():
    z = np.linspace(-1, 1, 21)
    assert through(CENTRE + SCALE * z) == pytest.approx(np.polynomial.polynomial.polyval(z, COEFFICIENTS), abs=1e-12)


@given(st.floats(0.0, 1e6), st.sampled_from([-1.0, 1.0]))
def test_a_polynomial_goes_straight_on_beyond_it(further, side):
    slope = np.polynomial.polynomial.polyval(side, np.polynomial.polynomial.polyder(COEFFICIENTS))
    end = np.polynomial.polynomial.polyval(side, COEFFICIENTS)
    found = through(CENTRE + SCALE * side * (1 + further))[0]
    assert found == pytest.approx(end + slope * side * further, rel=1e-9, abs=1e-9)
