"""A load cell that walks: how far it does is told, and rubber that remembers for long is told from it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.signal import lfilter

from thrustd.bench.plan_test import BenchPlan, programme
from thrustd.identify.regression.free_run import simulate
from thrustd.identify.regression.hypotheses import records_for
from thrustd.identify.regression.posterior import _over, kept, walk_n
from thrustd.identify.regression.regress import LAGS, regress, with_walk
from thrustd.identify.regression.terms import split
from thrustd.identify.regression.walk import ELSEWHERE, HOURS, hours_of, is_walk, walks
from thrustd.identify.segments import Segment, segments_of
from thrustd.model.effects.hysteresis_berg import EFFECT as BERG
from thrustd.records.recording import make_recording
from thrustd.twin.airframe import draw_airframe
from thrustd.twin.bench import programme_bench

DT_S, HOUR_S, NOISE_N = 0.1, 3600.0, 8.0
TAUS_S = np.geomspace(0.1, 1e5, 25)  # of rubber whose relaxation goes by a power of time, for longer than any record
GAINS = 0.03 * TAUS_S**-0.15


def rubber(d):
    """Force, N, of a spring all of whose memory is in the power law."""
    w = 4500 * d + 600 * d**3
    keep = np.exp(-DT_S / TAUS_S)
    return w + sum(g * (w - lfilter([1 - k], [1, -k], w)) for g, k in zip(GAINS, keep, strict=True))


def held(levels_mm, each_s, n):
    steps = np.repeat(levels_mm, round(each_s / DT_S))
    return lfilter([0.2], [1.0, -0.8], np.resize(steps, n))


@cache
def benches(seed, walk_n_h=20.0):
    """An hour about no load, as benches are, with a cell that walks."""
    rng = np.random.default_rng(seed)
    n = round(HOUR_S / DT_S)
    d = held(rng.uniform(-1.0, 1.0, 4000), 30.0, n)
    walk = walk_n_h * np.sqrt(DT_S / HOUR_S) * np.cumsum(rng.standard_normal(n))
    return (Segment("bench", 0.0, DT_S, {"deformation_mm": d}, rubber(d) + walk + NOISE_N * rng.standard_normal(n)),)


@cache
def found_of(*bench):
    return regress(benches(*bench))


@cache
def walking(*bench):
    """What is found when the cell may have walked."""
    return with_walk(found_of(*bench), benches(*bench))


def without_walk(shape, point):
    """As the mount flies."""
    parts = list(zip(shape.terms, split(shape.terms, point.terms), strict=True))
    terms = np.concatenate([numbers for term, numbers in parts if not is_walk(term)])
    own = tuple(t for t, _ in parts if not is_walk(t))
    return replace(shape, terms=own, begun=0), replace(point, terms=terms, begin=np.zeros(0))


@pytest.mark.parametrize("seed", [1, 3, 5])
def test_rubber_is_foretold_under_a_load_that_lasts_although_its_cell_walked(seed):
    """The bench hardly excites slow memory; what a cell walks would be taken for it, one way or the other."""
    plain = regress(benches(seed), settled=True)
    d = held([0.7], HOUR_S, round(HOUR_S / DT_S))
    record = Segment("flight", 0.0, DT_S, {"deformation_mm": d}, rubber(d))

    def missed_n(found):
        flies = without_walk(found.shape, found.point)
        model_n = found.shape.output_scale * simulate(*flies, records_for(found, [record])[0])
        return np.abs(record.force_n - model_n)[len(d) // 10 :].max()

    assert missed_n(walking(seed)) < min(0.5 * missed_n(plain), 0.015 * record.force_n.max())


def test_lags_between_those_of_a_dense_set_are_found_where_they_are_and_are_no_walk():
    """Two neighbours for one left errors that last for minutes, five times the noise there, and 19 N of a walk."""
    rng, n, truth_s = np.random.default_rng(4), round(HOUR_S / DT_S), np.array([0.41, 19.5, 213.0])
    d = held(rng.uniform(0.0, 1.1, 4000), 40.0, n)
    w, keep = 3900 * d + 1300 * d**3, np.exp(-DT_S / truth_s)
    force = w + sum(0.16 * (w - lfilter([1 - k], [1, -k], w)) for k in keep)
    records = [Segment("bench", 0.0, DT_S, {"deformation_mm": d}, force + NOISE_N * rng.standard_normal(n))]
    found = regress(records)
    told_s = np.sort(np.exp(found.point.log_tau[found.point.gain > 0.01]))
    assert told_s == pytest.approx(truth_s, rel=0.05)
    assert found.noise_variance < 1.3 * found.mean_square  # nothing lasts
    assert with_walk(found, records) is found


def test_rubber_by_a_power_law_keeps_its_spectrum_though_its_cell_walks():
    found = found_of(1)
    assert len(found.point.gain) == LAGS and not found.shape.move


def test_memory_of_a_mount_under_load_is_no_walk_of_a_cell_that_stands_still():
    """Four hours of one mount: a walk that began large kept what is slow memory's, 16 N of it, and left 0.1 N less."""
    asked = make_recording("steps", programme("steps", BenchPlan(hours=4.0, seed=6141)))
    record = programme_bench(asked, 6141, draw_airframe(141).mounts[2]).resample(20.0).resample(2.0)
    segments = segments_of([record], ())
    found = with_walk(regress(segments, laws=[BERG]), segments)
    flies = without_walk(found.shape, found.point)
    (begun,) = records_for(found, segments)
    missed_n = found.shape.output_scale * (begun.y - simulate(*flies, begun))
    assert np.sqrt(np.mean(missed_n**2)) < 6.0


