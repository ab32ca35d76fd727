"""The state at the first sample of a record."""

import numpy as np
import pytest
from scipy.signal import lfilter

from thrustd.identify.first_state import simulated
from thrustd.identify.report import errors_of
from thrustd.identify.segments import Segment, segments_of
from thrustd.identify.structures.structure import of_spec
from thrustd.records.recording import make_recording

from .hw_truth import OSCILLATING, record, truth


def cut(data, first):
    columns = {name: column[first:] for name, column in data.channels.items()}
    return segments_of([make_recording("cut", {"time_s": data.time_s[first:], **columns})])


def test_a_record_that_begins_in_the_middle_is_judged_from_the_state_there():
    for linear in (truth().linear, OSCILLATING):
        spec = truth(linear)
        data, sigma = record(spec, 6000, hold=150)
        errors = errors_of(of_spec(spec, 0), cut(data, 1337))
        assert errors.rmse_from_rest_n > 1.5 * sigma
        assert errors.rmse_n < 1.2 * sigma


def test_a_record_that_begins_at_rest_is_judged_from_there():
    spec = truth()
    data, sigma = record(spec, 6000)
    errors = errors_of(of_spec(spec, 0), segments_of([data]))
    assert errors.rmse_n == errors.rmse_from_rest_n < 1.05 * sigma


def test_without_a_reference_in_the_first_stretch_nothing_is_estimated():
    spec = truth()
    data, _ = record(spec, 6000)
    force_n = np.where(np.arange(6000) < 3000, np.nan, data["force_N"] + 500.0)
    errors = errors_of(of_spec(spec, 0), segments_of([data.with_channels(force_N=force_n)]))
    assert errors.rmse_n == errors.rmse_from_rest_n


def test_with_a_reference_in_the_first_stretch_only_nothing_is_estimated():
    spec = truth()
    data, _ = record(spec, 6000)
    force_n = np.where(np.arange(6000) < 500, data["force_N"] + 500.0, np.nan)
    errors = errors_of(of_spec(spec, 0), segments_of([data.with_channels(force_N=force_n)]))
    assert errors.rmse_n == errors.rmse_from_rest_n


@pytest.mark.parametrize("seed", [0, 4, 11])
def test_of_a_state_and_its_opposite_behind_an_even_curve_the_right_one_is_found(seed):
    """|x + 0.3| behind a lag, begun between two levels, seen through noise that hides how wrong the other state is."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], 60), 5)
    u[:25], u[25:30] = 1.0, -1.0
    a = np.exp(-0.02 / 0.4)

    def simulate(segment):
        d = segment.inputs["deformation_mm"]
        return np.abs(lfilter([0.0, 1 - a], [1.0, -a], d, zi=[d[0]])[0] + 0.3)

    clean = simulate(Segment("even", 0.0, 0.02, {"deformation_mm": u}, u))[25:]
    y = clean + 0.2 * rng.standard_normal(len(clean))
    later = Segment("even", 0.5, 0.02, {"deformation_mm": u[25:]}, y)
    assert np.abs(simulated(simulate, later, simulate(later)) - clean).max() < 0.2


@pytest.mark.parametrize("seed", [0, 2, 5])
def test_what_a_model_gets_wrong_for_minutes_is_no_past(seed):
    """Stairs from rest, a model with branches of up to an hour, errors that last for half a stretch."""
    u = np.interp(np.arange(600), np.arange(0, 600, 75), np.repeat(np.arange(4.0), 2))
    errs = lfilter([0.01], [1.0, -0.97], np.random.default_rng(seed).standard_normal(600))

    def simulate(segment):
        d = segment.inputs["deformation_mm"]
        decays = np.exp(-2.0 / np.array([10.0, 100.0, 3600.0]))
        return 3.0 * d - sum(lfilter([0.0, 1 - a], [1.0, -a], d, zi=[d[0]])[0] for a in decays) / 3

    stairs = Segment("stairs", 0.0, 2.0, {"deformation_mm": u}, u)
    measured = Segment("stairs", 0.0, 2.0, {"deformation_mm": u}, simulate(stairs) + errs)
    left = measured.force_n - simulated(simulate, measured, simulate(measured))
    assert np.std(left) < 1.1 * np.std(errs)


@pytest.mark.parametrize("seed", [3, 5])
def test_a_past_that_the_rest_of_the_record_confirms_is_believed_though_errors_last(seed):
    """Stairs from a load that was held long before, a model with a branch of an hour, errors that last for a while."""
    u = np.interp(np.arange(3000), np.arange(0, 3000, 75), np.repeat(np.tile(np.arange(4.0), 5), 2))
    errs = lfilter([0.02], [1.0, -0.999], np.random.default_rng(seed).standard_normal(3000))
    a = np.exp(-2.0 / 3600.0)

    def simulate(segment):
        d = segment.inputs["deformation_mm"]
        return 3.0 * d - lfilter([0.0, 1 - a], [1.0, -a], d, zi=[d[0]])[0]

    whole = Segment("stairs", 0.0, 2.0, {"deformation_mm": np.concatenate((np.full(3000, 3.0), u))}, np.zeros(6000))
    later = Segment("stairs", 0.0, 2.0, {"deformation_mm": u}, simulate(whole)[3000:] + errs)
    from_rest = simulate(later)
    assert np.std(later.force_n - from_rest) > 2.0 * np.std(errs)
    left = later.force_n - simulated(simulate, later, from_rest)
    assert np.std(left) < 1.1 * np.std(errs)
