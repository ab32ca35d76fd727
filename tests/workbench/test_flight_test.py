"""Questions of a flight test, asked of a running workbench: the command line's tables, a picture for both schemes."""

import shutil

import pytest

from tests.conftest import ROOT
from tests.flighttest.scene import made_flight
from tests.workbench.served import workbench
from thrustd.records.files import write_recording

SHEET = {"empty_kg": 4157.0, "payload_kg": 500.0, "fuel_kg": 1000.0, "std_kg": 30.0}


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    folder = tmp_path_factory.mktemp("flights")
    write_recording(made_flight((0.2, 0.25, 0.3, 0.35, 0.4)), folder / "one.csv")
    with workbench(folder) as served:
        yield served


@pytest.mark.parametrize(("question", "title"), [("points", "Test points of one.csv"), ("transients", "Transients of"),
                                                 ("health", "Health over 1 flight")])  # fmt: skip
def test_a_question_is_answered_with_table_picture_and_csv(served, question, title):
    job = served.order("flighttest", question=question, recordings=["one.csv"])
    assert job["state"] == "done", job["error"]
    answer = served.get(f"api/reports/{job['result']['report']}")
    assert answer["title"].startswith(title)
    (table,) = answer["tables"]
    assert (table["rows"] or question == "transients") and all(len(row) == len(table["heads"]) for row in table["rows"])
    for name in ("-light.svg", "-dark.svg", ".csv"):
        status, _, content = served.ask("GET", f"api/reports/{answer['files']}{name}")
        assert status == 200 and (content[:5] in (b"<?xml", b'"flig', b'"of",') or not table["rows"])
    assert answer["more"] == []  # nothing told the terms of its band


def test_of_a_log_the_terms_of_the_band_are_drawn_as_well(served):
    shutil.copy(ROOT / "replay_logs" / "throttle-steps.mcap", served.folder / "flown.mcap")
    (served.folder / "marks.csv").write_text("start_s,end_s,name\n140,170,high\n")
    job = served.order(
        "flighttest", question="points", recordings=["flown.mcap"], marks=str(served.folder / "marks.csv")
    )
    assert job["state"] == "done", job["error"]
    answer = served.get(f"api/reports/{job['result']['report']}")
    assert answer["more"] == ["Budget: what the band is made of"]
    for scheme in ("light", "dark"):
        status, _, content = served.ask("GET", f"api/reports/{answer['files']}-0-{scheme}.svg")
        assert status == 200 and content.startswith(b"<?xml")


def test_a_polar_needs_a_mass_and_says_so_in_one_line(served):
    job = served.order("flighttest", question="performance", recordings=["one.csv"])
    assert job["state"] == "failed" and "mass" in job["error"] and "\n" not in job["error"]
    job = served.order("flighttest", question="performance", recordings=["one.csv"], mass=SHEET)
    assert job["state"] == "done" or "polar" in job["error"]
    status, _, content = served.ask(
        "POST", "api/jobs", '{"kind": "flighttest", "question": "points", "recordings": ["../one.csv"]}'
    )
    assert status == 400 and b"error" in content
