"""Diagnose names what was hidden, says none and unknown when that is the truth, and is open about its doubts."""

import io
import json

import numpy as np
import pytest
from rich.console import Console
from scipy.signal import lfilter

from tests.diagnose.scene import DT_S, NOISE_N, inertia, mount, record
from thrustd.core.errors import RecordingError
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.identify.identify import identify
from thrustd.model.artifact import EffectSpec
from thrustd.model.compile import compile_model
from thrustd.model.effects import effect_named
from thrustd.model.expression import expression_effect
from thrustd.records.recording import make_recording


@pytest.mark.parametrize("effect", ["axial_inertia", "thermal_stiffness", "hysteresis", "viscous_damping"])
def test_the_twins_hidden_effect_is_named_first(twin_case, effect):
    case = twin_case((effect,))
    report = diagnose(case.model, [case.measured])
    assert report.verdict == (effect,)
    assert report.rmse_after_n < 0.5 * report.rmse_before_n
    assert report.candidates[0].effect == effect


def test_nothing_hidden_is_none(twin_case):
    case = twin_case(("none",))
    assert diagnose(case.model, [case.measured]).verdict == ("none",)


def test_what_no_effect_explains_is_unknown_with_its_channel(twin_case):
    case = twin_case(("hydraulic_line",))
    report = diagnose(case.model, [case.measured])
    assert report.verdict == ("unknown",)
    assert report.depends_on[0].channel == "hydraulic_pressure_bar"
    assert np.ptp(report.depends_on[0].residual_n) > 20.0


def test_two_effects_are_both_found(twin_case):
    case = twin_case(("axial_inertia", "thermal_expansion"))
    report = diagnose(case.model, [case.measured])
    assert "axial_inertia" in report.verdict and len(report.verdict) == 2
    told = {c.effect: c for c in report.candidates if c.in_verdict}
    assert {*report.verdict} & {"thermal_expansion", "sensor_drift"}  # one thing in a record that warms evenly
    assert "together with " in told["axial_inertia"].evidence
    assert report.rmse_after_n < 1.1 * NOISE_N


def test_two_effects_that_hide_each_other_are_found_together():
    """Either channel alone removes next to nothing: what is seen is the small difference of two large forces."""
    t = np.arange(12_000) * DT_S
    slow, quick = np.sin(t / 17.0) + np.sin(t / 41.0), 0.15 * np.sin(t / 5.3)
    data = record(added=lambda columns: 200.0 * quick).with_channels(line_bar=slow + quick, valve_pct=slow)
    pair = [expression_effect(text, data.channels) for text in ("p * line_bar", "q * valve_pct")]
    report = diagnose(mount(), [data], extra=pair)
    assert set(report.verdict) == {effect.word for effect in pair}
    assert report.rmse_after_n < 1.1 * NOISE_N


def test_a_law_by_another_thermometer_has_to_be_told_from_those_of_the_mounts_own_columns():
    """Air that cools with the climb is a clock: rubber that stiffens with time is not said to follow it."""
    aged = record([EffectSpec("ageing", {"ageing_1_h": 0.3, "settling_h": 0.05})])
    climbing = aged.with_channels(sat_degC=15.0 - 10.0 * (1.0 - np.exp(-aged.time_s / 180.0)))
    report = diagnose(mount(), [climbing])
    assert report.verdict == ("ageing",) and report.grade == "cannot be told"
    assert "thermal_stiffness" in report.candidates[0].separable_from


def test_what_a_core_removes_that_moves_is_no_effects_doing():
    """A bench 2 % too soft leaves 70 N, 12 N once the core has moved: nobody is listed who leaves those 12 N too."""
    report = diagnose(mount(k1=4900.0, own_n=60.0), [record()])
    assert report.verdict == ("none",) and report.rmse_before_n > 5.0 * report.rmse_after_n
    assert {one.rmse_after_n for one in report.candidates} == {report.rmse_before_n}
    console = Console(width=120, file=io.StringIO())
    report.print(console)
    assert "Absent effects" not in console.file.getvalue()


def test_the_mass_comes_out_in_kilograms_with_an_honest_band():
    report = diagnose(mount(), [record([inertia(100.0)])])
    number = report.candidates[0].parameters[0]
    assert (number.name, number.unit) == ("mass_kg", "kg")
    assert abs(number.value - 100.0) < 4 * number.std + 0.5
    assert number.std < 5.0
    assert number.std >= 0.005 * number.value  # no better than the calibration of the transducer
    assert "172 kg on an upper, 201 kg on a lower mount" in number.expected


def test_a_still_or_absent_channel_is_said():
    quiet = record([inertia(100.0)])
    report = diagnose(mount(), [quiet])
    reasons = {n.effect: n.reason for n in report.not_judged}
    assert "vibration_mm_s never moves" in reasons["vibration_rectification"]
    assert "payne" not in reasons  # by its own oscillation it is judged
    without = quiet.select([c for c in quiet.channels if c != "accel_z_g"])
    reasons = {n.effect: n.reason for n in diagnose(mount(), [without]).not_judged}
    assert "accel_z_g is not in the data" in reasons["engine_weight"]


def test_look_alikes_come_with_the_test_that_separates_them():
    """A sensor that drifts and a bracket that grows as the day warms evenly are one thing to the record."""
    data = record([EffectSpec("sensor_drift", {"drift_mm_h": 0.06, "settling_h": 1000.0})])
    even = data.with_channels(temperature_degC=20.0 + 20.0 * np.arange(len(data)) / len(data))
    report = diagnose(mount(), [even])
    both = {report.verdict[0], *report.candidates[0].separable_from}
    assert {"sensor_drift", "thermal_expansion"} <= both
    assert report.grade == "cannot be told"
    assert any("alone would show so" in line for line in report.advice)


