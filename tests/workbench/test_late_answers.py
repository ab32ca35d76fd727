"""Answers that come late: what the person did meanwhile stays, and an older answer is never drawn over a newer one."""

import json
import re
import shutil

import pytest

from tests.conftest import simple_model
from tests.flighttest.scene import made_flight
from tests.workbench.browser import held, idle, let_go, until
from tests.workbench.served import workbench
from tests.workbench.test_follow import write_log
from tests.workbench.test_server import small_record
from thrustd.model.artifact import write_model
from thrustd.records.files import write_recording

RECORDS = ("one.csv", "two.csv")
FLIGHT_S = 300


@pytest.fixture(scope="module")
def compared(browser, tmp_path_factory):
    """One model, compared with each of two recordings, and a flight."""
    folder = tmp_path_factory.mktemp("late")
    (folder / "model.json").write_text(write_model(simple_model()))
    for name in RECORDS:
        write_recording(small_record(), folder / name)
    write_log(folder / "flight.mcap", seconds=FLIGHT_S)
    shutil.copy(folder / "flight.mcap", folder / "second.mcap")
    with workbench(folder) as served:
        for name in (*RECORDS, "flight.mcap", "second.mcap"):
            assert served.order("prepare", recording=name)["state"] == "done"
        for name in RECORDS:
            assert served.order("compare", models=["model.json"], recordings=[name])["state"] == "done"
            assert served.order("simulate", recording=name, models=["model.json"])["state"] == "done"
        yield served


@pytest.fixture
def served(compared):
    choose(compared, model="model.json", measured=["one.csv"], heldout=[], bench=[], unchecked=False)
    return compared


def choose(served, **fields):
    status, _, said = served.ask("POST", "api/session", json.dumps(fields))
    assert status == 200, said


def go(page, name):
    page.locator("nav a", has_text=name).click()


def addresses(waiting):
    return {route.request.url for route, _ in waiting}


def test_an_answer_that_comes_when_its_screen_was_left_is_drawn_on_no_other(page_of, served):
    with page_of(served.url) as page:
        idle(page)
        with held(page, "**/api/reports/*") as waiting:
            go(page, "Where it fails")
            until(page, lambda: waiting)
            go(page, "Overview")
            page.locator("table.recordings").wait_for()
        assert page.locator("table.recordings").count() == 1
        assert page.get_by_text("In words, worst first").count() == 0


def test_the_answer_about_another_recording_is_not_drawn_over_that_of_the_chosen_one(page_of, served):
    with page_of(served.url) as page:
        idle(page)
        with held(page, "**/api/reports/*") as waiting:
            go(page, "Where it fails")
            until(page, lambda: waiting)
            page.get_by_label("measured recording").select_option("two.csv")
            until(page, lambda: len(addresses(waiting)) == 2)
            newer = [one for one in waiting if one[0].request.url != waiting[0][0].request.url]
            waiting[:] = [one for one in waiting if one not in newer]
            let_go(page, *newer)
            page.get_by_role("heading", name="model.json on two.csv", exact=True).wait_for()
        page.get_by_role("heading", name="model.json on two.csv", exact=True).wait_for()
        assert page.get_by_role("heading", name="model.json on one.csv", exact=True).count() == 0


def test_a_choice_is_not_taken_back_by_a_state_that_was_asked_for_before(page_of, served):
    with page_of(served.url) as page:
        idle(page)
        measured = page.get_by_label("measured recording")
        with held(page, "**/api/state") as waiting:
            choose(served, heldout=["two.csv"])
            until(page, lambda: waiting)
            with page.expect_response("**/api/session"):
                measured.select_option("flight.mcap")
            let_go(page, waiting.pop(0))
            assert measured.input_value() == "flight.mcap"
        assert measured.input_value() == "flight.mcap"


def test_a_choice_is_not_taken_back_while_the_server_has_not_answered_it(page_of, served):
    with page_of(served.url) as page:
        idle(page)
        measured = page.get_by_label("measured recording")
        with held(page, "**/api/state") as waiting, held(page, "**/api/session") as chosen:
            choose(served, heldout=["two.csv"])
            until(page, lambda: waiting)
            measured.select_option("flight.mcap")
            until(page, lambda: chosen)
            let_go(page, waiting.pop(0))
            assert measured.input_value() == "flight.mcap"
        assert measured.input_value() == "flight.mcap"


def test_a_choice_that_is_refused_is_not_shown(page_of, served):
    with page_of(served.url) as page:
        idle(page)
        check = page.get_by_label("recording nothing is fitted to")
        check.select_option("one.csv")
        page.locator(".notice.problem", has_text="fitted to").wait_for()
        assert check.input_value() == ""


