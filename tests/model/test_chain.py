"""A chain of stages: per-sample flight and block simulation are one implementation."""

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from thrustd.core.errors import ModelError
from thrustd.model.artifact import (
    SCHEMA,
    ComplexMode,
    EffectSpec,
    LinearBlock,
    ModelSpec,
    PiecewiseLinear,
    RealMode,
    ValidRange,
    read_model,
    write_model,
)
from thrustd.model.compile import check_witness, compile_model, witness_of
from thrustd.model.stage import free_run


def spec(**changes):
    knots = np.linspace(0.0, 1.2, 11)
    base = ModelSpec(
        schema=SCHEMA,
        name="test mount",
        structure="hw-pwl",
        input_curve=PiecewiseLinear(knots.tolist(), (knots + 0.1 * knots**3).tolist()),
        linear=LinearBlock(1.6, [RealMode(tau, -0.1) for tau in (0.05, 0.5, 3.0, 20.0, 200.0, 2000.0)]),
        output_curve=PiecewiseLinear(knots.tolist(), (5500 * knots).tolist()),
        valid=ValidRange((0.0, 1.2), (0.0, 6600.0)),
        effects=[
            EffectSpec("axial_inertia", {"mass_kg": 186.5}),
            EffectSpec("engine_weight", {"stiffening_1_n": 1e-5}),
        ],
    )
    return msgspec.structs.replace(base, **changes)


def inputs(n, seed=0):
    rng = np.random.default_rng(seed)
    return {
        "deformation_mm": np.cumsum(rng.normal(0, 0.01, n)) * 0.1 + 0.6,
        "accel_x_g": rng.normal(0, 0.1, n),
        "accel_z_g": 1 + rng.normal(0, 0.3, n),
    }


def test_sample_by_sample_equals_block_bit_for_bit():
    model = compile_model(spec(), 100.0)
    rows = model.inputs(inputs(500))
    state = model.start(rows[0])
    assert np.array_equal([model.step(state, row[1:], row[0]) for row in rows], model.simulate(rows))


def test_blocks_continue_from_a_state():
    model = compile_model(spec(), 100.0)
    rows = model.inputs(inputs(200))
    whole = model.simulate(rows)
    state = model.start(rows[0])
    parts = [model.simulate(rows[:77], state), model.simulate(rows[77:], state)]
    assert np.array_equal(np.concatenate(parts), whole)


def test_columns_mapped_from_a_file_cannot_be_written_and_run_all_the_same():
    stage = compile_model(spec(effects=[]), 100.0).stages[0]
    column = inputs(100)["deformation_mm"]
    free = stage.run(stage.start(np.empty(0), 0.0), np.empty((100, 0)), column)
    column.flags.writeable = False
    assert np.array_equal(stage.run(stage.start(np.empty(0), 0.0), np.empty((100, 0)), column), free)


def test_a_reading_that_cannot_be_written_runs_through_a_model_of_one_channel():
    """Nothing reads the rubber's deformation there, so nothing is written: an `identify` ended in a traceback."""
    model = compile_model(spec(effects=[]), 100.0)
    deformation = inputs(50)["deformation_mm"][:, None]
    expected = model.simulate(deformation.copy())
    deformation.flags.writeable = False
    assert np.array_equal(model.simulate(deformation), expected)


def test_at_rest_the_force_is_the_static_one():
    model = compile_model(spec(effects=[]), 100.0)
    force_n = model.simulate(np.full((1000, 1), 0.5))
    static_n = 5500 * np.interp(
        0.5, np.linspace(0, 1.2, 11), np.linspace(0, 1.2, 11) + 0.1 * np.linspace(0, 1.2, 11) ** 3
    )
    assert force_n == pytest.approx(np.full(1000, static_n), rel=1e-12)


def test_one_model_at_two_rates_gives_the_same_force():
    time_s = np.arange(0, 60, 0.001)
    deformation_mm = 0.6 + 0.2 * np.sin(0.7 * time_s) + 0.1 * np.sin(5.0 * time_s)
    fast = compile_model(spec(effects=[]), 1000.0).simulate(deformation_mm[:, None])
    slow = compile_model(spec(effects=[]), 100.0).simulate(deformation_mm[::10, None])
    assert np.abs(fast[::10] - slow).max() < 0.5


def test_inertia_and_weight_have_the_signs_of_the_thesis():
    still = {"deformation_mm": np.full(5, 0.9), "accel_x_g": np.zeros(5), "accel_z_g": np.ones(5)}
    model = compile_model(spec(), 100.0)
    rest_n = model.simulate(model.inputs(still))[-1]
    accelerating = model.simulate(model.inputs(still | {"accel_x_g": np.full(5, 0.1)}))[-1]
    assert accelerating - rest_n == pytest.approx(186.5 * 9.80665 * 0.1)
    pulling = model.simulate(model.inputs(still | {"accel_z_g": np.full(5, 2.0)}))[-1]
    assert pulling / rest_n - 1 == pytest.approx(1081.0 * 1e-5)


