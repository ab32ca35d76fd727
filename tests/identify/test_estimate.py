"""Estimation of any parameters through the stages of a model."""

import msgspec
import numpy as np
import pytest

from thrustd.core.errors import ModelError, RecordingError
from thrustd.identify.estimate import estimate
from thrustd.identify.parameters import pack, unpack
from thrustd.identify.segments import segments_of
from thrustd.identify.sensitivity import jacobian, residuals, segments_for
from thrustd.model.artifact import (
    SCHEMA,
    ComplexMode,
    EffectSpec,
    Feedback,
    LinearBlock,
    ModelSpec,
    PiecewiseLinear,
    RealMode,
    ValidRange,
)
from thrustd.model.compile import compile_model
from thrustd.records.recording import make_recording


def mount(**changes):
    x = np.linspace(0.0, 1.2, 6)
    base = ModelSpec(
        schema=SCHEMA,
        name="test mount",
        structure="hw-pwl",
        input_curve=PiecewiseLinear(x.tolist(), (x + 0.1 * x**3).tolist()),
        linear=LinearBlock(1.3, [RealMode(0.5, -0.1), RealMode(20.0, -0.2)], [ComplexMode(1.0, 3.0, 0.05, 0.02)]),
        output_curve=PiecewiseLinear(x.tolist(), (5000 * x).tolist()),
        valid=ValidRange((0.0, 1.2), (0.0, 6600.0)),
        effects=[EffectSpec("axial_inertia", {"mass_kg": 0.0}), EffectSpec("engine_weight", {"stiffening_1_n": 0.0})],
    )
    return msgspec.structs.replace(base, **changes)


