"""How much structure short records bear."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from thrustd.identify.hw_fit import HwSettings
from thrustd.identify.segments import FORCE, segments_of
from thrustd.identify.structures import simpler
from thrustd.identify.structures.block_fits import BlockFits, Judged
from thrustd.identify.structures.structure import error_from_past, of_spec
from thrustd.model.artifact import LinearBlock, ModelSpec, PiecewiseLinear, RealMode, ValidRange
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


def test_a_residual_that_stays_counts_once():
    """Twice the numbers for a tenth of the squares: worth it where the residual is white, not where it only drifts."""
    plain, rich = Judged(1.0, 1.0, 1000, 10), Judged(0.9, 0.9, 1000, 20)
    assert simpler.least([plain, rich]) == 1
    assert simpler.least([plain, rich._replace(slow=20.0)]) == 0


def test_a_mode_that_the_first_stretch_does_not_tell_shows_when_begun_anew(straight):
    """Slower than the record, so only the true past tells its state; fast ones are told at once."""
    line = PiecewiseLinear([-1.0, 1.0], [-1.0, 1.0])
    limits = ValidRange((-1.0, 1.0), (-1.0, 1.0))
    quick, slow = (
        ModelSpec("thrustd-model/1", "m", "oe", line, LinearBlock(0.0, modes), line, limits)
        for modes in ([RealMode(5.0, 1.0)], [RealMode(5.0, 1.0), RealMode(3000.0, 40.0), RealMode(2500.0, -40.0)])
    )
    (segment,) = straight
    for spec, most in ((quick, 1.1), (slow, np.inf)):
        followed = replace(segment, force_n=of_spec(spec, 0).simulate(segment) + 0.001 * np.sin(segment.time_s**2))
        ratio = simpler.restarted(spec, [followed]) / error_from_past(spec, [followed])
        assert ratio < most
        assert most < np.inf or ratio > 3.0


def test_a_model_that_runs_away_is_never_chosen():
    gone = Judged(np.inf, np.inf, 1, 1)
    assert simpler.least([gone, Judged(4.0, 4.0, 100, 50)]) == 1


def test_neighbours_are_said_in_words():
    assert simpler.words(ASKED) == "order 3, cubic - line"
