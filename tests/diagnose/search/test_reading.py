"""Noise of the reading: what swallows it, or looks ahead, smooths it, and is no law of the mount for that."""

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.diagnose.scene import DT_S, NOISE_N, columns, mount, record
from thrustd.core.measures import rms
from thrustd.diagnose.extend.extend import extend
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.diagnose.search.question import NOTHING, asked
from thrustd.diagnose.search.reading import followed_by, without_noise, without_tremble
from thrustd.model.artifact import EffectSpec
from thrustd.model.compile import compile_model
from thrustd.records.recording import make_recording

READS_MM = 0.0016


def trembling(data, seed=3):
    noise = np.random.default_rng(seed).normal(0, READS_MM, len(data))
    return data.with_channels(deformation_mm=data["deformation_mm"] + noise)


def test_noise_goes_and_motion_stays():
    """Levels, ramps of seconds, and a vibration that is as large as the noise."""
    t = np.arange(20_000) * DT_S
    levels = np.repeat(np.random.default_rng(1).uniform(0.0, 1.0, 40), 500)
    late = np.exp(-t[:200] / 1.5)
    motion = np.convolve(np.pad(levels, (199, 0), mode="edge"), late / late.sum(), mode="valid")
    motion += READS_MM * np.sin(2 * np.pi * 0.3 * t)
    read = motion + np.random.default_rng(2).normal(0, READS_MM, len(t))
    missed = without_noise(read) - motion
    assert rms(missed) < 0.6 * READS_MM
    assert np.abs(missed).max() < 5.0 * READS_MM


@pytest.mark.parametrize("read", [np.linspace(0.0, 1.0, 500), np.zeros(300), np.array([0.0, 1.0])])
def test_a_reading_without_noise_stays_as_it_is(read):
    assert without_noise(read) == pytest.approx(read, abs=1e-12)


def test_what_smooths_a_reading_is_no_law_of_the_mount():
    """A free play of two sigmas that looks ahead left two thirds of the noise, and was named."""
    report = diagnose(mount(), [trembling(record())])
    assert report.verdict == ("none",)


def test_a_free_play_below_a_trembling_reading_is_named():
    report = diagnose(mount(), [trembling(record([EffectSpec("free_play", {"gap_mm": 0.02})]))])
    assert report.verdict == ("free_play",)


def test_motion_as_fast_as_the_samples_is_not_taken_for_noise():
    """Sampled six times a period, motion bends from sample to sample as noise does; but the force follows it."""
    data = record()
    fast = data["deformation_mm"] + 0.02 * np.sin(2 * np.pi * np.arange(len(data)) / 6.2)
    model = compile_model(mount(), 1 / DT_S)
    force = model.simulate(model.inputs({**data.channels, "deformation_mm": fast}))
    force += np.random.default_rng(4).normal(0, NOISE_N, len(data))
    question = asked(mount(), [data.with_channels(deformation_mm=fast, force_N=force)], NOTHING)
    assert rms(without_noise(fast) - fast) > 0.005
    assert without_tremble(question) is question


def test_friction_forgets_by_motion_as_small_as_noise():
    """Less its noise the reading has little of that motion, and relaxation was named beside: 17.3 N left, not 16.6."""
    n, rng = 24_000, np.random.default_rng(3)
    data, keep = columns(n, 3), np.exp(-DT_S / 0.3)
    moved = data["deformation_mm"] + 1e-3 * lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], rng.standard_normal(n))
    rubs = mount(effects=[EffectSpec("hysteresis", {"friction_n": 150.0, "yield_mm": 0.02})])
    model = compile_model(rubs, 1 / DT_S)
    force = model.simulate(model.inputs({**data, "deformation_mm": moved})) + rng.normal(0, NOISE_N, n)
    read = {**data, "deformation_mm": moved + 1e-3 * rng.standard_normal(n), "force_N": force}
    report = diagnose(mount(), [make_recording("measured", read)])
    assert report.verdict == ("hysteresis",)
    [friction] = [one for one in report.candidates[0].parameters if one.name == "friction_n"]
    assert friction.value == pytest.approx(150.0, abs=friction.half_width)


def test_what_is_reported_and_written_is_of_the_reading_as_it_is():
    """In a record of few samples the fit of the reading less its noise was reported, 16 N, and written, 23 N."""
    data = trembling(record([EffectSpec("free_play", {"gap_mm": 0.02})]))
    report = extend(mount(), [data], ["free_play"])
    model = compile_model(report.spec, 1 / DT_S)
    assert not report.remarks
    assert rms(data["force_N"] - model.simulate(model.inputs(data.channels))) < report.rmse_after_n


def test_a_little_more_of_a_missing_damper_does_not_make_motion_of_noise():
    """205.54 N were missed, 205.55 N less the noise of the reading: a rate read with that noise was another law's."""
    damper = EffectSpec("viscous_damping_power", {"damping_n": 2000.0, "exponent": 0.6, "filter_s": 0.005})
    data = record([damper])
    noise = np.random.default_rng(3).normal(0, 3e-4, len(data))
    question = asked(mount(), [data.with_channels(deformation_mm=data["deformation_mm"] + noise)], NOTHING)
    calm = without_tremble(question)
    assert calm is not question
    assert calm.base.as_is_mse > question.base.as_is_mse
    assert calm.base.promised < question.base.promised


def test_noise_of_a_reading_is_no_motion_whatever_effect_is_missing():
    """By the error with it and without it 19 of 52 mounts of an independent generator seemed to move so."""
    data = record([EffectSpec("sensor_scale", {"scale_error": -0.08})])
    for seed in range(4):
        noise = np.random.default_rng(seed).normal(0, 8e-4, len(data))
        question = asked(mount(), [data.with_channels(deformation_mm=data["deformation_mm"] + noise)], NOTHING)
        assert without_tremble(question) is not question


def test_a_force_follows_motion_and_no_noise():
    rng = np.random.default_rng(1)
    taken, other = rng.normal(0, 5.0, (2, 20_000))
    level = 300.0 * np.sin(np.arange(20_000) / 5000.0)  # what an effect leaves
    taken[100] = other[200] = np.nan
    assert followed_by([taken], [level + other]) == pytest.approx(0.0, abs=0.03)
    assert followed_by([taken, taken], [level + taken + other, taken]) == pytest.approx(1.0, abs=0.03)
    assert followed_by([np.zeros(9)], [np.ones(9)]) == 0.0
