"""A run in several files is one flight, whichever way a user names it."""

import json
from itertools import islice
from pathlib import Path

import msgspec
import pytest

from tests.conftest import ROOT
from thrustd.__main__ import main
from thrustd.core.errors import LogError
from thrustd.sinks.mcap_log import new_log
from thrustd.sources.log_run import run_paths
from thrustd.sources.mcap_log import LogFile

FLIGHT = ROOT / "replay_logs" / "throttle-steps.mcap"
PARTS = 3
EVENTS = 6000


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The beginning of a flight as the recorder would have rotated it, and a stranger beside it."""
    folder = tmp_path_factory.mktemp("run")
    whole = LogFile(FLIGHT)
    events = list(islice(whole.events(), EVENTS))
    size = EVENTS // PARTS
    for part in range(PARTS):
        header = msgspec.structs.replace(whole.header, run="a flight", part=part)
        with new_log(folder / f"flight_{part}.mcap", header) as log:
            for number in range(part * size, (part + 1) * size):
                log.write_event(events[number], number)
    (folder / "stranger.mcap").write_bytes(b"no log")
    return folder


def replayed(capsys: pytest.CaptureFixture[str], *names: Path) -> tuple[int, dict[str, object]]:
    status = main(["replay", *map(str, names), "--json"])
    out = capsys.readouterr().out
    return status, json.loads(out) if out else {}


def test_the_first_file_stands_for_the_run_a_later_one_for_itself(run: Path) -> None:
    assert run_paths(run / "flight_0.mcap") == [run / f"flight_{part}.mcap" for part in range(PARTS)]
    assert run_paths(run / "flight_1.mcap") == [run / "flight_1.mcap"]


def test_all_files_replay_as_one_flight(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    by_first = replayed(capsys, run / "flight_0.mcap")
    by_names = replayed(capsys, *(run / f"flight_{part}.mcap" for part in reversed(range(PARTS))))
    assert by_first == by_names
    status, summary = by_first
    assert (status, summary["events"], summary["missing_events"]) == (0, EVENTS, 0)
    assert summary["length_s"] == pytest.approx(EVENTS / 540, rel=0.1)


def test_a_run_with_a_hole_is_refused_in_one_line(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(run / "flight_0.mcap"), str(run / "flight_2.mcap")]) == 2
    assert "part 2, expected 1" in capsys.readouterr().err


def test_a_folder_is_its_logs(run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for part in range(PARTS):
        (tmp_path / f"{part}.mcap").hardlink_to(run / f"flight_{part}.mcap")
    assert replayed(capsys, tmp_path)[1]["events"] == EVENTS
    assert main(["info", str(tmp_path), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["parts"], report["events"], report["run"]) == (PARTS, EVENTS, "a flight")
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(LogError, match=r"no \*\.mcap"):
        run_paths(empty)
