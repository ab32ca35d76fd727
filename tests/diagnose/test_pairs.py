"""Two effects whose sum looks like a third one."""

import numpy as np

from tests.diagnose.scene import DT_S, columns, mount
from thrustd.diagnose.diagnose import diagnose
from thrustd.model.artifact import EffectSpec
from thrustd.model.compile import compile_model
from thrustd.records.recording import make_recording


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
