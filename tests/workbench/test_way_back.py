"""An effect that the check recording speaks against: the guide offers the way back, and does not offer it again."""

import hashlib
from contextlib import contextmanager

import msgspec
import pytest

from tests.conftest import simple_model
from tests.workbench.browser import idle
from tests.workbench.served import workbench
from tests.workbench.test_server import small_record
from thrustd.model.artifact import LedgerEntry, write_model
from thrustd.records.files import write_recording
from thrustd.workbench.folder import Folder
from thrustd.workbench.jobs import Job
from thrustd.workbench.prepare import write_report

BEFORE_N, PROMISED_N = 50.0, 20.0
CARD = {"title": "", "equation": "", "parameters": [], "channels": [], "separating_test": "", "source": ""}
ASKED = {"model": "parent.json", "recordings": ["measured.csv"]}


def make_folder(root, check_n, contradicted, remarks):
    """A model, creep added to it, and what the check recording gave, as the page would have left them."""
    for name in ("measured.csv", "heldout.csv"):
        write_recording(small_record(), root / name)
    parent = write_model(simple_model("parent"))
    entry = LedgerEntry("creep", BEFORE_N, PROMISED_N, "measured.csv", hashlib.sha256(parent.encode()).hexdigest())
    child = msgspec.structs.replace(simple_model("child"), ledger=[entry])
    (root / "parent.json").write_text(parent)
    (root / "child.json").write_text(write_model(child))
    compared = {"cells": [{"rmse_n": BEFORE_N}], "worst": []}
    asked = {"models": ["parent.json"], "recordings": ["measured.csv"]}
    kept(root, Job("0", "compare", "", asked, "done", result=compared))
    candidate = {"effect": "creep", "name": "creep", "rmse_before_n": BEFORE_N, "rmse_after_n": PROMISED_N,
                 "in_verdict": True, "estimates": [], "separable_from": [], "evidence": "", "card": CARD}  # fmt: skip
    found = {"verdict": ["creep"], "grade": "strong", "more_left": False, "floor_n": 12.0, "rmse_before_n": BEFORE_N,
             "rmse_after_n": PROMISED_N, "not_judged": [], "candidates": [candidate], "depends_on": [],
             "curves": [], "advice": [], "evidence": []}  # fmt: skip
    found["report"] = write_report(Folder(root), "a", found)
    kept(root, Job("1", "diagnose", "", ASKED, "done", result=found, created_s=1.0))
    heldout = [
        {"model": "parent.json", "recording": "heldout.csv", "rmse_n": 48.0, "contradicted": False},
        {"model": "child.json", "recording": "heldout.csv", "rmse_n": check_n, "contradicted": contradicted},
    ]
    result = {"model": "child.json", "reads": [], "parent": "parent.json", "effects": ["creep"], "estimates": [],
              "rmse_before_n": BEFORE_N, "rmse_after_n": PROMISED_N, "heldout": heldout,
              "remarks": remarks}  # fmt: skip
    asked = ASKED | {"effects": ["creep"], "heldout": ["heldout.csv"], "out": "child.json"}
    kept(root, Job("2", "extend", "", asked, "done", result=result, created_s=2.0))


def kept(root, job):
    jobs = root / ".thrustd" / "jobs"
    jobs.mkdir(parents=True, exist_ok=True)
    (jobs / f"{job.id}.json").write_bytes(msgspec.json.encode(job))


@pytest.mark.parametrize(
    ("check_n", "contradicted", "remarks", "said"),
    [
        (45.0, True, ["heldout.csv contradicts child: 45 N is left"], "48.0 N to 45.0 N, where 20.0 N was promised"),
        (48.5, False, [], "48.0 N to 48.5 N"),
        (45.0, True, ["heldout.csv: temperature_degC is not recorded, 20 degC taken for it"], "20 °C taken for it"),
    ],
)
def test_the_guide_leads_back_and_not_there_again(page_of, tmp_path, check_n, contradicted, remarks, said):
    make_folder(tmp_path, check_n, contradicted, remarks)
    with workbench(tmp_path) as served:
        served.ask("POST", "api/session", '{"model": "child.json"}')
        with page_of(served.url) as page:
            idle(page)
            guide = page.locator(".guide")
            guide.get_by_text("heldout.csv speaks against creep").wait_for()
            assert said in guide.inner_text() and guide.locator(".bad").count() == 0
            page.locator("#next", has_text="Undo").click()
            guide.get_by_text("It was taken back").wait_for()
            assert not (tmp_path / "child.json").exists()
            page.locator("#next", has_text="See the candidates").click()
            guide.get_by_role("button", name="Add creep again").wait_for()
            # what spoke against it is no check now
            page.get_by_label("recording nothing is fitted to").select_option("")
            guide.get_by_text("The data ask for creep").wait_for()


@contextmanager
def page_after(page_of, root, check_n, contradicted):
    """The page of a folder in which creep was added and checked so."""
    make_folder(root, check_n, contradicted, [])
    with workbench(root) as served:
        served.ask("POST", "api/session", '{"model": "child.json"}')
        with page_of(served.url) as page:
            idle(page)
            yield page


def test_what_is_kept_all_the_same_is_said_and_goes_on(page_of, tmp_path):
    with page_after(page_of, tmp_path, 45.0, contradicted=True) as page:
        page.get_by_role("button", name="Keep it").click()
        page.locator("#next", has_text="Compare").wait_for()
        page.locator(".guide .bad", has_text="heldout.csv speaks against creep").wait_for()


def test_what_the_check_bears_out_is_not_doubted(page_of, tmp_path):
    with page_after(page_of, tmp_path, 21.0, contradicted=False) as page:
        page.locator("#next", has_text="Compare").wait_for()
        assert "speaks against" not in page.locator(".guide").inner_text()
