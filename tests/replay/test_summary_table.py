"""What a replay prints with a truth and without one."""

import pytest
from rich.console import Console

from thrustd.replay.means import EngineMeans, SourceMean
from thrustd.replay.replay import ReplaySummary
from thrustd.replay.score import Score
from thrustd.replay.summary_table import largest_n, print_summary

ENGINE = EngineMeans(
    {"fused": SourceMean(100.0, 4748.7, 31.0, 0.0), "brochure": SourceMean(98.3, 4634.2, 225.0, 1114.0)},
    {"transient": 14.3, "mount_rejected": 0.01},
)
SCORES = {"left": {"fused": Score(100, 37.8, -22.6, 0.5, 700.0, 97.8)}}


def printed(capsys, scores):
    summary = ReplaySummary("f.mcap", 60.0, 10, 0, False, "", 5, {"left": ENGINE}, scores, {})
    print_summary(summary, Console(width=120))
    return " ".join(capsys.readouterr().out.split()), largest_n(summary)


def test_with_a_truth_the_sign_of_the_error_is_told(capsys):
    out, largest = printed(capsys, SCORES)
    for words in ("estimate minus truth", "-22.6", "worst |error| N", "700"):
        assert words in out
    assert largest == {"left": {"fused": 700.0}}


def test_without_a_truth_the_estimates_speak_of_themselves(capsys):
    out, largest = printed(capsys, {})
    for words in ("no truth is known", "mean thrust N", "4748.7", "one sigma N (median)", "225.0", "98.3", "1114"):
        assert words in out
    assert largest == {"left": {"brochure": 1114.0}}


@pytest.mark.parametrize("scores", [{}, SCORES])
def test_status_is_told_as_a_share_of_the_time(capsys, scores):
    out, _ = printed(capsys, scores)
    assert "left, status by share of the time (bits overlap): transient 14.3 %, mount rejected < 0.1 %" in out
