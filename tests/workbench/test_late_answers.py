"""Answers that come late: what the person did meanwhile stays, and an older answer is never drawn over a newer one."""

import json
import time
from contextlib import contextmanager

import pytest

from tests.conftest import simple_model
from tests.workbench.browser import LONG_MS, idle, let_go
from tests.workbench.served import workbench
from tests.workbench.test_server import small_record
from thrustd.model.artifact import write_model
from thrustd.records.files import write_recording

RECORDS = ("one.csv", "two.csv")


@pytest.fixture(scope="module")
def compared(browser, tmp_path_factory):
    """One model, compared with each of two recordings."""
    folder = tmp_path_factory.mktemp("late")
    (folder / "model.json").write_text(write_model(simple_model()))
    for name in RECORDS:
        write_recording(small_record(), folder / name)
    with workbench(folder) as served:
        for name in RECORDS:
            assert served.order("prepare", recording=name)["state"] == "done"
            assert served.order("compare", models=["model.json"], recordings=[name])["state"] == "done"
        yield served


@pytest.fixture
def served(compared):
    choose(compared, model="model.json", measured=["one.csv"], heldout=[], bench=[])
    return compared


def choose(served, **fields):
    status, _, said = served.ask("POST", "api/session", json.dumps(fields))
    assert status == 200, said


@contextmanager
def held(page, pattern):
    """The answers that come meanwhile wait, in this list; those that are still in it come at the end."""
    waiting = []
    page.route(pattern, lambda route: waiting.append(route))
    yield waiting
    while waiting:
        let_go(page, waiting.pop(0))
    page.unroute(pattern)


def until(page, count, waiting):
    """Wait until answers of so many addresses are held; they are heard of while the browser is listened to."""
    deadline_s = time.monotonic() + LONG_MS / 1000
    while len({route.request.url for route in waiting}) < count:
        assert time.monotonic() < deadline_s, waiting
        page.wait_for_timeout(20)


def test_an_answer_that_comes_when_its_screen_was_left_is_drawn_on_no_other(page_of, served):
    with page_of(served.url) as page:
        idle(page)
        with held(page, "**/api/reports/*") as waiting:
            page.locator("nav a", has_text="Where it fails").click()
            until(page, 1, waiting)
            page.locator("nav a", has_text="Overview").click()
            page.locator("table.recordings").wait_for()
        assert page.locator("table.recordings").count() == 1
        assert page.get_by_text("In words, worst first").count() == 0


def test_the_answer_about_another_recording_is_not_drawn_over_that_of_the_chosen_one(page_of, served):
    with page_of(served.url) as page:
        idle(page)
        with held(page, "**/api/reports/*") as waiting:
            page.locator("nav a", has_text="Where it fails").click()
            until(page, 1, waiting)
            page.get_by_label("measured recording").select_option("two.csv")
            until(page, 2, waiting)
            newer = [route for route in waiting if route.request.url != waiting[0].request.url]
            waiting[:] = [route for route in waiting if route not in newer]
            let_go(page, *newer)
            page.get_by_role("heading", name="model.json on two.csv", exact=True).wait_for()
        assert page.get_by_role("heading", name="model.json on one.csv", exact=True).count() == 0
