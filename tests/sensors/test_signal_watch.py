"""One sensor alone: a jump is undone by the way back, whatever it looks like, and by nothing else."""

from math import inf, nan

import numpy as np
import pytest
from msgspec.structs import replace

from thrustd.core.aircraft import SensorLimits
from thrustd.sensors.signal_watch import SignalWatch, limit_rows, watch
from thrustd.sensors.watch_row import fresh_rows

LIMITS = SensorLimits(jump=0.5, noise=0.3, stuck_s=10.0, rate=1.0, low=-3.0, high=5.0)
CALM_STEPS, SENSORS = 50, 6
RNG = np.random.default_rng(1)


def calm(steps, value=1.0):
    return list(value + 0.01 * RNG.standard_normal(steps))


def kinds(values, limits=LIMITS):
    """What is said after each value at 10 Hz."""
    rows, limits = fresh_rows(SENSORS), limit_rows([limits] * SENSORS)
    said = []
    for value in values:
        watch(rows, limits, np.full(SENSORS, value), 1, 1)
        said.append(SignalWatch(rows[-1]).kind)
    return said


@pytest.mark.parametrize(
    "fault",
    [
        [4.0] * 15,
        [3.0] * 30 + [2.0],  # the way back between two looks: two half jumps
        [4.0] * 15 + [2.5] * 15,
        [4.0] * 15 + [-2.0] * 15,
        [0.0] * 15 + [nan] * 2 + [0.0] * 10,
        [0.0] * 15 + [nan] * 2,
        list(RNG.uniform(-2.0, 4.0, 30)),
    ],
    ids=["jump", "half jumps", "steps", "too far", "gap", "back in the gap", "loose contact"],
)
def test_a_sensor_that_is_back_where_it_was_is_trusted_again(fault):
    said = kinds([*calm(CALM_STEPS), *fault, *calm(100)])
    assert any(said)
    assert said[-1] == ""


@pytest.mark.parametrize("steps", [4, 7, 13, 30, 300])
@pytest.mark.parametrize("noise", [LIMITS.noise, inf], ids=["read often", "read seldom"])
def test_a_sensor_that_scattered_is_trusted_within_ten_seconds_of_rest(steps, noise):
    limits = replace(LIMITS, noise=noise)
    for seed in range(20):
        scatter = list(np.random.default_rng(seed).uniform(-8.0, 8.0, steps))
        said = kinds([*calm(CALM_STEPS), *scatter, *calm(100)], limits)
        assert said[-1] == "", seed


def test_a_sensor_that_scatters_beyond_its_range_is_noisy_though_it_is_missing_now_and_then():
    scatter = RNG.uniform(-8.0, 8.0, 100)
    scatter[::7] = nan
    assert kinds([*calm(CALM_STEPS), *scatter])[-60:] == ["noisy"] * 60


def test_a_sensor_that_scattered_while_the_aircraft_went_elsewhere_is_trusted_there():
    assert kinds([*calm(CALM_STEPS), *RNG.uniform(-8.0, 8.0, 300), *calm(100, 3.0)])[-1] == ""


def test_a_sensor_that_came_and_went_while_the_aircraft_went_elsewhere_is_trusted_there():
    """Too seldom to be noise, and no jump since shows where it should be."""
    assert kinds([*calm(CALM_STEPS), *[0.0] * 8, 4.0, *[0.0] * 9, 2.0, *[0.0] * 9, *calm(100, 3.0)])[-1] == ""


@pytest.mark.parametrize(
    "fault",
    [calm(300, 2.5), [*calm(15, 2.5), nan, nan, *calm(300, 2.5)], list(np.linspace(2.5, 1.0, 300))],
    ids=["stays", "gap", "the others come to it"],
)
def test_a_jump_that_was_not_undone_stays_a_fault(fault):
    assert kinds([*calm(CALM_STEPS), *fault])[-1] == "offset"


def test_a_jump_in_doubt_that_is_undone_behind_a_gap_accuses_nobody():
    assert not any(kinds([*calm(CALM_STEPS), *[0.0] * 5, nan, nan, *[0.0] * 3, *calm(100)]))


@pytest.mark.parametrize("phase", range(10))
def test_a_sender_at_our_own_pace_is_not_noisy_in_a_ramp(phase):
    """A step hears a value twice and the next leaves one out: of 1 a step, three times what noise may be."""
    times = np.arange(120) + 0.06 * np.random.default_rng(phase).uniform(-1.0, 1.0, 120)
    at = np.floor(times + 0.01 * (phase - 5))  # the newest reading of a sender
    ramp = np.clip(at - CALM_STEPS, 0.0, 40.0)
    limits = replace(LIMITS, jump=3.0, rate=inf, high=50.0)
    assert not any(kinds(list(ramp), limits))


@pytest.mark.parametrize("held", [1, 2])
def test_scatter_is_noisy_however_often_it_is_read(held):
    scatter = np.repeat(0.35 * np.random.default_rng(2).standard_normal(100), held)
    assert kinds([*calm(CALM_STEPS), *scatter], replace(LIMITS, jump=8.0))[-20:] == ["noisy"] * 20
