"""The onboard process as its service manager sees it: ready, alive, killed, back where it was, in good health."""

import subprocess
import sys
from contextlib import ExitStack, closing

import msgspec
import numpy as np
import pytest

from tests.hil.test_hil import PATIENCE_S, ServiceManager
from tests.onboard.rig import Daemon, bench, deviations, log_steps, reliable_aircraft, twin_flight, uninterrupted
from thrustd.cli.status import read_status
from thrustd.installation.installation import read_installation
from thrustd.replay.replay import replay
from thrustd.sources.mcap_log import LogFile

FLIGHT_S = 60.0  # long enough for a slow machine; nobody waits for its end


@pytest.fixture(scope="module")
def life(tmp_path_factory):
    """Fly, kill -9, fly on, stop. -> (folder, words of the second life, status in flight, its screen, status later)."""
    folder = tmp_path_factory.mktemp("life")
    config = reliable_aircraft(folder)
    flight = twin_flight(config, FLIGHT_S, 4)
    with ServiceManager(folder / "notify") as manager:
        lives = ExitStack()
        with lives, bench(config, flight):
            first = lives.enter_context(closing(Daemon(config, manager)))
            first.beats(6)
            first.kill()
            second = lives.enter_context(closing(Daemon(config, manager)))
            second.beats(10)  # five seconds are left out, and a busy machine starts late
            port = read_installation(config).config.health.port
            status, later = (read_status(f"http://127.0.0.1:{port}/metrics") for _ in range(2))
            screen = subprocess.run(
                    [sys.executable, "-m", "thrustd", "status", str(config), "--once"],
                    capture_output=True, text=True, timeout=PATIENCE_S, check=True,
                ).stdout  # fmt: skip
            words = second.stop()
    return folder, words, status, screen, later


def logs(folder):
    return sorted((folder / "logs").glob("*.mcap"), key=lambda path: path.stat().st_mtime)


def test_the_second_life_starts_warm_and_says_so(life):
    assert "starting warm" in life[1]
    assert "Traceback" not in life[1]


def test_the_mount_estimates_are_back_within_one_percent_within_five_seconds(life):
    _, second = logs(life[0])
    live, (reference,) = log_steps(second), uninterrupted(life[0] / "flight.mcap", [second])
    found = deviations(live, reference, next(iter(live.values())).t_ns + 5_000_000_000)
    assert len(found) > 100
    assert np.max(found) < 0.001  # of the 0.01 that are promised: the engines idle here


def test_the_log_of_the_killed_process_is_readable_and_lacks_less_than_a_second(life):
    first = logs(life[0])[0]
    events = list(LogFile(first).events())
    assert LogFile(first).missing_events == 0
    assert events[-1].t_ns - events[0].t_ns > 4_000_000_000  # 6 heartbeats less the second that may be lost


def test_the_second_log_replays_bit_for_bit_though_it_began_warm(life):
    _, second = logs(life[0])
    again = life[0] / "again.mcap"
    replay(second, again)
    topics = ("/estimate/left", "/estimate/right", "/mount/left_upper")
    assert [m.data for m in LogFile(again).messages(topics)] == [m.data for m in LogFile(second).messages(topics)]


def test_health_counts_what_flies(life):
    status = life[2]
    assert status["events_total"]["adc"] > 100
    assert status["events_total"]["can"] > 500
    assert status["estimates_total"]["left"] > 100
    before, after = (sum(one["estimates_total"].values()) for one in (status, life[4]))
    assert before <= status["latency_seconds_count"] <= after  # a page is written while it flies: estimates first
    assert status["recording"] == 1
    assert status["checkpoint_age_seconds"] < 10
    assert status["log_free_bytes"] > 0


def test_the_status_screen_names_engines_inputs_and_recording(life):
    for word in ("left", "right", "adc", "can", "recording", "yes"):
        assert word in life[3]


def test_the_checkpoint_is_whole_and_of_these_files(life):
    checkpoint = msgspec.json.decode((life[0] / "checkpoint.json").read_bytes())
    assert checkpoint["body"]["sha256"] == read_installation(life[0] / "aircraft.toml").hashes()
