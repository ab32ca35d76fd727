"""The fault matrix in its short form: every fault once, at one of three moments. Long: benchmarks/fault_matrix.py."""

import pytest

from benchmarks.damage import CASES, fields, is_adc, whole_frames
from benchmarks.fault_matrix import cell, place, twin_flight
from benchmarks.fusion_flights import outputs_of
from tests.conftest import small_aircraft
from thrustd.core.measures import SIGMAS_95
from thrustd.core.types import Fault, Frame, Tick
from thrustd.pipeline.pipeline import Pipeline
from thrustd.wire.adc_frames import encode

START_S = 25.0  # the engines turn by then
MOMENTS_S = (9.0, 10.5, 12.0)
SETTLE_S = 8.0
REST_N = 50.0  # of a turning engine at rest this is nothing


@pytest.fixture(scope="module")
def flight():
    """-> (installation, its parts, flight, the good run)."""
    installation = small_aircraft()
    parts = installation.parts()
    whole = twin_flight(installation, 56.0, 3, START_S)
    return installation, parts, whole, outputs_of(Pipeline(installation.config, parts), whole.events)


@pytest.mark.parametrize("case, moment_s", [(case, MOMENTS_S[i % 3]) for i, case in enumerate(CASES)],
                         ids=[case.name for case in CASES])  # fmt: skip
def test_the_flight_goes_on_says_so_and_recovers(flight, case, moment_s):
    installation, parts, whole, good = flight
    pipeline, index = Pipeline(installation.config, parts), place(whole, moment_s)
    outputs_of(pipeline, whole.events[:index])
    verdict = cell(whole, pipeline, index, good, case, SETTLE_S)
    unseen_s = case.lasts_s if case.name == "queue overrun" else 0.0
    assert verdict.longest_pause_s < unseen_s + 0.2
    assert verdict.reported
    assert verdict.flagged
    # what an overrun shed is not judged; the rest, at the edge of its band without it too, is no further out by it
    assert verdict.inside_95 > 0.8 * (verdict.whole_inside_95 if unseen_s else 1.0)
    # forty times its deformation leaves a mount's model somewhere else for the half second after it
    jolted = 3.0 if case.name == "outside the model's range" else 1.0
    assert verdict.further_sigma < (0.5 if unseen_s else jolted * SIGMAS_95)
    assert verdict.off_sigma < SIGMAS_95 or verdict.off_n < REST_N
    assert not verdict.still_flagged


def test_the_good_flight_has_no_fault_but_the_zero(flight):
    assert {fault.kind for fault in flight[3].faults} <= {"zero"}


def test_frames_in_pieces_become_whole():
    data = encode(5, 60_000, (1, -2, 3, 4))
    pieces = [Frame(1, "adc", 0, data[:7]), Tick(2), Frame(3, "adc", 0, data[7:])]
    whole = whole_frames(pieces)
    assert [event for event in whole if is_adc(event)] == [Frame(3, "adc", 0, data)]
    assert fields(whole[-1]) == (5, 60_000, (1, -2, 3, 4))
    assert not any(isinstance(event, Fault) for event in whole)
