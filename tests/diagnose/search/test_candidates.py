"""What an effect may be, and where its estimation begins."""

import numpy as np
import pytest

from thrustd.diagnose.search.candidates import Candidate, shapes
from thrustd.model.effects import effect_named


@pytest.mark.parametrize(
    ("effect", "amplitude", "value", "impossible"),
    [
        ("hysteresis", "friction_n", -1.0, True),  # the wrong side of neutral
        ("hysteresis", "friction_n", 80.0, False),
        (
            "ageing",
            "ageing_1_h",
            -20.0,
            True,
        ),  # more than the effect can hold: what is added would not be what was judged
        ("time_delay", "delay_s", -0.3, False),
    ],
)
def test_an_amplitude_beyond_its_bounds_is_impossible(effect, amplitude, value, impossible):
    candidate = Candidate(effect_named(effect), {}, (amplitude,), np.ones((4, 1)))
    assert candidate.impossible(np.array([value])) is impossible


def test_millimetres_of_a_shape_go_with_a_travel_of_another_order():
    effect = effect_named("hysteresis")
    usual = [shape["yield_mm"] for shape in shapes(effect, {})]
    assert [shape["yield_mm"] for shape in shapes(effect, {}, scale=30.0)] == pytest.approx([30.0 * y for y in usual])
