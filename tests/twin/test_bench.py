"""Bench records: the programme, the noise, and what the thesis saw in them."""

import numpy as np
import pytest

from thrustd.bench.plan_test import BenchPlan, programme
from thrustd.core.errors import RecordingError
from thrustd.records.recording import make_recording
from thrustd.twin.bench import RIG, Rig, multisine_bench, programme_bench, sine_bench, step_bench, weight_bench
from thrustd.twin.mount import UPPER
from thrustd.twin.sensors import COUNT_MM, Lvdt, lvdt_reading, to_counts

SLOW = Rig(sample_hz=10.0)


@pytest.fixture(scope="module")
def steps():
    return step_bench(4.0, seed=3, rig=SLOW)


def rmse_of_cubic(record) -> float:
    x, force_n = record["deformation_mm"], record["force_N"]
    return float(np.std(force_n - np.polyval(np.polyfit(x, force_n, 3), x)))


def test_same_seed_same_record():
    one, two, other = (step_bench(0.05, seed, rig=SLOW) for seed in (5, 5, 6))
    assert np.array_equal(one["deformation_mm"], two["deformation_mm"])
    assert not np.array_equal(one["deformation_mm"], other["deformation_mm"])


def test_range_and_rate(steps):
    assert len(steps) == 4 * 3600 * 10
    assert steps.sample_hz == pytest.approx(10.0)
    assert 300 < steps["force_N"].min() < 800
    assert 6000 < steps["force_N"].max() < 6600


def test_a_static_model_is_about_as_wrong_as_in_the_thesis(steps):
    assert rmse_of_cubic(steps) == pytest.approx(103, abs=35)


def test_without_friction_and_relaxation_only_noise_is_left():
    plain = UPPER._replace(friction_n=(), friction_mm=(), relaxation=(0.0,), relaxation_s=(1.0,))
    assert rmse_of_cubic(step_bench(0.5, 1, plain, SLOW)) == pytest.approx(12, abs=1)


def test_a_sine_draws_a_loop():
    record = sine_bench(1.0, seed=1, rig=SLOW)
    x, force_n = record["deformation_mm"], record["force_N"]
    rising = np.gradient(np.convolve(x, np.ones(50) / 50, mode="same")) > 0
    middle = (x > 0.4) & (x < 0.6) & (record.time_s > 400)
    trend = np.polyval(np.polyfit(x[middle], force_n[middle], 1), x)
    assert (force_n - trend)[middle & rising].mean() - (force_n - trend)[middle & ~rising].mean() > 100


def test_multisine_fills_the_range():
    record = multisine_bench(0.5, seed=1, rig=SLOW)
    assert np.ptp(record["force_N"]) == pytest.approx(6100, abs=120)


def test_weight_steps_move_the_deformation():
    record = weight_bench(1.0, seed=1, rig=SLOW)
    assert np.ptp(record["accel_z_g"]) > 2
    assert rmse_of_cubic(record) > 0


def test_lvdt_reading_clip_and_quantise():
    rng = np.random.default_rng(0)
    quiet = Lvdt(noise_mm=0.0, zero_mm=0.001)
    assert lvdt_reading(quiet, np.array([1.0]), rng)[0] == round(1.001 / COUNT_MM) * COUNT_MM
    assert to_counts(quiet, np.array([99.0, -99.0])).tolist() == [2**23 - 1, -(2**23)]


def test_a_programme_of_plan_test_is_run_from_rest():
    plan = BenchPlan(hours=0.1, seed=4)
    command = make_recording("weight", programme("weight", plan))
    record = programme_bench(command, seed=2, rig=RIG._replace(load_cell_std_n=0.0))
    assert record.sample_hz == pytest.approx(RIG.sample_hz)
    at = np.interp(record.time_s, command.time_s, command["force_N"])
    assert np.std(record["force_N"] - at) < 3 * RIG.wander_n
    assert record["accel_z_g"] == pytest.approx(np.interp(record.time_s, command.time_s, command["accel_z_g"]))
    assert abs(np.mean(record["deformation_mm"][:1000])) < 0.02


def test_a_table_that_commands_no_force_is_no_programme():
    with pytest.raises(RecordingError, match="table: no force_N to command"):
        programme_bench(make_recording("table", {"time_s": np.arange(100.0), "accel_z_g": np.ones(100)}), seed=1)
