"""A bench record that begins under load: what the mount remembers then is no other rubber, and no walk of the cell."""

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.identify.regression.test_walk import DT_S, NOISE_N, rubber
from thrustd.identify.first_state import beginning_of
from thrustd.identify.regression.free_run import simulate
from thrustd.identify.regression.hypotheses import records_for
from thrustd.identify.regression.regress import regress
from thrustd.identify.segments import Segment


def levels(seed, *before):
    """Holds of half a minute for an hour, behind pairs (mm, s); no corner is sharper than a machine's."""
    first = [np.full(round(seconds / DT_S), mm) for mm, seconds in before]
    rest = np.repeat(np.random.default_rng(seed).uniform(0.1, 1.0, 120), round(30.0 / DT_S))
    return lfilter([0.2], [1.0, -0.8], np.concatenate((*first, rest)))


def segment(d, begin, seed, name="bench"):
    """What a logger sees that starts with sample `begin`."""
    force_n = rubber(d)[begin:] + NOISE_N * np.random.default_rng(seed).standard_normal(len(d) - begin)
    return Segment(name, 0.0, DT_S, {"deformation_mm": d[begin:]}, force_n)


def stood(seed, before_s):
    """A load of so many seconds before the logger starts."""
    return segment(levels(seed, (0.6, before_s + 30.0)), round(before_s / DT_S), seed)


def missed_n(found, unloaded):
    """Of another record that begins without load."""
    [record] = records_for(found, [unloaded])
    out = found.shape.output_scale * simulate(found.shape, found.point, record)
    return float(np.sqrt(np.mean((unloaded.force_n - out[record.stood :]) ** 2)))


@pytest.mark.parametrize("before_s", [240.0, 900.0])
def test_how_long_the_first_load_has_stood_is_found_and_the_rubber_is_the_rubber(before_s):
    record = stood(3, before_s)
    found = regress([record])
    [samples] = found.shape.stood
    assert before_s / 1.3 < samples * DT_S < before_s * 1.3  # of the lengths that are tried, a factor of 1.21 apart
    rested = regress([record], settled=True)
    other = segment(levels(8, (0.0, 60.0)), 0, 8, "other")
    assert missed_n(found, other) < min(1.1 * NOISE_N, 0.9 * missed_n(rested, other))
    assert found.mean_square < 0.9 * rested.mean_square


def test_loads_before_the_first_one_are_remembered_by_every_lag():
    record = segment(levels(4, (1.0, 600.0), (0.2, 150.0)), 7200, 4)
    found, rested = regress([record]), regress([record], settled=True)
    assert found.shape.begun == 1
    assert found.mean_square < 0.8 * rested.mean_square


def test_a_record_that_begins_without_load_has_no_past():
    found = regress([segment(levels(5, (0.0, 60.0)), 0, 5)])
    assert found.shape.begun == 0
    assert found.shape.stood == ()


def test_a_free_run_begins_under_a_load_that_has_stood():
    record = stood(6, 300.0)

    def run(one):
        return rubber(one.inputs["deformation_mm"])

    found = beginning_of(run, record)
    assert found.before == 0.0
    assert found.stood * DT_S == pytest.approx(300.0, rel=0.1)
