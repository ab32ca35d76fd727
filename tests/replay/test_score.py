"""Scores against a truth that is read alongside."""

from math import nan, sqrt

import pytest

from thrustd.core.types import Estimate, Fault, MountOutput
from thrustd.replay.score import FlightScore, Truth


def estimate(t_ns, thrust_n, std_n=50.0, mount_n=nan, brochure_n=5000.0):
    return Estimate(t_ns, 0, thrust_n, std_n, 0, mount_n, 60.0, brochure_n, 90.0, nan, nan, nan, 0, 0, 0.5, 0)


def score_of(outputs, truth):
    score = FlightScore(("left",), ("left_upper", "left_lower"), (2,))
    for name, t_ns, value_n in truth:
        score.hear(Truth(name, [t_ns], [value_n]))
    for output in outputs:
        score.take(output)
    return score


def test_errors_are_taken_against_the_line_between_truth_rows():
    truth = [("left", 0, 5000.0), ("left", 100, 5100.0), ("left", 200, 5100.0)]
    outputs = [estimate(50, 5060.0), estimate(100, 5090.0), estimate(150, 5300.0), estimate(250, 0.0)]
    fused = score_of(outputs, truth).scores()["left"]["fused"]
    assert fused.n == 3  # nothing is known after the last truth row
    assert fused.rmse_n == pytest.approx(sqrt((10**2 + 10**2 + 200**2) / 3))
    assert fused.bias_n == pytest.approx(200 / 3)
    assert fused.inside_95_pct == pytest.approx(200 / 3)
    assert fused.worst_n == 200.0
    assert fused.mae_pct_above_2kn == pytest.approx(100 * (10 / 5050 + 10 / 5100 + 200 / 5100) / 3)


def test_percentages_count_only_above_two_kilonewton_per_mount():
    truth = [("left", 0, 3000.0), ("left", 100, 3000.0)]
    fused = score_of([estimate(50, 3100.0)], truth).scores()["left"]["fused"]
    assert fused.rmse_n == 100.0
    assert fused.mae_pct_above_2kn != fused.mae_pct_above_2kn  # 2 mounts: 4 kN


def test_mounts_are_scored_by_name_and_missing_sources_are_left_out():
    truth = [(name, t, 2500.0) for t in (0, 100) for name in ("left_upper", "left")]
    score = score_of([estimate(50, 2500.0), MountOutput(50, 0, 0.5, 2450.0, 40.0)], truth)
    assert set(score.scores()) == {"left", "left_upper"}
    assert set(score.scores()["left"]) == {"fused", "brochure"}
    assert score.scores()["left_upper"]["mount"].bias_n == -50.0


def test_what_is_estimated_before_any_source_has_spoken_is_not_scored():
    truth = [("left", 0, 5000.0), ("left", 100, 5000.0)]
    outputs = [estimate(10, 0.0, 4000.0, brochure_n=nan), estimate(20, 5010.0), estimate(30, 5020.0, brochure_n=nan)]
    fused = score_of(outputs, truth).scores()["left"]["fused"]
    assert (fused.n, fused.worst_n) == (2, 20.0)


def test_faults_are_counted_by_place_and_kind():
    score = score_of([Fault(0, "adc", "lost", count=3), Fault(9, "adc", "lost", count=2), Fault(9, "can", "lost")], [])
    assert score.faults == {("adc", "lost"): 5, ("can", "lost"): 1}
    assert score.scores() == {}
