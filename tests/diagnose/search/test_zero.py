"""What a reference may be off by: a cell that walks, a zero set anew, a prior as large as the record's channel asks."""

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.diagnose.scene import DT_S, NOISE_N, columns, mount, record
from thrustd.diagnose.search.base import begins_unloaded
from thrustd.diagnose.search.candidates import judgeable
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.diagnose.search.joint import joint_fit
from thrustd.diagnose.search.question import NOTHING, asked
from thrustd.diagnose.search.ranking import rank
from thrustd.identify.identify import identify
from thrustd.model.artifact import EffectSpec
from thrustd.model.compile import compile_model
from thrustd.model.effects import shelf
from thrustd.records.recording import make_recording

HOUR = 72_000


def walking(far_n, seed):
    """A cell that walks so far in the root of an hour."""
    rng = np.random.default_rng(seed)
    return lambda data: far_n * np.cumsum(rng.standard_normal(len(data["time_s"]))) / np.sqrt(HOUR)


def simulated(true_mount, data):
    model = compile_model(true_mount, 1 / DT_S)
    return model.simulate(model.inputs(data))


def found_from_rest(spec, measured):
    """The best set where nothing is remembered from before."""
    question = asked(spec, [measured], NOTHING)
    effects, _ = judgeable(list(shelf().values()), question.records, [])
    return rank(question.base, question.rows, effects, question.rig).best


@pytest.fixture(scope="module")
def walked():
    """A mount whose bench had a cell that walks by 8 N in an hour."""
    return identify([record(seed=7, n=HOUR, added=walking(8.0, 1))]).spec


def test_a_drift_of_the_transducer_is_no_walk_of_the_cell(walked):
    """A walk could follow it, at five of its sigmas. What else settles as slowly looks like it, and may come first."""
    drift = EffectSpec("sensor_drift", {"drift_mm_h": 0.02, "settling_h": 0.7})
    report = diagnose(walked, [record([drift], n=HOUR, added=walking(8.0, 2))])
    assert "sensor_drift" in (*report.verdict, *report.candidates[0].separable_from) and len(report.verdict) == 1


def wandering(seed):
    """A cell that wanders by 6 N, forgetting in a minute."""

    def added(data):
        keeps = np.exp(-DT_S / 60.0)
        steps = np.random.default_rng(seed).standard_normal(len(data["time_s"]) + 4000)
        return 6.0 * np.sqrt(1.0 - keeps**2) * lfilter([1.0], [1.0, -keeps], steps)[4000:]

    return added


def test_a_cell_that_wanders_leaves_mount_and_effect_as_well_known_as_they_are():
    """Counted as white noise at its level the bench told its mount by 117 N, and the mass was 19.9 +- 0.9 kg."""
    spec = identify([record(seed=7, n=HOUR, added=wandering(1))]).spec
    assert spec.posterior.noise_n < 1.2 * NOISE_N
    report = diagnose(spec, [record([EffectSpec("axial_inertia", {"mass_kg": 20.0})], n=HOUR, added=wandering(2))])
    assert report.verdict == ("axial_inertia",)
    [mass] = report.candidates[0].parameters
    assert mass.std < 0.5 and abs(mass.value - 20.0) < 3.0 * mass.std
    assert diagnose(spec, [record(n=HOUR, added=wandering(3))]).verdict == ("none",)


@pytest.mark.parametrize("seed", [2, 3])
def test_a_cell_that_walks_as_on_the_bench_is_no_effect(walked, seed):
    report = diagnose(walked, [record(n=HOUR, added=walking(8.0, seed))])
    assert report.verdict == ("none",)


def test_a_cell_that_walks_may_have_another_zero_where_a_record_begins_under_load(walked):
    """It is the model's zero that moves, which flies, and neither the record's walk nor what its mount remembers."""
    measured = record(n=HOUR, added=lambda data: 12.0 + walking(8.0, 2)(data))
    question = asked(walked, [measured], NOTHING)
    assert not begins_unloaded(question.segments[0], question.base.shape)
    assert question.base.shape.zero_std * question.base.scale == pytest.approx(8.0, rel=0.5)
    fit = joint_fit(question.base, question.rows, ())
    moved_n = question.base.scale * (fit.solution.point.offset - question.base.point.offset)
    assert moved_n > 6.0


def test_a_zero_that_was_set_anew_is_no_effect_and_hides_none(identified):
    """The mount rests at its zero for half a minute, then works."""
    data = columns()
    data["deformation_mm"][:600] = 0.0
    noise = NOISE_N * np.random.default_rng(4).standard_normal(len(data["time_s"]))
    force = simulated(mount(), data) + noise
    bench = identified(7)
    again = make_recording("measured", data | {"force_N": force - 30.0})
    assert diagnose(bench, [again]).verdict == ("none",)
    weight = make_recording("measured", data | {"force_N": force + 60.0 * data["accel_z_g"]})
    report = diagnose(bench, [weight])
    assert report.verdict == ("engine_weight",)
    assert found_from_rest(bench, weight).words == ("engine_weight",)  # no look told it, a pair with a gap did
    [couple] = report.candidates[0].parameters
    assert abs(couple.value + 60.0) < 1.96 * couple.std


def test_a_shift_by_vibration_is_found_at_whatever_level_the_record_shakes():
    data = columns()
    data["vibration_mm_s"] = 3.0 + 2.0 * np.sin(data["time_s"] / 23.0) + np.sin(data["time_s"] / 7.0)
    shaken = mount(effects=[EffectSpec("vibration_rectification", {"shift_mm": 12.0, "exponent": 2.0})])
    noise = NOISE_N * np.random.default_rng(4).standard_normal(len(data["time_s"]))
    measured = make_recording("measured", data | {"force_N": simulated(shaken, data) + noise})
    report = diagnose(mount(), [measured])
    assert report.verdict == ("vibration_rectification",)
    shift = next(p for p in report.candidates[0].parameters if p.name == "shift_mm")
    assert abs(shift.value - 12.0) < 1.96 * shift.std


def test_a_record_that_shakes_for_a_moment_has_no_level_of_it():
    data = columns()
    data["vibration_mm_s"] = np.zeros(len(data["time_s"]))
    data["vibration_mm_s"][:40] = 5.0  # a third of a percent of the readings
    noise = NOISE_N * np.random.default_rng(4).standard_normal(len(data["time_s"]))
    measured = make_recording("measured", data | {"force_N": simulated(mount(), data) + noise})
    assert diagnose(mount(), [measured]).verdict == ("none",)
