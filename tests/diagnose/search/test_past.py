"""What a mount may remember from before its record: said where data say so, and no hiding place for an effect."""

from functools import cache

import numpy as np
import pytest

from tests.diagnose.scene import DT_S, NOISE_N, columns, mount
from tests.diagnose.search.test_joint import measured_on
from thrustd.diagnose.search.base import remembering
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.diagnose.search.joint import joint_fit
from thrustd.diagnose.search.question import NOTHING, asked
from thrustd.identify.identify import identify
from thrustd.model.compile import compile_model
from thrustd.model.effects import effect_named
from thrustd.records.recording import make_recording

RUBBER = mount(gains=(0.05, 0.04, 0.08), taus_s=(0.4, 60.0, 1500.0))
STILL, RISE = 60, 40  # samples


def begun_unloaded(seed):
    """Columns whose load comes after three seconds."""
    found = columns(seed=seed)
    x = found["deformation_mm"]
    x[:STILL] = 0.0
    x[STILL : STILL + RISE] *= np.linspace(0.0, 1.0, RISE)
    return found


@cache
def bench():
    return identify([measured_on(RUBBER, begun_unloaded(7))]).spec


def test_a_scale_is_no_memory_of_an_earlier_load():
    data = begun_unloaded(1)
    read = measured_on(RUBBER, data)
    report = diagnose(bench(), [read.with_channels(deformation_mm=1.008 * data["deformation_mm"])])
    assert report.verdict == ("sensor_scale",)
    [number] = report.candidates[0].parameters
    assert number.value == pytest.approx(0.008, abs=2 * number.half_width)


def test_a_mount_that_was_loaded_before_hides_nothing():
    """An hour at 1 mm, then the load is let go: what is left of it relaxes through the record."""
    data, hour = begun_unloaded(1), round(3600.0 / DT_S)
    model = compile_model(RUBBER, 1 / DT_S)

    def force_n(unloaded_mm):
        rest = np.where(np.arange(len(data["time_s"])) < STILL, unloaded_mm, data["deformation_mm"])
        x = np.concatenate((np.full(hour, 1.0), np.full(2 * STILL, unloaded_mm), rest))
        return rest, model.simulate(model.inputs({"deformation_mm": x}))[-len(rest) :]

    low, high = (force_n(x)[1][:STILL].mean() for x in (0.0, 0.1))
    x, force = force_n(0.1 * low / (low - high))
    noise = np.random.default_rng(4).normal(0.0, NOISE_N, len(x))
    report = diagnose(bench(), [make_recording("measured", data | {"deformation_mm": x, "force_N": force + noise})])
    assert report.verdict == ("none",)
    assert report.rmse_after_n < 1.05 * NOISE_N


def test_a_couple_of_the_weight_is_a_force_and_no_stretch():
    data = begun_unloaded(1)
    couple = effect_named("engine_weight_couple")
    stage = couple.stage({"couple_n_g": 400.0}, DT_S)
    read = measured_on(RUBBER, data)
    force = stage.run(stage.start(np.ones(1), 0.0), np.array(data["accel_z_g"])[:, None], np.array(read["force_N"]))
    report = diagnose(bench(), [read.with_channels(force_N=force)])
    assert report.verdict == ("engine_weight",) and report.candidates[0].name == "engine_weight_couple"
    [number] = report.candidates[0].parameters
    assert number.value == pytest.approx(400.0, abs=2 * number.half_width)


def test_beside_a_memory_the_zero_is_that_of_the_bench():
    """Both free, one was 32 N and the other -32 N: only the one is in the model that `extend` writes of a chamber."""
    data = begun_unloaded(1)
    force_n = measured_on(RUBBER, data)["force_N"] + 12.0
    question = asked(bench(), [make_recording("measured", data | {"force_N": force_n})], NOTHING)
    known = question.base
    other = remembering(known, question.segments)
    free, held = (joint_fit(base, question.rows, ()).solution.point.offset for base in (known, other))
    assert known.scale * (free - known.point.offset) == pytest.approx(12.0, abs=3.0)
    assert known.scale * (held - known.point.offset) == pytest.approx(0.0, abs=0.5)
