"""A pipeline that takes over another's snapshot goes on where that one was; anything else is refused whole."""

import json
from copy import deepcopy

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.pipeline.test_pipeline import AIRCRAFT, PARTS, WINDMILLING, S, flight, of
from thrustd.core.types import Estimate, Fault, MountOutput, Status
from thrustd.pipeline.pipeline import Pipeline

STOP_S, PAUSE_S = 40, 8
LEVELS_MM = ((40.5, 0.2), (41.5, 0.6), (1e9, 0.35))  # until, deformation: one step is made while nobody is there


def ragged(t_s):
    return (next(mm for until_s, mm in LEVELS_MM if t_s < until_s),) * 4


def fed(pipeline, events):
    return [output for event in events for output in pipeline.feed(event)]


def interrupted(deformation_mm, **changes):
    """-> (outputs of an uninterrupted run from the stop on, snapshot at the stop, events after the pause)."""
    events = list(flight(AIRCRAFT, 58, deformation_mm, **changes))
    before = [e for e in events if e.t_ns < S + STOP_S * S]
    whole = Pipeline(AIRCRAFT.config, PARTS)
    fed(whole, before)
    snapshot = json.loads(json.dumps(whole.snapshot()))
    later = [e for e in events if e.t_ns >= S + (STOP_S + PAUSE_S) * S]
    return fed(whole, events[len(before) :]), snapshot, later


@pytest.fixture(scope="module")
def flown():
    return interrupted(ragged, **WINDMILLING)


@pytest.fixture(scope="module")
def flown_level():
    """Mounts and engine agree all the while: nobody has a reason to doubt a source."""
    return interrupted(lambda t_s: (LEVELS_MM[0][1],) * 4)


def restarted(snapshot, shift_ns=0):
    pipeline = Pipeline(AIRCRAFT.config, PARTS)
    assert pipeline.restore(deepcopy(snapshot), shift_ns)
    return pipeline


def by_time(outputs, noun, **fields):
    return {output.t_ns // 20_000_000: output for output in of(outputs, noun, **fields)}


@pytest.mark.parametrize("mount", range(4))
def test_the_mount_is_back_within_one_percent_within_five_seconds(flown, mount):
    whole, snapshot, later = flown
    warm = by_time(fed(restarted(snapshot), later), MountOutput, mount=mount)
    reference = by_time(whole, MountOutput, mount=mount)
    start = min(warm)
    checked = [t for t in warm if t >= start + 5 * 50 and t in reference]
    assert len(checked) > 200
    assert max(abs(warm[t].force_n / reference[t].force_n - 1) for t in checked) < 0.01


def test_a_warm_start_is_nearer_than_a_cold_one(flown):
    whole, snapshot, later = flown
    reference = by_time(whole, MountOutput, mount=0)
    errors = []
    for pipeline in (restarted(snapshot), Pipeline(AIRCRAFT.config, PARTS)):
        outputs = by_time(fed(pipeline, later), MountOutput, mount=0)
        t = min(outputs) + 250
        errors.append(abs(outputs[t].force_n - reference[t].force_n))
    assert errors[0] < 0.5 * errors[1]


def test_the_band_says_that_something_was_not_seen(flown):
    whole, snapshot, later = flown
    warm = by_time(fed(restarted(snapshot), later), MountOutput, mount=0)
    reference = by_time(whole, MountOutput, mount=0)
    start = min(t for t in warm if t in reference)
    assert warm[start].std_n > reference[start].std_n


def test_biases_and_band_of_the_fusion_survive(flown_level):
    whole, snapshot, later = flown_level
    warm = by_time(fed(restarted(snapshot), later), Estimate, engine=0)
    reference = by_time(whole, Estimate, engine=0)
    t = min(warm) + 250
    assert warm[t].thrust_n == pytest.approx(reference[t].thrust_n, abs=2 * reference[t].thrust_std_n)
    assert warm[t].brochure_bias == pytest.approx(reference[t].brochure_bias, abs=0.02)
    assert not warm[t].status & Status.CONVERGING


def test_what_fuel_flow_taught_about_n1_survives(flown_level):
    whole, snapshot, later = flown_level
    unlearnt = deepcopy(snapshot)
    unlearnt["hand_overs"] = Pipeline(AIRCRAFT.config, PARTS).snapshot()["hand_overs"]
    reference = by_time(whole, Estimate, engine=0)
    errors = []
    for memory in (snapshot, unlearnt):
        warm = by_time(fed(restarted(memory), later), Estimate, engine=0)
        errors.append(sum(abs(warm[t].brochure_n - reference[t].brochure_n) for t in sorted(warm)[:50]))
    assert errors[0] < 0.5 * errors[1]


def test_a_throttle_moved_during_the_pause_excludes_no_sensor(flown):
    _, snapshot, later = flown
    kinds = {fault.kind for fault in of(fed(restarted(snapshot), later), Fault)}
    assert not kinds & {"offset", "drift", "stuck", "noisy", "dead"}


def test_who_is_at_fault_is_said_again_to_those_who_hear_the_new_process():
    _, snapshot, later = interrupted(lambda t_s: (0.2 + 0.3 * (t_s > 20.0), 0.2, 0.2, 0.2), **WINDMILLING)
    assert snapshot["monitor"]["kinds"] == [["deformation_mm", 0, "offset"]]
    said = [(fault.where, fault.kind) for fault in of(fed(restarted(snapshot), later[:500]), Fault) if fault.active]
    assert said.count((AIRCRAFT.config.mount[0].name, "offset")) == 1


def test_another_boot_only_moves_the_clock(flown):
    _, snapshot, later = flown
    shift_ns = -30 * S
    moved = [event._replace(t_ns=event.t_ns + shift_ns) for event in later]
    here, there = fed(restarted(snapshot), later), fed(restarted(snapshot, shift_ns), moved)
    forces = [[o.force_n for o in of(outputs, MountOutput, mount=0)] for outputs in (here, there)]
    assert np.array_equal(*forces, equal_nan=True)


JUNK = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=4),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
    max_leaves=6,
)


def spots(value, path=()):
    """Every place in a JSON value."""
    yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield from spots(inner, (*path, key))


@settings(max_examples=80, deadline=None)
@given(st.data())
def test_a_snapshot_with_junk_in_it_is_refused_or_harmless(flown, data):
    _, snapshot, later = flown
    broken = deepcopy(snapshot)
    *path, last = data.draw(st.sampled_from(SPOTS or SPOTS.extend(list(spots(snapshot))[1:]) or SPOTS))
    place = broken
    for key in path:
        place = place[key]
    place[last] = data.draw(JUNK)
    pipeline = Pipeline(AIRCRAFT.config, PARTS)
    if pipeline.restore(broken):
        fed(pipeline, later[:40])


SPOTS: list[tuple] = []
