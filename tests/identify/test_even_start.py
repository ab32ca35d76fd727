"""Linear blocks in front of an even output curve."""

import numpy as np
import pytest
from scipy.signal import lfilter

from thrustd.identify.even_start import before_even_curve
from thrustd.identify.hw_fit import HwSettings, fit_segments
from thrustd.identify.hw_spec import spec_of
from thrustd.identify.segments import FORCE, segments_of
from thrustd.identify.structures.structure import of_spec
from thrustd.records.recording import make_recording

RESONANT = ([0.05, 0.04], [1.0, -1.6, 0.75])


def speeds(seed: int, n: int = 1500):
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1.5, 1.5, n // 10), 10)
    return u, lfilter(*RESONANT, u), rng


@pytest.mark.parametrize("even", [np.abs, np.square, np.cos])
def test_what_lies_before_an_even_curve_is_seen_but_for_its_sign(even):
    u, x, rng = speeds(1)
    found = before_even_curve(u, even(x) + 0.02 * rng.normal(size=len(u)), np.arange(len(u)))
    assert abs(np.corrcoef(found[50:], x[50:])[0, 1]) > 0.9


def test_too_few_rows_say_nothing():
    u, x, _ = speeds(2, 50)
    assert before_even_curve(u, np.abs(x), np.arange(50)) is None


def test_a_speed_without_its_sign_is_followed_on_another_record():
    def record(seed: int):
        u, x, rng = speeds(seed)
        y = np.abs(x) + 0.02 * rng.normal(size=len(u))
        return segments_of([make_recording("m", {"time_s": np.arange(1500.0), "deformation_mm": u, FORCE: y})])

    settings = HwSettings(2, input_shape="line")
    spec = spec_of(fit_segments(record(3), settings), "m", "hw-pwl", ("line", "pwl"))
    (unseen,) = record(4)
    missed = unseen.force_n - of_spec(spec, 0).simulate(unseen)
    assert np.std(missed[50:]) < 0.15 * np.std(unseen.force_n)