def test_complex_modes_oscillate_and_settle_at_dc_gain():
    linear = LinearBlock(0.0, [], [ComplexMode(1.0, 20.0, 1.0, 0.05)])
    straight = PiecewiseLinear([0.0, 1.0], [0.0, 1.0])
    model = compile_model(spec(linear=linear, input_curve=straight, output_curve=straight, effects=[]), 200.0)
    step_response = model.simulate(np.concatenate((np.zeros(1), np.ones(4000)))[:, None])
    assert step_response.max() > 1.3
    assert step_response[-1] == pytest.approx(1.0, abs=1e-6)


def test_a_jump_in_a_curve_is_representable():
    play = PiecewiseLinear([0.0, 0.3, 0.3, 1.0], [0.0, 0.3, 0.5, 1.2])
    straight = PiecewiseLinear([0.0, 1.0], [0.0, 1.0])
    model = compile_model(spec(linear=LinearBlock(1.0), input_curve=play, output_curve=straight, effects=[]), 100.0)
    got = model.simulate(np.array([[0.2], [0.2999], [0.3], [0.4], [2.0], [-1.0]]))
    assert got == pytest.approx([0.2, 0.2999, 0.5, 0.6, 2.2, -1.0])


@settings(max_examples=50, deadline=None)
@given(
    widths=st.lists(st.floats(1e-3, 10), min_size=1, max_size=12),
    heights=st.lists(st.floats(-10, 10), min_size=13, max_size=13),
    v=st.floats(-20, 140),
)
def test_piecewise_linear_agrees_with_interpolation(widths, heights, v):
    x = np.concatenate(([0.0], np.cumsum(widths)))
    y = np.array(heights[: x.size])
    straight = PiecewiseLinear([0.0, 1.0], [0.0, 1.0])
    curve = PiecewiseLinear(x.tolist(), y.tolist())
    model = compile_model(spec(linear=LinearBlock(1.0), input_curve=curve, output_curve=straight, effects=[]), 100.0)
    got = model.simulate(np.array([[v]]))[0]
    if v < x[0]:
        expected = y[0] + (v - x[0]) * (y[1] - y[0]) / (x[1] - x[0])
    elif v > x[-1]:
        expected = y[-1] + (v - x[-1]) * (y[-1] - y[-2]) / (x[-1] - x[-2])
    else:
        expected = np.interp(v, x, y)
    assert got == pytest.approx(expected, rel=1e-9, abs=1e-9 * max(1, np.abs(y).max(), abs(expected)))


def test_an_artifact_survives_its_file_and_proves_itself():
    proven = msgspec.structs.replace(spec(), witness=witness_of(spec(), 100.0, inputs(30)))
    read = read_model(write_model(proven), "mount.json")
    assert read == proven
    check_witness(read, "mount.json")


def test_a_changed_artifact_is_refused():
    proven = msgspec.structs.replace(spec(), witness=witness_of(spec(), 100.0, inputs(30)))
    changed = msgspec.structs.replace(proven, linear=LinearBlock(1.7, list(proven.linear.real_modes)))
    with pytest.raises(ModelError, match=r"mount\.json: witness row"):
        check_witness(changed, "mount.json")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text.replace("thrustd-model/1", "thrustd-model/9"), "schema"),
        (lambda text: text.replace('"direct"', '"dierct"'), "dierct"),
        (lambda text: text[:100], "truncated"),
        (lambda text: text.replace('"tau_s": 0.05', '"tau_s": -0.05'), "tau_s"),
        (lambda text: "PK\x03\x04", "malformed"),
        (lambda text: text.replace("[\n   0.0,\n   1.2\n  ]", "[\n   1.2,\n   0.0\n  ]"), "low < high"),
    ],
)
def test_a_malformed_artifact_is_refused_in_one_line(change, message):
    text = change(write_model(spec()))
    assert text != write_model(spec())
    with pytest.raises(ModelError, match=r"^mount\.json: ") as raised:
        read_model(text, "mount.json")
    assert message in str(raised.value)
    assert "\n" not in str(raised.value)


RUBS_AND_GROWS = [
    EffectSpec("thermal_expansion", {"expansion_mm_k": 0.01, "reference_degc": 0.0}),
    EffectSpec("hysteresis_coulomb", {"friction_n": 100.0}),
]


def test_friction_feels_the_rubber_and_not_what_the_reading_adds():
    warming = inputs(500) | {"temperature_degC": np.linspace(0.0, 20.0, 500)}
    read = warming | {"deformation_mm": warming["deformation_mm"] + 0.01 * warming["temperature_degC"]}
    there = compile_model(spec(effects=RUBS_AND_GROWS[1:]), 100.0)
    seen = compile_model(spec(effects=RUBS_AND_GROWS), 100.0)
    assert seen.simulate(seen.inputs(read)) == pytest.approx(there.simulate(there.inputs(warming)), abs=1e-6)


def test_a_corrected_deformation_is_the_same_sample_by_sample_over_a_block_and_stage_by_stage():
    model = compile_model(spec(effects=RUBS_AND_GROWS), 100.0)
    columns = inputs(500) | {"temperature_degC": np.linspace(0.0, 20.0, 500)}
    rows = model.inputs(columns)
    state, before = model.start(rows[0]), rows.copy()
    block = model.simulate(rows)
    assert np.array_equal([model.step(state, row[1:], row[0]) for row in rows], block)
    assert np.array_equal(rows, before)
    assert np.array_equal(free_run(model.stages, columns, columns["deformation_mm"]), block)
