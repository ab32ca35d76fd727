"""A late reading and a dashpot: the same to first order, and told apart by looking ahead in the record."""

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.diagnose.scene import DT_S, columns, mount
from thrustd.diagnose.compare.compare import compare
from thrustd.diagnose.compare.loop_energy import loop_energy
from thrustd.diagnose.extend.extend import extend
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.model.artifact import EffectSpec
from thrustd.model.compile import compile_model
from thrustd.records.recording import make_recording

LATE_S = 0.4


def measured(effects=(), late_s=0.0):
    data = columns()
    model = compile_model(mount(effects=effects), 1 / DT_S)
    force = model.simulate(model.inputs(data)) + np.random.default_rng(5).normal(0, 12.0, len(data["time_s"]))
    reading = np.interp(data["time_s"] - late_s, data["time_s"], data["deformation_mm"])
    return make_recording("measured", data | {"deformation_mm": reading, "force_N": force})


def test_a_late_reading_is_a_delay_though_no_causal_step_can_undo_it():
    report = diagnose(mount(), [measured(late_s=LATE_S)])
    found = report.candidates[0]
    assert found.effect == "time_delay"
    assert found.rmse_after_n < 12.5
    assert report.verdict == ("time_delay",)
    assert found.parameters[0].value == pytest.approx(LATE_S, rel=0.05)
    assert "looking ahead" in found.evidence


def test_a_force_that_is_recorded_late_is_an_early_reading_and_no_turned_sign(identified):
    """The mount seems to deliver energy; that its model explains most of the record as it is says that no sign is."""
    late_s = 0.12
    data = columns()
    model = compile_model(mount(), 1 / DT_S)
    force = np.interp(data["time_s"] - late_s, data["time_s"], model.simulate(model.inputs(data)))
    data["force_N"] = force + np.random.default_rng(5).normal(0, 12.0, len(force))
    bench, late = identified(7), make_recording("measured", data)
    assert loop_energy([late]).delivers
    report = diagnose(bench, [late])
    assert report.verdict == ("time_delay",)
    [delay] = report.candidates[0].parameters
    assert abs(delay.value + late_s) < delay.half_width
    extended = extend(bench, [late], ["time_delay"]).spec
    assert compare({"after": extended}, [late]).comparisons[0].rmse_n < 13.0
    turned = late.with_channels(force_N=-late["force_N"])
    assert diagnose(bench, [turned]).verdict == ("unknown",)


def test_a_damper_is_no_delay_whatever_the_power_of_its_rate():
    damper = EffectSpec("viscous_damping_power", {"damping_n": 1500.0, "exponent": 0.7, "filter_s": 0.05})
    found = diagnose(mount(), [measured([damper])]).candidates[0]
    assert found.name == "viscous_damping_power"
    assert abs(found.parameters[1].value - 0.7) < 3 * found.parameters[1].std < 0.3


def test_a_late_reading_is_put_back_to_its_time_on_a_record_and_extrapolated_in_flight():
    record = measured(late_s=LATE_S)
    spec = extend(mount(), [record], ["time_delay"]).spec
    before, after = compare({"before": mount(), "after": spec}, [record]).comparisons
    assert after.rmse_n < 12.5 < after.rmse_in_flight_n < 1.2 * before.rmse_n  # 0.4 s cannot be looked ahead in flight
    assert diagnose(spec, [record]).verdict == ("none",)


def test_a_reading_behind_a_slow_filter_is_late_and_no_dashpot():
    data = columns()
    model = compile_model(mount(), 1 / DT_S)
    force = model.simulate(model.inputs(data)) + np.random.default_rng(5).normal(0, 12.0, len(data["time_s"]))
    keep, x = np.exp(-DT_S / LATE_S), data["deformation_mm"]
    reading = lfilter([1 - keep], [1, -keep], x, zi=[keep * x[0]])[0]
    record = make_recording("measured", data | {"deformation_mm": reading, "force_N": force})
    found = diagnose(mount(), [record]).candidates[0]
    assert (found.effect, found.name) == ("time_delay", "time_delay_lag")
    assert found.parameters[0].value == pytest.approx(LATE_S, rel=0.1)
    assert found.rmse_after_n < 12.5


def test_a_bus_behind_a_filter_is_one_effect():
    lag_s, data = 0.3, columns()
    share = -np.expm1(-DT_S / lag_s)
    d = data["deformation_mm"]
    filtered = lfilter([share], [1.0, share - 1.0], d, zi=[(1.0 - share) * d[0]])[0]
    model = compile_model(mount(), 1 / DT_S)
    force = model.simulate(model.inputs(data)) + np.random.default_rng(5).normal(0, 12.0, len(d))
    reading = np.interp(data["time_s"] - LATE_S, data["time_s"], filtered)
    report = diagnose(mount(), [make_recording("measured", data | {"deformation_mm": reading, "force_N": force})])
    assert report.verdict == ("time_delay",)
    found = report.candidates[0]
    assert found.name == "time_delay_filter"
    assert found.rmse_after_n < 12.5
    times = {number.name: number for number in found.parameters}
    for name, true_s in (("delay_s", LATE_S), ("lag_s", lag_s)):
        assert times[name].value == pytest.approx(true_s, abs=0.08)