def test_how_far_a_cell_walks_is_told_and_kept():
    still, walked = kept(walking(3, 0.0)), kept(walking(3))
    assert walk_n(still) < 3.0
    assert 10.0 < walk_n(walked) < 40.0
    assert not any("mode" in name for name in walked.strengths)


def test_every_recording_walks_by_itself_over_its_stretches():
    d = np.zeros(100)
    parts = [
        Segment(name, start, DT_S, {"deformation_mm": d}, d) for name, start in (("a", 5.0), ("a", 50.0), ("b", 0))
    ]
    assert [term.effect.channels for term in walks(parts, 1.0)] == [(f"{HOURS}0",), (f"{HOURS}1",)]
    assert all(is_walk(term) for term in walks(parts, 1.0))
    assert walks(parts, 0.0) == []
    later = hours_of(parts, parts[1])
    assert later[f"{HOURS}0"][0] == pytest.approx(45.0 / HOUR_S)
    assert np.all(later[f"{HOURS}1"] == ELSEWHERE)


def test_a_walk_varies_as_the_time_that_it_has_gone_on():
    """Modes at one sigma each: variance q t, but for what the faster modes would add."""
    n = 2000
    part = Segment("a", 0.0, 2 * HOUR_S / n, {"deformation_mm": np.zeros(n)}, np.zeros(n))
    (term,) = walks([part], 5.0)
    hours = hours_of([part], part)[f"{HOURS}0"]
    stage = term.effect.stage
    runs = [
        stage(term.effect.neutral() | {p.name: 5.0}, part.dt_s).run(np.zeros(0), hours[:, None], np.zeros(n))
        for p in term.free
    ]
    variance = sum(run**2 for run in runs)
    assert variance[-1] == pytest.approx(5.0**2 * 2.0, rel=0.05)
    assert variance[n // 2] == pytest.approx(5.0**2 * 1.0, rel=0.1)


def test_what_is_known_of_a_mount_is_the_same_beside_a_walk_that_is_none():
    """Numbers that are integrated out may be known by as many orders of magnitude more or less than the others."""
    rng = np.random.default_rng(5)
    root = rng.standard_normal((8, 8))
    information = root @ root.T
    own = np.arange(8) < 3
    told = np.linalg.inv(np.linalg.inv(information)[:3, :3])
    wide = np.zeros((10, 10))
    wide[:8, :8], wide[8, 8], wide[9, 9] = information, 1e16, 1e-9
    assert _over(wide, np.append(own, [False, False])) == pytest.approx(told, rel=1e-6)
