"""Every reference flight replays to its stored outputs; new physics changes the reference in the same commit."""

import json
from importlib.util import module_from_spec, spec_from_file_location

import numpy as np
import pytest

from tests.conftest import ROOT
from thrustd.core.types import Status
from thrustd.records.files import read_recording
from thrustd.replay.replay import replay

FOLDER = ROOT / "replay_logs"
TOLERANCE = 1e-6  # relative; other processors and libraries round differently
_SPEC = spec_from_file_location("make_reference_flights", FOLDER / "make.py")
MAKE = module_from_spec(_SPEC)
_SPEC.loader.exec_module(MAKE)
FLIGHTS = sorted(MAKE.FLIGHTS)


@pytest.fixture(scope="module", params=FLIGHTS)
def flight(request):
    stored = json.loads((FOLDER / f"{request.param}.expected.json").read_text())
    return request.param, stored, MAKE.expected(FOLDER / f"{request.param}.mcap")


def test_the_flight_replays_to_its_stored_outputs(flight):
    _, stored, now = flight
    assert len(now) == len(stored)
    for before, after in zip(stored, now, strict=True):
        assert [value is None for value in after] == [value is None for value in before]
        known = [place for place, value in enumerate(before) if value is not None]
        assert [after[i] for i in known] == pytest.approx([before[i] for i in known], rel=TOLERANCE, abs=1e-4)


def test_the_flight_is_worth_looking_at(flight):
    name, _, now = flight
    assert max(row[2] for row in now) > 5000.0
    statuses = [int(row[-1]) for row in now if row[0] > 10.0]
    failing = any(status & (Status.ONE_MOUNT | Status.MOUNT_LOST) for status in statuses)
    assert failing == (name == "sensor-fails")


def test_replaying_the_estimate_log_scores_against_the_truth(tmp_path):
    smoothed = tmp_path / "smoothed.csv"
    summary = replay(FOLDER / "throttle-steps.mcap", tmp_path / "out.mcap", smoothed=smoothed)
    assert set(summary.scores) == {"left", "right", "left_upper", "left_lower", "right_upper", "right_lower"}
    for engine in ("left", "right"):
        fused = summary.scores[engine]["fused"]
        assert fused.rmse_n < 35.0  # 22 N both
        assert fused.n > 1000
        assert summary.scores[engine]["smoothed"].n == pytest.approx(fused.n, abs=20)
        assert np.isfinite(read_recording(smoothed)[f"thrust_N_{engine}"]).all()
    squares = {
        source: [summary.scores[e][source].rmse_n ** 2 for e in ("left", "right")] for source in ("fused", "smoothed")
    }
    assert sum(squares["smoothed"]) < 1.05 * sum(squares["fused"])  # what is left is a zero, which no look ahead mends
    assert summary.missing_events == 0