def test_a_record_of_one_sine_does_not_tell_a_dashpot_from_what_is_late_or_relaxes():
    """Noise tells a delay by the third harmonic of a curved spring, but no law holds so exactly."""
    t = np.arange(12_000) * DT_S
    seen = {"time_s": t, "deformation_mm": 0.6 + 0.5 * np.sin(2 * np.pi * 0.2 * t)}
    model = compile_model(mount(effects=[EffectSpec("viscous_damping", {"damping_n_s_mm": 300.0})]), 1 / DT_S)
    force = model.simulate(model.inputs(seen)) + np.random.default_rng(1).normal(0.0, NOISE_N, len(t))
    report = diagnose(mount(), [make_recording("sine", seen | {"force_N": force})])
    assert report.grade == "cannot be told"
    assert {"viscous_damping", "relaxation", "time_delay"} <= {*report.verdict, *report.candidates[0].separable_from}


def test_a_users_expression_takes_part():
    hidden = record(added=lambda d: 60.0 * (d["cabin_psi"] - 14.0))
    assert diagnose(mount(), [hidden]).verdict == ("unknown",)
    guess = expression_effect("k * (cabin_psi - 14)", hidden.channels)
    report = diagnose(mount(), [hidden], extra=[guess])
    assert report.verdict == (guess.name,)
    assert report.candidates[0].parameters[0].value == pytest.approx(60.0, rel=0.1)


def test_an_effect_in_the_model_is_not_proposed_again():
    report = diagnose(mount(effects=[inertia(100.0)]), [record([inertia(100.0)])])
    assert report.verdict == ("none",)
    assert "axial_inertia" not in {c.effect for c in report.candidates}


def test_the_json_has_the_agreed_keys_and_progress_is_told():
    told = []
    report = diagnose(mount(), [record([inertia(100.0)])], progress=lambda share, what: told.append(share))
    data = json.loads(json.dumps(report.to_json()))
    assert {"verdict", "candidates", "depends_on", "not_judged", "advice"} <= set(data)
    keys = {"effect", "rmse_before_n", "rmse_after_n", "parameters", "separable_from"}
    assert all(keys <= set(c) for c in data["candidates"])
    assert told == sorted(told) and told[-1] == 1.0
    console = Console(width=120, file=io.StringIO())
    report.print(console)
    assert "Verdict on mount: axial_inertia" in console.file.getvalue()


def test_the_models_own_output_is_no_reference():
    data = record()
    own = data.with_channels(force_N=_simulated(data))
    with pytest.raises(RecordingError, match="model's own output"):
        diagnose(mount(), [own])


def test_friction_that_was_there_at_the_identification_is_in_the_model():
    friction = EffectSpec("hysteresis", {"friction_n": 150.0, "yield_mm": 0.05})
    model = identify([record([friction], seed=5, n=36_000)]).spec
    assert {effect_named(effect.name).word for effect in model.effects} == {"hysteresis"}
    report = diagnose(model, [record([friction], seed=6)])
    assert report.rmse_before_n < 0.3 * 150.0  # other reversals than those of the identification, which lasted 30 min


def test_a_rubber_block_of_another_size_that_warmed_up():
    """Strain steps at 10 Hz up to 8 mm and 400 N, identified cold."""
    model = identify([_rubber(1, warmer_k=0.0)]).spec
    report = diagnose(model, [_rubber(2, warmer_k=25.0)])
    assert report.verdict == ("thermal_stiffness",)
    number = report.candidates[0].parameters[0]
    assert number.value == pytest.approx(-0.004, abs=3 * number.std + 1e-5)


def _rubber(seed, warmer_k, n=20_000, dt_s=0.1):
    rng = np.random.default_rng(seed)
    x = _lag(np.repeat(rng.uniform(0, 8, n // 250), 250), 1.0, dt_s)
    elastic = 40 * x + 3 * x**2
    force = elastic - 0.1 * _lag(elastic, 2.0, dt_s) - 0.08 * _lag(elastic, 40.0, dt_s)
    degc = 23 + warmer_k * np.arange(n) / n
    noisy = force * (1 - 0.004 * (degc - 23)) + rng.normal(0, 1.0, n)
    columns = {"time_s": np.arange(n) * dt_s, "deformation_mm": x, "force_N": noisy, "temperature_degC": degc}
    return make_recording("block", columns)


def _lag(signal, tau_s, dt_s):
    keep = np.exp(-dt_s / tau_s)
    return lfilter([1 - keep], [1, -keep], signal)


def _simulated(data):
    model = compile_model(mount(), data.sample_hz)
    return model.simulate(model.inputs(data.channels))


def test_a_force_of_the_wrong_sign_is_said_and_no_effect_is_named_for_it():
    rubs = record([EffectSpec("hysteresis_prandtl_ishlinskii", {"friction_n": 400.0})])
    turned = make_recording("turned", {**rubs.channels, "time_s": rubs.time_s, "force_N": -rubs["force_N"]})
    report = diagnose(mount(k1=-5000.0, k3=-1000.0), [turned])
    assert report.verdict == ("unknown",)
    assert "sign of force_N" in report.advice[0]
    assert report.grade == "weak"


def test_creep_that_begins_within_seconds_is_found_with_its_beginning():
    """With its beginning held at a minute, a stranger's was payne with relaxation."""
    hidden = EffectSpec("creep", {"creep_per_decade": 0.01, "start_s": 2.0})
    report = diagnose(mount(), [record([hidden])])
    assert report.verdict == ("creep",)
    found = {number.name: number for number in report.candidates[0].parameters}
    for name, true in hidden.parameters.items():
        assert found[name].value == pytest.approx(true, abs=found[name].half_width)
