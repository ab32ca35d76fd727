"""Two effects whose sum looks like a third one."""

import numpy as np
import pytest

from tests.diagnose.scene import DT_S, columns, mount, record
from thrustd.diagnose.search.candidates import Candidate
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.diagnose.search.gram import Fit
from thrustd.diagnose.search.pairs import preferred
from thrustd.diagnose.search.selection import Scored
from thrustd.model.artifact import EffectSpec
from thrustd.model.compile import compile_model
from thrustd.model.effects import effect_named
from thrustd.records.recording import make_recording
from thrustd.twin.hide import hidden_case


def test_two_effects_that_together_imitate_a_third_are_both_named():
    rng = np.random.default_rng(3)
    data = columns()
    n = len(data["time_s"])
    data["vibration_mm_s"] = np.clip(8 + 6 * np.repeat(rng.normal(size=n // 300), 300), 0.0, None)
    effects = [EffectSpec("vibration_rectification", {"shift_mm": 0.9, "exponent": 2.0}),
               EffectSpec("sensor_scale", {"scale_error": 0.015})]  # fmt: skip
    model = compile_model(mount(effects=effects), 1 / DT_S)
    force = model.simulate(model.inputs(data)) + rng.normal(0, 12.0, n)
    report = diagnose(mount(), [make_recording("measured", data | {"force_N": force})])
    assert set(report.verdict) == {"vibration_rectification", "sensor_scale"}
    assert report.rmse_after_n < 13.0


def test_two_effects_of_which_neither_shows_alone_are_both_named():
    hidden = [EffectSpec("free_play", {"gap_mm": 0.014, "travel_mm": 0.018}),
              EffectSpec("hysteresis", {"friction_n": 43.0, "yield_mm": 0.038})]  # fmt: skip
    report = diagnose(mount(), [record(hidden)])
    assert set(report.verdict) == {"free_play", "hysteresis"}
    assert report.rmse_after_n < 12.5


def test_one_of_which_only_shows_with_the_model_re_estimated_and_its_partner_are_both_named():
    """Rectification and drift of opposite sign over the twin's two hours: alone each gains next to nothing."""
    hidden = hidden_case(("vibration_rectification", "sensor_drift"), 142, 3.0)
    m = hidden.truth["mount"]
    model = mount(m["stiffness_n_mm"], m["cubic_n_mm3"], m["relaxation"], m["relaxation_s"])
    assert set(diagnose(model, [hidden.measured]).verdict) == {"sensor_drift", "vibration_rectification"}


def scored(word, error_n2):
    fit = Fit(np.ones(1), np.full(4, error_n2), np.ones(4))
    return Scored(Candidate(effect_named(word), {}, ("x",), np.ones((4, 1))), fit, None, fit, 5.0)


@pytest.mark.parametrize(
    ("found", "left_n2", "better"),
    [
        (["payne"], 1.24, True),  # two for a third that is none of them: 15 % of the own squared error
        (["payne"], 1.10, False),
        (["sensor_scale"], 1.24, False),  # one more beside it: as much as a further round asks, 30 %
        (["sensor_scale"], 1.34, True),
        (["ageing", "creep"], 1.06, True),  # as many others: 5 %
        (["ageing", "creep"], 1.02, False),
        (["sensor_scale", "vibration_rectification"], 9.0, False),  # the same
        (["sensor_scale", "vibration_rectification", "creep"], 0.75, True),  # without the third, which was not worth it
        (["sensor_scale", "vibration_rectification", "creep"], 0.65, False),
    ],
)
def test_a_pair_is_preferred_when_it_explains_better_for_its_number(found, left_n2, better):
    pair = (scored("sensor_scale", 1.0), scored("vibration_rectification", 1.0))
    assert preferred(pair, [scored(word, left_n2) for word in found], left_n2, 1.0) is better
