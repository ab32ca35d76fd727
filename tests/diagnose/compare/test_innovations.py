"""`thrustd compare ESTIMATE_LOG`: NIS and whiteness per engine and source; logs without estimates are refused."""

import json

import pytest

from tests.conftest import small_aircraft
from thrustd.__main__ import main
from thrustd.replay.replay import replay
from thrustd.twin.flight import scripted_flight, write_flight
from thrustd.wire.can_frames import ICD_INPUT_ROWS


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """(raw flight log, estimate log)"""
    folder = tmp_path_factory.mktemp("innovations")
    aircraft = small_aircraft()
    profile, airframe = scripted_flight(60.0, 1)
    raw, estimated = folder / "flight.mcap", folder / "estimates.mcap"
    write_flight(raw, profile, airframe, aircraft.can_table(ICD_INPUT_ROWS), aircraft.log_header(), 1)
    replay(raw, estimated)
    return raw, estimated


def test_every_engine_and_source_has_its_figures(logs, capsys):
    assert main(["compare", str(logs[1]), "--json"]) == 0
    engines = json.loads(capsys.readouterr().out)["innovations"]["estimates.mcap"]
    assert set(engines) == {"left", "right"}
    for sources in engines.values():
        assert set(sources) == {"mount", "brochure"}
        for figures in sources.values():
            assert figures["measurements"] > 50
            assert figures["nis"] >= 0.0
            assert -1.0 <= figures["whiteness"] <= 1.0


def test_the_table_names_both_figures(logs, capsys):
    assert main(["compare", str(logs[1])]) == 0
    out = capsys.readouterr().out
    assert "NIS" in out
    assert "whiteness" in out
    assert out.count("brochure") == 2


def test_a_log_without_estimates_is_refused_in_one_line(logs, capsys):
    assert main(["compare", str(logs[0])]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "no estimates" in line
    assert "thrustd replay" in line