def test_what_was_said_stays_while_the_page_asks_for_itself(page_of, served):
    with page_of(f"{served.url}#fails") as page:
        page.get_by_role("heading", name="model.json on one.csv", exact=True).wait_for()
        asked = {"models": ["model.json"], "recordings": ["one.csv"], "condition": {"channel": "force_N", "low": 1e9}}
        assert served.order("compare", **asked)["state"] == "failed"
        problem = page.locator(".notice.problem", has_text="condition")
        problem.wait_for()
        choose(served, heldout=["two.csv"])
        checked = page.get_by_label("recording nothing is fitted to").locator("option:checked", has_text="two")
        checked.wait_for(state="attached")
        assert problem.count() == 1


def test_of_several_files_each_that_is_refused_is_said(page_of, served):
    with page_of(served.url) as page:
        idle(page)
        files = [{"name": name, "mimeType": "text/csv", "buffer": b"x"} for name in RECORDS]
        page.locator("input[type=file]").set_input_files(files)
        page.locator(".notice.problem", has_text="two.csv").wait_for()
        assert page.locator(".notice.problem", has_text="one.csv").count() == 1


def test_the_end_of_an_upload_is_told_although_it_came_before_the_stream_of_events(page_of, served):
    with page_of(served.url) as page:
        page.locator("html[data-started]").wait_for()  # its own stream is asked for
        streams = []
        page.route("**/api/events", lambda route: streams.append(route))
        page.reload()
        until(page, lambda: streams)
        page.locator("input[type=file]").set_input_files(
            {"name": "bad.csv", "mimeType": "text/csv", "buffer": b"time_s,force_N\n0,1\n1,oops\n"}
        )
        until(page, lambda: [job for job in served.get("api/state")["jobs"] if "oops" in job["error"]])
        streams[0].continue_()
        page.locator(".notice.problem", has_text="oops").wait_for()


def test_a_file_that_went_is_offered_no_more_although_the_first_answer_without_it_was_lost(page_of, served):
    new = served.folder / "gone.csv"
    shutil.copy(served.folder / "one.csv", new)
    with page_of(served.url) as page:
        offered = page.locator("option[value='gone.csv']").first
        offered.wait_for(state="attached")
        idle(page)
        lost = []
        page.route("**/api/state", lambda route: route.continue_() if lost else (lost.append(route), route.abort()))
        new.unlink()
        until(page, lambda: lost)
        offered.wait_for(state="detached")


def test_work_is_going_on_until_the_outcome_of_a_job_is_known(page_of, served):
    with page_of(served.url) as page:
        idle(page)
        with held(page, "**/api/state") as waiting:
            served.order("prepare", recording="one.csv")
            until(page, lambda: waiting)
            assert page.locator("html").get_attribute("data-busy") != "0"
        idle(page)


def test_the_place_of_a_flight_that_was_gone_to_last_is_shown(page_of, served):
    with page_of(f"{served.url}#flight") as page:
        left = page.locator(".engine").first
        idle(page)
        left.locator(".lamp").first.wait_for()
        with held(page, "**/api/lines*buckets=4000*") as waiting:
            for number, at_s in enumerate((150, 20), start=1):
                page.get_by_label("time", exact=True).evaluate(
                    "(slider, at) => { slider.value = at; slider.dispatchEvent(new Event('input')); }", at_s
                )
                until(page, lambda windows=3 * number: len(waiting) == windows)  # of two engines and the mounts
            newer, waiting[:] = waiting[3:], waiting[:3]
            let_go(page, *newer)
            left.locator("b", has_text=re.compile(r"^20\d\d$")).wait_for()
        left.locator("b", has_text=re.compile(r"^20\d\d$")).wait_for()


def test_what_was_marked_twice_in_haste_is_marked_twice(page_of, served):
    with page_of(f"{served.url}#histories") as page:
        page.locator(".sheet[data-ready]").wait_for()
        with held(page, "**/api/marks/*") as waiting:
            for name in ("a gust", "a bump"):
                page.get_by_role("button", name="Mark this window").click()
                page.get_by_label("label").fill(name)
                page.locator("dialog button", has_text="Mark").click()
            until(page, lambda: waiting)
        page.locator("table.marks", has_text="a bump").wait_for()
        page.locator("table.marks", has_text="a gust").wait_for(timeout=5000)
        for left in (1, 0):
            page.get_by_role("button", name="remove").first.click()
            page.wait_for_function("left => document.querySelectorAll('table.marks tr').length === left", arg=left)


def test_a_condition_is_called_by_what_was_asked(page_of, served):
    with page_of(f"{served.url}#histories") as page:
        page.locator(".sheet[data-ready]").wait_for()
        idle(page)
        with held(page, "**/api/reports/*") as waiting:
            page.get_by_label("to limit").fill("2000")
            page.get_by_role("button", name="Show", exact=True).click()
            until(page, lambda: waiting)
            page.get_by_label("to limit").fill("4000")
            go(page, "Overview")
            go(page, "Time histories")
            page.locator(".sheet[data-ready]").wait_for()
        page.get_by_text("of the time; RMSE there").wait_for()
        assert "force_N up to 2000" in page.locator(".keys").inner_text()


