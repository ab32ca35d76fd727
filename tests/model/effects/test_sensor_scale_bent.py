"""A scale that bends: what a transducer at an angle reads, the effect turns back into the deformation."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from thrustd.model.effects.sensor_scale import EFFECT as STRAIGHT
from thrustd.model.effects.sensor_scale_bent import EFFECT

DT_S = 0.05
READINGS = np.linspace(-3.0, 3.0, 601)


def _run(effect, p, readings):
    stage = effect.stage(p, DT_S)
    return stage.run(stage.start(np.zeros(0), float(readings[0])), np.empty((len(readings), 0)), readings)


@given(
    st.floats(-0.5, 0.5), st.floats(-0.15, 0.15), st.floats(-0.15, 0.15), st.floats(0.01, 100.0)
)  # fmt: skip
def test_more_reading_is_always_more_deformation_and_zero_stays(scale, square, cube, range_mm):
    p = {"scale_error": scale, "square": square, "cube": cube, "range_mm": range_mm}
    found = _run(EFFECT, p, READINGS)
    assert (np.diff(found) > 0.0).all()
    assert found[300] == pytest.approx(0.0, abs=1e-12)


def test_without_a_bend_it_is_the_scale():
    p = {"scale_error": 0.02, "square": 0.0, "cube": 0.0, "range_mm": 1.0}
    np.testing.assert_array_equal(_run(EFFECT, p, READINGS), _run(STRAIGHT, {"scale_error": 0.02}, READINGS))


def test_a_transducer_on_an_arc_is_a_cube():
    """Reading 6 mm sin(x / 6 mm) of a true x up to 1.2 mm: short by x^2 / 216 mm^2, with no square."""
    true = np.linspace(0.0, 1.2, 200)
    readings = 6.0 * np.sin(true / 6.0)
    at_end = float(readings[-1])
    p = {"scale_error": 0.0, "square": 0.0, "cube": at_end**2 / 216.0, "range_mm": at_end}
    assert math.isclose(p["cube"], 1.2 / at_end - 1.0, rel_tol=0.02)
    np.testing.assert_allclose(_run(EFFECT, p, readings), true, atol=2e-4)


def test_beyond_its_range_it_is_as_wrong_as_at_the_end():
    p = {"scale_error": 0.0, "square": 0.01, "cube": 0.02, "range_mm": 1.0}
    np.testing.assert_allclose(_run(EFFECT, p, np.array([1.0, 2.0, -2.0])), [1.03, 2.06, -2.02])
