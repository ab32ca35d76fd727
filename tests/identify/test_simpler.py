"""How much structure short records bear."""

import numpy as np
import pytest
from scipy.signal import lfilter

from thrustd.identify.hw_fit import HwSettings
from thrustd.identify.segments import FORCE, segments_of
from thrustd.identify.structures import simpler
from thrustd.identify.structures.block_fits import BlockFits
from thrustd.records.recording import make_recording

ASKED = HwSettings(order=3, input_shape="cubic", output_shape="line")


@pytest.fixture(scope="module")
def straight():
    """Two lags, no curve: 600 samples at 1 Hz."""
    rng = np.random.default_rng(4)
    u = np.repeat(rng.uniform(-1, 1, 40), 15)
    y = lfilter([0.2], [1, -0.8], lfilter([0.4], [1, -0.6], u)) + 0.01 * rng.normal(size=600)
    return segments_of([make_recording("bench", {"time_s": np.arange(600.0), "deformation_mm": u, FORCE: y})])


def test_a_straight_system_is_given_a_straight_model(straight):
    chosen = simpler.best_of(straight, ASKED, BlockFits())
    assert (chosen.input_shape, chosen.output_shape) == ("line", "line")


def test_what_the_data_speak_for_stays(straight):
    (segment,) = straight
    curved = 2.0 * segment.inputs["deformation_mm"] ** 3
    force = lfilter([0.2], [1, -0.8], lfilter([0.4], [1, -0.6], curved))
    columns = {"time_s": segment.time_s, "deformation_mm": segment.inputs["deformation_mm"], FORCE: force}
    chosen = simpler.best_of(segments_of([make_recording("bench", columns)]), ASKED, BlockFits())
    assert chosen.input_shape == "cubic"


def test_a_long_record_is_compared_with_what_was_fitted_already(straight, monkeypatch):
    monkeypatch.setattr(simpler, "SHORT", 100)
    fits = BlockFits()
    assert simpler.best_of(straight, ASKED, fits) == ASKED
    line = HwSettings(order=3, input_shape="line", output_shape="line")
    fits.of(straight, line, None)
    assert simpler.best_of(straight, ASKED, fits) == line


def test_neighbours_are_said_in_words():
    assert simpler.words(ASKED) == "order 3, cubic - line"