def test_a_drag_over_a_plot_zooms_though_the_page_changes_under_it(page_of, served):
    with page_of(f"{served.url}#histories") as page:
        page.locator(".sheet[data-ready]").wait_for()
        idle(page)
        box = page.locator(".u-over").first.bounding_box()
        page.mouse.move(box["x"] + 100, box["y"] + 50)
        page.mouse.down()
        page.mouse.move(box["x"] + 200, box["y"] + 50)
        with held(page, "**/api/state") as waiting:
            choose(served, measured=["two.csv"])
            until(page, lambda: waiting)
        page.mouse.move(box["x"] + 300, box["y"] + 50)
        page.mouse.up()
        page.wait_for_function("() => location.hash.includes('from=')")


def test_who_types_or_chooses_is_not_disturbed(page_of, served):
    with page_of(served.url) as page:
        idle(page)
        folded = page.locator("table.recordings details").first
        folded.locator("summary").click()
        role = page.get_by_label("use of one.csv")
        role.click()  # the list is open
        with held(page, "**/api/state") as waiting:
            choose(served, heldout=["two.csv"])
            until(page, lambda: waiting)
        page.keyboard.press("ArrowUp")
        page.keyboard.press("Enter")
        page.wait_for_function(
            "() => document.querySelector(\"select[aria-label='bench recording']\").value === 'one.csv'"
        )
        page.get_by_label("use of two.csv").locator("option:checked", has_text="check on").wait_for(state="attached")
        assert folded.get_attribute("open") is not None
        assert page.evaluate("document.activeElement.getAttribute('aria-label')") == "use of one.csv"


def test_a_log_is_followed_on_after_an_answer_that_failed(page_of, served):
    failed = []
    with page_of(served.url) as page:
        page.route("**/api/live*", lambda route: route.continue_() if failed else (failed.append(1), route.abort()))
        go(page, "Live and flight")
        page.get_by_role("button", name="Follow live").click()
        page.locator(".engine b").first.wait_for()
        assert failed


def test_play_is_pressed_although_a_shift_was_typed_before(page_of, served):
    with page_of(f"{served.url}#flight") as page:
        page.get_by_label("second flight").select_option("second.mcap")
        page.get_by_label("time shift in seconds").press_sequentially("5")
        page.get_by_role("button", name="Play", exact=True).click()
        page.get_by_role("button", name="Pause", exact=True).wait_for()
        assert page.get_by_label("time shift in seconds").input_value().endswith("5")


def test_an_answer_about_a_flight_is_shown_though_the_state_changes_while_it_comes(page_of, tmp_path):
    write_recording(made_flight((0.2, 0.25, 0.3, 0.35, 0.4)), tmp_path / "one.csv")
    with workbench(tmp_path) as flown, page_of(flown.url) as page:
        assert flown.order("prepare", recording="one.csv")["state"] == "done"
        assert flown.order("flighttest", question="points", recordings=["one.csv"])["state"] == "done"
        idle(page)
        with held(page, "**/api/reports/*") as waiting:
            go(page, "Flight test")
            until(page, lambda: waiting)
            choose(flown, unchecked=True)
            until(page, lambda: len(waiting) == 2)
            let_go(page, waiting.pop(0))
            with page.expect_request_finished(lambda request: "api/state" in request.url):
                choose(flown, unchecked=False)
        page.get_by_role("heading", name="Test points of one.csv").wait_for()


def test_a_hypothesis_that_is_being_typed_stays(page_of, served):
    assert served.order("diagnose", model="model.json", recordings=["one.csv"])["state"] == "done"
    with page_of(f"{served.url}#missing") as page:
        page.get_by_label("expression over channels").press_sequentially("k * accel")
        page.locator(".idle button, tr.candidate").first.click()
        assert page.get_by_label("expression over channels").input_value() == "k * accel"


def test_a_limit_that_is_being_typed_stays_while_the_plots_are_drawn_anew(page_of, served):
    with page_of(f"{served.url}#histories") as page:
        page.locator(".sheet[data-ready]").wait_for()
        idle(page)
        limit = page.get_by_label("from limit")
        limit.press_sequentially("-")
        served.ask(
            "PUT", "api/marks/one.csv", '[{"start_s": 50.0, "stop_s": 60.0, "label": "a gust", "exclude": false}]'
        )
        page.get_by_text("a gust").wait_for()
        page.keyboard.type("100")
        assert limit.input_value() == "-100"
        served.ask("PUT", "api/marks/one.csv", "[]")
