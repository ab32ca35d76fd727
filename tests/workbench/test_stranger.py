"""Somebody who was not there, with a CSV from a rig of his own, in a real browser."""

import json

import pytest

from tests.workbench.browser import idle, next_step
from tests.workbench.served import workbench
from tests.workbench.test_mapping import SAID, write_foreign


@pytest.fixture(scope="module")
def stranger(browser, tmp_path_factory):
    folder = tmp_path_factory.mktemp("stranger")
    write_foreign(folder / "rig.csv", n=6000)
    write_foreign(folder / "engine run.csv", n=6000, seed=1)
    write_foreign(folder / "test run.csv", n=6000, seed=2)
    with workbench(folder) as served:
        yield served


def test_his_columns_are_named_once_and_in_his_units(page_of, stranger):
    with page_of(stranger.url) as page:
        idle(page)
        page.locator("#next", has_text="Name the columns").click()
        page.locator("#take-columns").click()
        page.locator(".notice.problem", has_text="How many mm is 1 V of LVDT (V)?").wait_for()
        page.get_by_label("scale of LVDT (V)").fill("0.25")
        page.locator("#take-columns").click()
        page.locator(".notice.problem", has_text="What does LVDT (V) read without load?").wait_for()
        page.get_by_role("button", name="at the least force").wait_for()
        page.get_by_label("zero of LVDT (V)").fill("0.3")
        page.get_by_label("reverse the sign of Load [kN]").uncheck()
        page.get_by_text("one of the two signs is reversed").wait_for()
        page.get_by_label("reverse the sign of Load [kN]").check()
        page.get_by_text("the signs agree").wait_for()
        page.locator("#take-columns").click()
        page.locator("#next", has_text="Identify a model").wait_for()
        idle(page)
        page.get_by_text("2 channels, with force_N").nth(2).wait_for()
        assert page.get_by_label("use of test run.csv").input_value() == "heldout"
    said = json.loads((stranger.folder / ".thrustd" / "mappings.json").read_bytes())
    load, lvdt = said["columns"][1:]
    assert load["factor"] == -1000 and lvdt["factor"] == 0.25 and lvdt["offset"] == pytest.approx(-0.075)


def test_then_the_page_leads_on(page_of, stranger):
    for name in ("rig.csv", "engine run.csv", "test run.csv"):  # wherever the test above ran
        stranger.order("prepare", recording=name)
    assert stranger.ask("PUT", "api/columns/rig.csv", json.dumps(SAID))[0] == 200
    with page_of(stranger.url) as page:
        idle(page)
        next_step(page, "Identify a model")
        page.locator("#next", has_text="Take this recording").click()
        next_step(page, "Compare")
        page.locator(".reasons, .empty").first.wait_for()
