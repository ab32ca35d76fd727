"""What is known before: a rig's file, the bench's records, the temperature at which a model was identified."""

import msgspec
import numpy as np
import pytest
from scipy.signal import lfilter

from tests.diagnose.scene import DT_S, NOISE_N, columns, mount, record
from tests.diagnose.search.test_joint import measured_on
from thrustd.core.errors import ConfigError, ModelError
from thrustd.diagnose.search.base import base_of
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.diagnose.search.library import terms_of
from thrustd.diagnose.search.question import Given, asked
from thrustd.diagnose.search.records import stretches
from thrustd.diagnose.search.rig import read_rig, shipped_rig
from thrustd.diagnose.search.told import sentences
from thrustd.identify.identify import identify
from thrustd.model.artifact import EffectSpec
from thrustd.model.effects import effect_named


def test_the_shipped_file_is_read_and_is_the_default():
    assert shipped_rig().sigma == {"sensor_scale": {"scale_error": 0.005, "square": 0.005, "cube": 0.005}}
    rig = asked(mount(), [record()], Given()).rig
    (scale,) = terms_of(effect_named("sensor_scale"), rig)
    assert scale.std == {"scale_error": 0.005}


def test_a_file_of_ones_own_says_sigmas_and_what_cannot_be():
    told = read_rig('without = ["axial_inertia"]\n[sigma.nacelle_drag]\ndrag_area_m2 = 0.01', "mine.toml")
    question = asked(mount(), [record()], Given(rig=told))
    (drag,) = terms_of(effect_named("nacelle_drag"), question.rig)
    assert drag.std == {"drag_area_m2": 0.01}
    report = diagnose(mount(), [record([EffectSpec("axial_inertia", {"mass_kg": 200.0})])], given=Given(rig=told))
    assert "axial_inertia" not in {candidate.effect for candidate in report.candidates}


@pytest.mark.parametrize(
    "text, said",
    [
        ("friction_share = -1.0", "mine.toml: friction_share = -1.0: Expected `float` > 0.0"),
        ('without = ["gravity"]', "mine.toml: no effect 'gravity', expected one of ageing, axial_inertia"),
        ("[sigma.creep]\nmass_kg = 1.0", "mine.toml: sigma.creep.mass_kg: no such amplitude, expected one of"),
        ("sigma = 1", "mine.toml: sigma = 1"),
        ("over_typical = ", "mine.toml: not TOML"),
        ("colour = 3", "mine.toml: colour: no such key, expected one of name, over_typical"),
    ],
)
def test_a_bad_file_is_one_line(text, said):
    with pytest.raises(ConfigError) as problem:
        read_rig(text, "mine.toml")
    assert str(problem.value).startswith(said)
    assert "\n" not in str(problem.value)


def test_bench_records_are_the_prior_of_a_model_that_carries_none():
    bare, bench = msgspec.structs.replace(mount(k1=4800.0), error=None), record()
    segments = stretches(bare, [bench])
    known = base_of(bare, segments, segments)
    assert known.promised * known.scale == pytest.approx(NOISE_N, rel=0.05)
    hidden = record([EffectSpec("nacelle_drag", {"drag_area_m2": 0.05})], seed=4)
    assert diagnose(bare, [hidden], given=Given(bench=[bench])).verdict == ("nacelle_drag",)


def test_a_model_that_carries_its_bench_takes_no_other(identified):
    spec = identified(0)
    with pytest.raises(ModelError, match="expected a model without, or no --bench"):
        diagnose(spec, [record(seed=2)], given=Given(bench=[record()]))


def test_records_that_a_model_was_learnt_from_do_not_count_twice(identified):
    """An elastomer's own record held curve and friction where they stood for its softening: `unknown` at 9 kPa of 1."""
    bench, flight = record(), record(seed=2)
    spec = identified(0)
    assert asked(spec, [flight], Given()).base.benched
    assert asked(spec, [bench, flight], Given()).base.benched is False
    both = identify([bench, flight]).spec
    assert asked(both, [bench], Given()).base.benched  # the other record is known


def test_the_rubber_may_have_been_colder_than_the_bench_says():
    """Nobody hears of a scale where the stiffness is at the right temperature."""
    warm = columns()
    warm["temperature_degC"] = 30.0 + 8.0 * np.sin(np.arange(12_000) * DT_S / 40.0)
    hidden = EffectSpec("thermal_stiffness", {"stiffness_1_k": -0.003, "reference_degc": 20.0})
    bench = mount()
    bench = msgspec.structs.replace(bench, provenance=dict(bench.provenance) | {"mean_temperature_degC": 30.0})
    report = diagnose(bench, [measured_on(mount(effects=[hidden]), warm)])
    assert report.verdict == ("thermal_stiffness",)
    reference = {p.name: p for p in report.candidates[0].parameters}["reference_degc"]
    assert reference.value == pytest.approx(20.0, abs=3 * reference.std)


def test_a_record_may_begin_when_the_sensor_is_warm_already_and_the_rubber_is_not():
    """As warm as its sensor from the start, a stranger's expansion left 76 N of 8 and was called a stiffness."""
    warm = columns()
    warm["temperature_degC"] = 38.0 + 9.0 * np.sin(warm["time_s"] / 70.0)
    keep = np.exp(-DT_S / 90.0)
    rubber = lfilter([1.0 - keep], [1.0, -keep], warm["temperature_degC"], zi=[keep * 21.0])[0]
    bench = mount()
    bench = msgspec.structs.replace(bench, provenance=dict(bench.provenance) | {"mean_temperature_degC": 21.0})
    read = measured_on(bench, warm)
    report = diagnose(bench, [read.with_channels(deformation_mm=read["deformation_mm"] + 0.003 * (rubber - 21.0))])
    assert report.verdict == ("thermal_expansion",)
    assert report.rmse_after_n < 1.1 * NOISE_N
    assert any(
        line.startswith("thermal_expansion: expansion_mm_k = 0.00")
        for line in sentences(report.candidates[0].parameters)
    )


def test_a_core_that_warms_behind_its_surface_is_no_second_effect():
    """One lag for two nodes left a reference 13 K off, and ageing beside it that was not there."""
    warm = columns()
    warm["temperature_degC"] = -4.0 + 40.0 * (1.0 - np.exp(-warm["time_s"] / 150.0))
    nodes = {"surface_s": 60.0, "lag_s": 150.0, "surface_share": 0.0}
    hidden = EffectSpec("thermal_stiffness_late", {"stiffness_1_k": -0.0035, "reference_degc": 23.0} | nodes)
    bench = record(name="bench")
    bench = bench.with_channels(temperature_degC=23.5 + 0.3 * np.sin(bench.time_s / 100.0))
    report = diagnose(identify([bench]).spec, [measured_on(mount(effects=[hidden]), warm)])
    assert report.verdict == ("thermal_stiffness",)
    assert report.rmse_after_n < 1.05 * NOISE_N
    numbers = {p.name: p for p in report.candidates[0].parameters}
    for name in ("stiffness_1_k", "reference_degc"):
        assert numbers[name].value == pytest.approx(hidden.parameters[name], abs=3 * numbers[name].std)
    late_s = numbers["surface_s"].value + numbers["lag_s"].value * (
        1.0 if "surface_share" in numbers else np.pi**2 / 12
    )
    assert late_s == pytest.approx(60.0 + 150.0, rel=0.05)  # on average, by two nodes or by a body
