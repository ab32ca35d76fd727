"""HW-PWL estimation on systems that are known."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from thrustd.core.errors import RecordingError
from thrustd.identify.artifact import finished
from thrustd.identify.fit_hw_pwl import HwSettings, empty_segments, fit_hw_pwl, pole_warnings
from thrustd.identify.hw_fit import HwFit, thin_data
from thrustd.identify.hw_problem import Point, Signal, choose_samples, normal_equations, residuals_of, simulate, squares
from thrustd.identify.hw_theta import Layout
from thrustd.identify.hw_units import Units
from thrustd.identify.segments import Segment
from thrustd.model.artifact import LinearBlock, PiecewiseLinear, RealMode, read_model, write_model
from thrustd.model.compile import check_witness, compile_model
from thrustd.records.recording import make_recording

from .hw_truth import OSCILLATING, free_run_rmse, record, truth

THREE = HwSettings(order=3)


def mixed_point():
    layout = Layout(5, 1, 1, 6)
    theta = np.zeros(layout.size)
    theta[layout.fx] = np.linspace(0, 1, 5)
    theta[layout.fy] = theta[layout.fx] ** 2
    theta[layout.poles] = np.log([0.3, 2.0, 9.0])
    theta[layout.gains] = [0.2, 0.7, 0.3]
    theta[layout.c] = 1.1
    theta[layout.hx] = np.linspace(-1, 2, 6)
    theta[layout.hy] = theta[layout.hx] + 0.1 * theta[layout.hx] ** 3
    return Point(layout, theta, np.array([[0.1, -0.05, 0.2]]))


@pytest.mark.parametrize("stride", [1, 5])
def test_the_gradient_is_exact(stride):
    point = mixed_point()
    rng = np.random.default_rng(1)
    u = np.repeat(rng.uniform(0, 1, 40), 50)
    signal = Signal(u, rng.normal(size=2000), 0.01, choose_samples(u, stride))
    normal = normal_equations(point, [signal])
    assert normal.squares == pytest.approx(squares(residuals_of(point, [signal])), rel=1e-12)
    n = point.layout.size
    for i in range(n + 3):
        step = np.zeros(n + 3)
        step[i] = 1e-6
        ends = [
            squares(
                residuals_of(
                    replace(point, theta=point.theta + s * step[:n], starts=point.starts + s * step[n:]), [signal]
                )
            )
            for s in (1, -1)
        ]
        assert -(ends[0] - ends[1]) / 4e-6 == pytest.approx(normal.gradient[i], rel=1e-5, abs=1e-5)


def test_a_long_hole_between_chosen_samples_changes_nothing():
    point = mixed_point()
    u = np.random.default_rng(1).uniform(0, 1, 1500)
    sparse = Signal(u, np.zeros(1500), 0.01, np.array([3, 700, 1499]))
    dense = Signal(u, np.zeros(1500), 0.01, np.arange(1500))
    assert normal_equations(point, [sparse]).squares == pytest.approx(
        float(np.sum(simulate(point, 0, dense)[[3, 700, 1499]] ** 2)), rel=1e-12
    )


def test_the_noise_floor_is_reached_on_unseen_data():
    spec = truth()
    data, sigma = record(spec, 30_000)
    unseen, _ = record(spec, 30_000, seed=9)
    found = fit_hw_pwl([data], THREE)
    assert found.rmse_n < 1.015 * sigma
    assert free_run_rmse(found.spec, unseen) < 1.1 * sigma
    taus = sorted(mode.tau_s for mode in found.spec.linear.real_modes)
    assert taus == pytest.approx([0.05, 2.0, 20.0], rel=0.1)


def test_scale_and_unit_do_not_matter():
    spec = truth(scale=3e-4, zero=17.0, output=0.02)
    data, sigma = record(spec, 15_000, scale=3e-4, zero=17.0)
    found = fit_hw_pwl([data], THREE)
    assert free_run_rmse(found.spec, data) < 1.02 * sigma


def test_oscillating_systems_get_complex_modes():
    spec = truth(OSCILLATING)
    data, sigma = record(spec, 12_000, hold=150)
    found = fit_hw_pwl([data], THREE)
    assert len(found.spec.linear.complex_modes) == 1
    assert free_run_rmse(found.spec, data, skip=2000) < 1.03 * sigma


def test_several_records_with_their_own_initial_states():
    spec = truth()
    first, sigma = record(spec, 30_000)
    second, sigma_2 = record(spec, 30_000, seed=4)
    cut = make_recording(
        "cut", {"time_s": second.time_s[5000:], **{name: c[5000:] for name, c in second.channels.items()}}
    )
    found = fit_hw_pwl([first, cut], THREE)
    floor = np.sqrt((len(first) * sigma**2 + len(cut) * sigma_2**2) / (len(first) + len(cut)))
    assert found.rmse_n < 1.015 * floor


def test_the_artifact_proves_itself_and_works_at_another_rate():
    spec = truth()
    data, _ = record(spec, 30_000)
    unseen, sigma = record(spec, 20_000, seed=9)
    found = fit_hw_pwl([data], THREE, name="left upper")
    done = finished(found.spec, [data], [unseen], {"order": 3})
    read = read_model(write_model(done), "model.json")
    check_witness(read, "model.json")
    assert np.median(read.error.std_n) == pytest.approx(sigma, rel=0.05)
    assert 0 < read.parameter_std["output_curve.y.5"] < 50 * sigma
    assert read.provenance["train"][0].startswith("bench ")
    ramp = np.interp(np.arange(0, 60, 0.001), np.arange(0, 61, 3.0), np.random.default_rng(0).uniform(0.1, 1.1, 21))
    fast = compile_model(read, 1000.0).simulate(ramp[:, None])
    slow = compile_model(read, 100.0).simulate(ramp[::10, None])
    assert np.abs(fast[::10] - slow).max() < 0.1 * sigma


def test_play_is_found_as_a_jump_or_a_steep_segment():
    spec = truth()
    play = msgspec.structs.replace(
        spec, input_curve=type(spec.input_curve)([0.0, 0.6, 0.6, 1.2], [0.0, 0.45, 0.75, 1.2])
    )
    data, sigma = record(play, 15_000)
    found = fit_hw_pwl([data], THREE)
    assert free_run_rmse(found.spec, data) < 1.1 * sigma
    x, y = np.array(found.spec.input_curve.x), np.array(found.spec.input_curve.y)
    assert np.interp(0.59, x, y) < np.interp(0.61, x, y) - 0.2


def test_an_even_input_curve_is_found():
    spec = truth(LinearBlock(0.0, [RealMode(3.0, 0.6), RealMode(0.3, 0.4)]))
    even = msgspec.structs.replace(
        spec,
        input_curve=PiecewiseLinear([0.0, 0.6, 1.2], [0.6, 0.0, 0.6]),
        output_curve=PiecewiseLinear([0.0, 1.2], [100.0, 6000.0]),
    )
    data, sigma = record(even, 15_000)
    found = fit_hw_pwl([data], THREE)
    assert free_run_rmse(found.spec, data) < 1.3 * sigma
    curve = found.spec.input_curve
    low, middle, high = np.interp([0.05, 0.6, 1.15], curve.x, curve.y)
    assert abs(low - high) < 0.2 * abs(low - middle)


def test_records_too_thin_for_so_many_numbers_are_called_so():
    assert thin_data(1.2) == ()
    assert "record longer" in thin_data(2.0)[0]


def test_a_constant_input_is_refused():
    flat = make_recording("flat", {"time_s": np.arange(500.0), "deformation_mm": np.ones(500), "force_N": np.ones(500)})
    with pytest.raises(RecordingError, match="flat: deformation_mm is 1 all the time"):
        fit_hw_pwl([flat])


def test_a_time_constant_on_its_bound_is_reported():
    point = mixed_point()
    point.theta[point.layout.poles][0] = np.log(50.0)
    segment = Segment("bench", 0.0, 0.01, {"deformation_mm": np.linspace(0, 1, 500)}, np.zeros(500))
    fit = HwFit(point, Units(0.0, 1.0, 0.0, 1.0), [segment], 0.1, (0.003, 50.0))
    (line,) = pole_warnings(fit)
    assert "50 s is on the bound" in line
    assert "record longer" in line


def test_segments_without_data_are_reported():
    segment = Segment("bench", 0.0, 0.01, {"deformation_mm": np.linspace(0, 0.5, 500)}, np.zeros(500))
    fit = HwFit(mixed_point(), Units(0.0, 1.0, 0.0, 1.0), [segment], 0.1, (0.003, 50.0))
    assert [line[:22] for line in empty_segments(fit)] == ["input curve: 1 samples", "input curve: 0 samples"]


def test_samples_are_chosen_evenly_and_only_where_there_is_a_reference():
    y = np.ones(1000)
    y[200:300] = np.nan
    chosen = choose_samples(y, 10)
    assert np.all(np.diff(chosen) > 0)
    assert not np.any((chosen >= 200) & (chosen < 300))
    assert len(chosen) == 90


def test_a_record_whose_reference_is_missing_where_a_block_is_held_back_is_fitted():
    data, _ = record(truth(), 6000)
    at = np.arange(len(data)) / len(data)
    holed = data.with_channels(force_N=np.where((at >= 0.55) & (at < 0.85), np.nan, data["force_N"]))
    found = fit_hw_pwl([holed], HwSettings(order=2, input_shape="line", output_shape="cubic"))
    assert np.isfinite(free_run_rmse(found.spec, data))
    assert free_run_rmse(found.spec, data) < 0.2 * float(np.std(data["force_N"]))