def record(spec, n=6000, rate_hz=20.0, noise_n=0.0, seed=1, **extra):
    rng = np.random.default_rng(seed)
    steps = np.repeat(rng.uniform(0.1, 1.1, n // 200 + 1), 200)[:n]
    columns = {
        "deformation_mm": steps + 0.02 * np.sin(np.arange(n) * 0.7),
        "accel_x_g": 0.2 * np.sin(np.arange(n) * 0.01),
        "accel_z_g": 1.0 + np.repeat(rng.uniform(-0.5, 1.0, n // 300 + 1), 300)[:n],
    } | extra
    model = compile_model(spec, rate_hz)
    force_n = model.simulate(model.inputs(columns)) + rng.normal(0, 1, n) * noise_n
    return make_recording("bench", {"time_s": np.arange(n) / rate_hz, "force_N": force_n, **columns})


def only(spec, data):
    (segment,) = segments_for(spec, [data])
    return segment


def fitted(spec, data, which, **options):
    """(values by name, RMS of the residual, N)."""
    found = estimate(spec, [only(spec, data)], which, **options)
    return pack(found.spec, which).as_dict(), found.rmse_n


def test_packing_and_unpacking_everything_changes_nothing():
    spec = mount()
    assert unpack(spec, pack(spec)) == msgspec.structs.replace(
        spec,
        linear=unpack(spec, pack(spec, ["linear.*"])).linear,
    )
    assert pack(unpack(spec, pack(spec))).values == pytest.approx(pack(spec).values, rel=1e-12)


def test_an_unknown_pattern_is_named():
    with pytest.raises(ModelError, match=r"no parameter matches 'hysteresis\.\*'"):
        pack(mount(), ["hysteresis.*"])


def test_residuals_are_those_of_the_compiled_model():
    spec = mount(effects=[EffectSpec("axial_inertia", {"mass_kg": 100.0})])
    assert np.abs(residuals(spec, only(spec, record(spec)))).max() < 1e-9


def test_jacobian_agrees_with_differences_of_whole_simulations():
    spec = mount(effects=[EffectSpec("axial_inertia", {"mass_kg": 100.0}), EffectSpec("engine_weight", {})])
    data = only(spec, record(spec))
    vector = pack(spec)
    columns = jacobian(spec, data, vector)[1]
    for i in range(len(vector)):
        step = 1e-5 * vector.scale[i]
        values = vector.values.copy()
        values[i] += step
        moved = residuals(unpack(spec, vector.at(values)), data)
        size = np.abs(columns[:, i]).max()
        difference = np.abs(-moved / step - columns[:, i])
        assert np.quantile(difference, 0.99) < 1e-3 * size + 1e-6, vector.names[i]


def fed_back():
    """Two real modes with a hardening spring and other products fed back, far enough to leave the data."""
    rng = np.random.default_rng(3)
    into = (0.05 * rng.normal(size=(2, 16))).tolist()
    feedback = Feedback(3, [0.6, 0.6, 0.6], [0.4, 0.4, 0.4], [[1.0, 0, 0], [-0.5, 1.2, 0], [0.2, 0.1, 0.9]], into)
    linear = LinearBlock(0.4, [RealMode(0.5, 0.3), RealMode(4.0, 0.3)], feedback=feedback)
    return mount(linear=linear, effects=[])


BETWEEN = mount(output_linear=LinearBlock(0.3, [RealMode(1.0, 0.5)], [ComplexMode(2.0, 5.0, 0.2, 0.1)]), effects=[])


@pytest.mark.parametrize("spec", [BETWEEN, fed_back()], ids=["two linear blocks", "feedback"])
def test_changes_carried_downstream_are_those_of_whole_simulations(spec):
    data = only(spec, record(spec))
    vector = pack(spec)
    columns = jacobian(spec, data, vector)[1]
    for i in range(len(vector)):
        step = 1e-6 * vector.scale[i]
        ends = []
        for sign in (1, -1):
            values = vector.values.copy()
            values[i] += sign * step
            ends.append(-residuals(unpack(spec, vector.at(values)), data))
        difference = np.abs((ends[0] - ends[1]) / (2 * step) - columns[:, i])
        assert np.quantile(difference, 0.99) < 1e-3 * np.abs(columns[:, i]).max() + 1e-6, vector.names[i]


def test_effects_and_curves_are_found_again():
    truth = mount(
        effects=[
            EffectSpec("axial_inertia", {"mass_kg": 186.5}),
            EffectSpec("engine_weight", {"stiffening_1_n": 1e-5}),
        ]
    )
    data = record(truth, noise_n=10.0)
    start = mount(output_curve=PiecewiseLinear([0.0, 1.2], [0.0, 5800.0]))
    values, rmse_n = fitted(start, data, ["axial_inertia.*", "engine_weight.*", "output_curve.y.*"])
    assert rmse_n == pytest.approx(10.0, rel=0.03)
    for name, true in (("axial_inertia.mass_kg", 186.5), ("engine_weight.stiffening_1_n", 1e-5)):
        assert values[name] == pytest.approx(true, rel=0.02)


def test_time_constants_are_found_again():
    truth = mount(effects=[], linear=LinearBlock(1.5, [RealMode(0.4, -0.2), RealMode(15.0, -0.3)]))
    start = mount(effects=[], linear=LinearBlock(1.2, [RealMode(0.2, -0.1), RealMode(40.0, -0.1)]))
    found = estimate(start, [only(truth, record(truth, noise_n=1.0))], ["linear.*"], 50)
    modes = found.spec.linear.real_modes
    assert sorted(mode.tau_s for mode in modes) == pytest.approx([0.4, 15.0], rel=0.02)
    assert sorted(mode.gain for mode in modes) == pytest.approx([-0.3, -0.2], rel=0.02)


def test_a_prior_keeps_parameters_near_their_start():
    truth = mount(effects=[EffectSpec("axial_inertia", {"mass_kg": 100.0})])
    data = record(truth, noise_n=5.0)
    start = mount(effects=[EffectSpec("axial_inertia", {"mass_kg": 90.0})])
    values, _ = fitted(start, data, ["axial_inertia.*"], prior_std={"axial_inertia.mass_kg": 1e-3})
    assert values["axial_inertia.mass_kg"] == pytest.approx(90.0, abs=0.5)


def test_parameters_stay_inside_their_bounds():
    truth = mount(effects=[EffectSpec("axial_inertia", {"mass_kg": 990.0})])
    data = record(truth)
    louder = data.with_channels(force_N=data["force_N"] + 500 * 9.80665 * data["accel_x_g"])
    found = estimate(truth, [only(truth, louder)], ["axial_inertia.*"])
    assert pack(found.spec, ["axial_inertia.*"]).values.tolist() == [1000.0]


def test_what_is_remembered_outlasts_gaps_and_holes():
    data = record(mount())
    kept = np.r_[0:3000, 3200 : len(data)]
    deformation = data["deformation_mm"].copy()
    deformation[1000:1003] = np.nan  # a few values: nothing is lost
    deformation[2000:2100] = np.nan
    broken = data.with_channels(deformation_mm=deformation).rows(kept)
    (part,) = segments_of([broken])
    assert part.time_s == pytest.approx(data.time_s)
    assert np.isfinite(part.inputs["deformation_mm"]).all()
    counted = np.isfinite(part.force_n)
    assert counted[:2000].all() and not counted[2000:2199].any() and counted[2202:2999].all()
    assert not counted[3001:3399].any() and counted[3402:].all()
    assert part.force_n[counted] == pytest.approx(data["force_N"][counted])


def test_a_gap_longer_than_all_that_was_measured_splits_a_record():
    data = record(mount())
    time_s = data.time_s.copy()
    time_s[3000:] += 1.01 * data.duration_s
    parts = segments_of([make_recording("bench", {"time_s": time_s, **data.channels})])
    assert [len(part) for part in parts] == [3000, 3000]


def test_too_short_a_record_is_refused():
    data = record(mount()).rows(slice(0, 10))
    with pytest.raises(RecordingError, match="too short"):
        segments_of([data])
