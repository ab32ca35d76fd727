"""Bench programmes."""

import numpy as np
import pytest

from thrustd.bench.plan_test import PROGRAMMES, BenchPlan, as_csv, programme
from thrustd.core.errors import UsageError

HOUR = BenchPlan(hours=1.0)
BEGIN = 650  # samples at rest and of the ramp that follows


@pytest.mark.parametrize("kind", PROGRAMMES)
def test_every_programme_stays_within_what_the_rig_may_do(kind):
    columns = programme(kind, HOUR)
    assert len(columns["time_s"]) == 36_000
    moving_n = columns["force_N"][BEGIN:]
    assert moving_n.min() >= -1e-9
    assert moving_n.max() <= 9000.0 + 1e-9
    assert np.ptp(moving_n) > 4000.0


@pytest.mark.parametrize("kind", PROGRAMMES)
def test_every_programme_begins_at_rest_for_a_minute_and_nothing_jumps(kind):
    columns = programme(kind, HOUR)
    assert np.all(columns["force_N"][:600] == 0.0)
    assert columns["force_N"][600] == 0.0
    assert (
        np.abs(np.diff(columns["force_N"][: BEGIN + 10])).max() < 0.16 * 9000.0
    )  # half a cosine over the whole range in 1 s, N in 0.1 s
    assert np.all(columns.get("accel_z_g", np.ones(600))[:600] == 1.0)


def test_a_programme_is_the_same_for_the_same_seed():
    assert np.array_equal(programme("steps", HOUR)["force_N"], programme("steps", HOUR)["force_N"])
    other = programme("steps", BenchPlan(hours=1.0, seed=1))["force_N"]
    assert not np.array_equal(programme("steps", HOUR)["force_N"], other)


@pytest.mark.parametrize("seed", range(10))
def test_steps_hold_both_ends_and_every_part_of_the_range_as_often(seed):
    plan = BenchPlan(hours=4.0, low_n=-1500.0, seed=seed)
    force_n = programme("steps", plan)["force_N"][BEGIN:]
    for end_n in (-1500.0, 9000.0):
        assert 0.04 < np.mean(force_n == end_n) < 0.17
    parts = np.histogram(force_n, np.linspace(-1500.0, 9000.0, 11))[0] / len(force_n)
    assert parts.min() > 0.04 and parts.max() < 0.17
    load_g = programme("weight", BenchPlan(hours=4.0, seed=seed))["accel_z_g"][BEGIN:]
    assert np.mean(load_g == 0.0) > 0.04 and np.mean(load_g == 3.0) > 0.04


def test_the_multisine_has_power_in_its_band_only():
    force_n = programme("multisine", HOUR)["force_N"][BEGIN:]
    power = np.abs(np.fft.rfft((force_n - force_n.mean()) * np.hanning(len(force_n)))) ** 2
    frequency_hz = np.fft.rfftfreq(len(force_n), 0.1)
    assert power[frequency_hz > 1.1].sum() < 1e-4 * power.sum()


def test_weight_steps_move_both_force_and_load():
    columns = programme("weight", HOUR)
    assert np.ptp(columns["accel_z_g"]) > 1.5
    assert abs(np.corrcoef(columns["force_N"], columns["accel_z_g"])[0, 1]) < 0.7


def test_the_csv_begins_with_the_canonical_names():
    text = as_csv(programme("weight", BenchPlan(hours=0.1)))
    assert text.splitlines()[0] == "time_s,force_N,accel_z_g"
    assert len(text.splitlines()) == 3601


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: BenchPlan(low_n=10.0, high_n=5.0), "expected low < high"),
        (lambda: BenchPlan(high_n=1e9), "force_N from 0 to 1e.09, expected low < high within -20000 to 20000"),
        (lambda: BenchPlan(hours=0.001), "0.001 h, expected 0.05 to 1000"),
        (lambda: BenchPlan(hours=float("nan")), "nan h, expected"),
        (lambda: BenchPlan(sample_hz=1.0), "twice the highest frequency"),
        (lambda: programme("triangle", HOUR), "programme 'triangle', expected one of steps"),
    ],
)
def test_impossible_plans_are_refused(make, message):
    with pytest.raises(UsageError, match=message):
        make()
