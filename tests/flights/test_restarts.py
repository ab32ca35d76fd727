"""A warm start in the reference flight, at moments when something changes that nobody sees, excludes no sensor."""

from pathlib import Path

from benchmarks.restarts import restarts

LOGS = Path(__file__).parents[2] / "replay_logs"
LIGHT_OFFS_S = 18.0, 23.0, 28.0, 31.0, 35.0  # left engine, then right


def excluded(
    at_s: tuple[float, ...], *pauses_s: float, flight: str = "throttle-steps"
) -> list[tuple[float, float, list[str]]]:
    return [tuple(each) for each in restarts(LOGS / f"{flight}.mcap", at_s, pauses_s, 8.0) if each.excluded]


def test_an_engine_that_starts_about_a_restart_is_not_judged_before_its_time():
    assert excluded(LIGHT_OFFS_S, 2.0, 6.0, 9.0) == []


def test_a_throttle_that_was_cut_in_a_pause_may_have_been_cut_at_its_end():
    assert excluded((106.5, 236.0, 252.5, 269.0), 9.0) == []
    assert excluded((109.5, 239.0, 272.0), 6.0) == []


def test_a_jump_in_doubt_whose_witnesses_nobody_saw_is_none():
    assert excluded((241.0,), 2.0, 9.0, flight="sensor-fails") == []
