"""Screens of the page in a real browser: flights, long names, narrow windows, empty folders, messages."""

import json
import os
import re
import shutil
import time

import pytest

from tests.conftest import ROOT, simple_model
from tests.workbench.browser import held, idle, let_go, until
from tests.workbench.served import workbench
from tests.workbench.test_follow import write_log
from tests.workbench.test_server import small_record
from thrustd.model.artifact import write_model
from thrustd.records.files import write_recording

VIEWS = ("overview", "identify", "histories", "fails", "missing", "add", "flight", "flighttest")
SHOWN = {"histories": ".sheet[data-ready]", "fails": ".reasons", "flight": ".engine .lamp"}  # when its answer is here
LONG = "a-very-long-name-of-a-recording-that-came-from-the-archive-of-the-flight-test-department-second-attempt"


@pytest.fixture(scope="module")
def full_folder(browser, tmp_path_factory):
    folder = tmp_path_factory.mktemp("full")
    write_recording(small_record(), folder / f"{LONG}.csv")
    for i in range(12):
        (folder / f"run-{i:02d}.csv").write_bytes((folder / f"{LONG}.csv").read_bytes())
    (folder / f"{LONG}.json").write_text(write_model(simple_model()))
    write_log(folder / "flight.mcap", seconds=20)
    with workbench(folder) as served:
        for name in (f"{LONG}.csv", "flight.mcap", *(f"run-{i:02d}.csv" for i in range(12))):
            assert served.order("prepare", recording=name)["state"] == "done"
        served.ask("POST", "api/session", f'{{"model": "{LONG}.json", "measured": ["{LONG}.csv"]}}')
        assert served.order("compare", models=[f"{LONG}.json"], recordings=[f"{LONG}.csv"])["state"] == "done"
        yield served


def turn(page, served, view):
    """Go to a screen by its address; the frame says when it is there."""
    page.goto(f"{served.url}#{view}")
    page.locator(f"nav a[href='#{view}'][aria-current='page']").wait_for(state="attached")


@pytest.mark.parametrize("width", [390, 900, 1280, 1920])
def test_nothing_is_wider_than_the_window(page_of, full_folder, width):
    with page_of(full_folder.url, width) as page:
        for view in VIEWS:
            turn(page, full_folder, view)
            page.locator(SHOWN.get(view, "h1")).first.wait_for()
            idle(page)
            wide = page.evaluate(
                "[document.documentElement, ...document.querySelectorAll('.main, .context, .rail')]"
                ".map((one) => one.scrollWidth - one.clientWidth)"
            )
            assert max(wide) <= 0, (view, wide)


def test_a_flight_played_back(page_of, full_folder):
    with page_of(f"{full_folder.url}#flight") as page:
        left = page.locator(".engine").first
        page.get_by_label("time", exact=True).evaluate(
            "slider => { slider.value = 10; slider.dispatchEvent(new Event('input')); }"
        )
        left.locator("b", has_text="1500").wait_for()
        assert "1402 to 1598 N" in left.inner_text()
        left.get_by_text("transient since the log began").wait_for()  # the look at the whole flight is another answer
        page.get_by_role("button", name="Play", exact=True).click()
        page.locator(".playbar .num", has_text=re.compile("00:00:1[1-9]")).wait_for()


def test_a_log_followed_while_it_grows(page_of, full_folder):
    whole = full_folder.folder / "flight.mcap"
    growing = full_folder.folder / "growing.mcap"
    content = whole.read_bytes()
    growing.write_bytes(content[: len(content) // 2])
    soon_s = time.time() + 600  # however long this machine takes to open the page, it was written to lately
    os.utime(growing, (soon_s, soon_s))
    try:
        follow_to_its_end(page_of, full_folder, growing, content)
    finally:
        growing.unlink()


def follow_to_its_end(page_of, full_folder, growing, content):
    with page_of(f"{full_folder.url}#flight") as page:
        following = page.get_by_role("button", name="Follow live", pressed=True)
        following.wait_for()  # what is being written is shown without being asked for
        assert page.get_by_label("flight log").input_value() == "growing.mcap"
        page.locator(".engine b").first.wait_for()
        growing.write_bytes(content)
        page.locator(".readings", has_text="adc damaged").wait_for()
        assert "× 4" in page.locator(".readings").last.inner_text()
        assert re.search(r"\b199\d\b", page.locator(".engine").last.inner_text())
        page.get_by_role("button", name="Play back").click()
        page.get_by_role("button", name="Play", exact=True).wait_for()  # its end is written: it may be played


def test_a_new_log_is_offered_by_itself_while_another_is_played(page_of, full_folder):
    new = full_folder.folder / "landed.mcap"
    with page_of(f"{full_folder.url}#flight") as page:
        idle(page)
        page.get_by_role("button", name="Play", exact=True).click()
        page.get_by_label("second flight").wait_for(state="hidden")
        asked: list[str] = []
        page.on("request", lambda request: asked.append(request.url.split("/api/")[-1].split("?")[0]))
        try:
            shutil.copy(full_folder.folder / "flight.mcap", new)
            page.locator("select[aria-label='flight log'] option", has_text="landed.mcap").wait_for(state="attached")
            page.get_by_label("second flight").select_option("landed.mcap")  # once it is read
            page.get_by_role("button", name="Align").wait_for()
            assert page.get_by_label("flight log").input_value() == "flight.mcap"
        finally:
            new.unlink()
        assert set(asked) <= {"state", "jobs", "lines"} and asked.count("jobs") == 1  # nothing is asked again and again
        page.locator("select[aria-label='flight log'] option", has_text="landed.mcap").wait_for(state="detached")


def test_two_recordings_side_by_side_zoom_together(page_of, full_folder):
    with page_of(f"{full_folder.url}#histories") as page:
        page.locator(".sheet[data-ready]").wait_for()
        page.get_by_text("Recordings (1 of").click()
        page.get_by_role("checkbox", name="run-00.csv").check()
        page.locator(".sheet[data-ready]").nth(1).wait_for()
        idle(page)
        page.get_by_label("zoom recordings together").check()
        zoomed = page.locator(".sheet[data-ready]:not([data-ready='0 199.95'])")
        _press(page, "+")
        zoomed.nth(1).wait_for()
        assert zoomed.nth(0).get_attribute("data-ready") == zoomed.nth(1).get_attribute("data-ready")
        # whatever has the page draw them anew: both stay where they are, and the keys where they were
        mark = {"start_s": 50.0, "stop_s": 60.0, "label": "a gust", "exclude": False}
        full_folder.ask("PUT", "api/marks/run-00.csv", json.dumps([mark]))
        page.get_by_text("a gust").wait_for()
        zoomed.nth(1).wait_for()
        assert zoomed.nth(0).get_attribute("data-ready") == zoomed.nth(1).get_attribute("data-ready")
        assert page.evaluate("document.activeElement.className") == "sheet"


def _press(page, key):
    """A key on the first sheet, wherever the page is just drawing it anew."""
    page.wait_for_function(
        """key => {
            const sheet = document.querySelector(".sheet[data-ready]");
            sheet?.focus();
            return sheet?.dispatchEvent(new KeyboardEvent("keydown", {key, cancelable: true})) === false;
        }""",
        arg=key,
    )


def test_a_message_leaves_the_plots_alone_and_can_be_closed(page_of, full_folder):
    with page_of(f"{full_folder.url}#histories") as page:
        page.locator(".sheet[data-ready]").wait_for()
        drop(page, f"{LONG}-2.csv", [137, 80, 255, 0, 3, 200, 9, 10, 1])
        notice = page.locator(".notice.problem", has_text="not UTF-8 text")
        notice.wait_for()
        below = notice.bounding_box()["y"]
        main = page.locator(".main").bounding_box()
        assert main["y"] + main["height"] <= below + 1
        notice.get_by_role("button", name="close").click()
        notice.wait_for(state="detached")


def drop(page, name, content):
    """A file dragged over the page and dropped."""
    event = """([kind, name, content]) => {
        const data = new DataTransfer();
        data.items.add(new File([new Uint8Array(content)], name));
        const event = new DragEvent(kind, {dataTransfer: data, bubbles: true, cancelable: true});
        document.body.dispatchEvent(event);
    }"""
    page.evaluate(event, ["dragover", name, content])
    page.locator(".drop-veil").wait_for()
    page.evaluate(event, ["drop", name, content])
    page.locator(".drop-veil").wait_for(state="detached")


def test_a_click_counts_though_the_page_changes_under_it(page_of, full_folder):
    with page_of(full_folder.url) as page:
        page.locator("table.recordings button").first.wait_for()
        where = page.evaluate(
            "() => { const button = document.querySelector('table.recordings button');"
            " button.scrollIntoView({block: 'center'});"
            " const box = button.getBoundingClientRect();"
            " return [box.x + box.width / 2, box.y + box.height / 2]; }"
        )
        page.mouse.move(*where)
        page.mouse.down()
        with held(page, "**/api/state") as waiting:
            full_folder.ask("POST", "api/session", '{"heldout": ["run-03.csv"]}')  # another tab: it is drawn anew
            until(page, lambda: waiting)
        page.mouse.up()
        page.locator("#take-columns").wait_for()
        page.get_by_label("use of run-03.csv").locator("option:checked", has_text="check on").wait_for(state="attached")


def test_an_answer_that_comes_twice_leaves_what_was_chosen_chosen(page_of, full_folder):
    with page_of(full_folder.url) as page:
        idle(page)
        with held(page, "**/api/reports/*") as waiting:
            turn(page, full_folder, "fails")
            until(page, lambda: waiting)
            full_folder.ask("POST", "api/session", '{"heldout": ["run-04.csv"]}')
            until(page, lambda: len(waiting) == 2)  # a change of state asks while the first is on its way
            let_go(page, waiting.pop(0))
            page.locator(".reasons button").first.click()
        page.get_by_role("button", name="Show in the time history").wait_for()


def test_columns_of_another_file_stay_while_those_of_the_first_are_kept(page_of, full_folder):
    with page_of(full_folder.url) as page:
        idle(page)
        rows = page.locator("table.recordings tr")
        rows.filter(has_text="run-00.csv").get_by_role("button").click()
        take = page.locator("#take-columns")
        take.wait_for()
        with held(page, "**/api/columns/run-00.csv*") as waiting:
            take.click()
            until(page, lambda: waiting)
            rows.filter(has_text="run-01.csv").get_by_role("button").click()
            page.get_by_role("heading", name="Columns of run-01.csv").wait_for()
        idle(page)
        assert page.get_by_role("heading", name="Columns of run-01.csv").count() == 1


ORDER_TWICE = """async () => {
    const { order } = await import(new URL("static/js/store.js", document.baseURI));
    window.ends = [];
    for (let i = 0; i < 2; i++) order("prepare", {recording: "run-00.csv"}).then((job) => ends.push(job.state));
}"""


def test_who_orders_the_same_twice_hears_of_its_end_twice(page_of, full_folder):
    with page_of(full_folder.url) as page:
        idle(page)
        full_folder.hold_worker()
        page.evaluate(ORDER_TWICE)
        page.locator(".job", has_text="run-00.csv").get_by_role("button", name="Cancel").click()
        page.wait_for_function("() => ends.length === 2 && ends.every((state) => state === 'cancelled')")


def test_an_empty_folder_says_what_to_do(page_of, tmp_path):
    with workbench(tmp_path) as served, page_of(served.url) as page:
        assert page.locator("#next").inner_text() == "Make an exercise"
        for view in VIEWS:
            turn(page, served, view)
            page.locator(".empty").first.wait_for()


def test_a_folder_without_a_reference_is_not_sent_round_the_loop(page_of, tmp_path):
    (tmp_path / "flight.csv").write_text("time_s,deformation_mm\n0,0.1\n1,0.2\n2,0.3\n")
    with workbench(tmp_path) as served, page_of(served.url) as page:
        page.get_by_text("No recording here has a reference").wait_for()
        page.locator("#next", has_text="Time histories").click()
        page.locator(".sheet[data-ready]").wait_for()


def test_a_raw_log_says_how_it_gets_estimates(page_of, tmp_path):
    shutil.copy(ROOT / "replay_logs" / "throttle-steps.mcap", tmp_path / "first flight.mcap")
    with workbench(tmp_path) as served, page_of(f"{served.url}#flight") as page:
        page.locator("#next", has_text="Flight test").wait_for()
        said = page.locator(".empty code").inner_text()
        assert said == "thrustd replay 'first flight.mcap' -o 'first flight-replayed.mcap'"


def test_what_a_question_of_a_flight_test_lacks_stays_on_the_page(page_of, full_folder):
    with page_of(f"{full_folder.url}#flighttest") as page:
        page.get_by_role("button", name="Evaluate").click()
        problem = page.locator(".notice.problem")
        problem.wait_for()
        idle(page)
        assert "flight.mcap" in problem.inner_text()


def test_a_question_of_a_flight_test_is_asked_once_while_it_is_answered(page_of, full_folder):
    with page_of(f"{full_folder.url}#flighttest") as page:
        idle(page)
        full_folder.hold_worker()
        page.get_by_role("button", name="Evaluate").dblclick()
        asked = page.get_by_role("button", name="Working", disabled=True)
        asked.wait_for()
        turn(page, full_folder, "overview")
        turn(page, full_folder, "flighttest")
        asked.wait_for()  # whoever comes back finds it so
        page.locator(".job").get_by_role("button", name="Cancel").click()
        page.get_by_role("button", name="Evaluate", disabled=False).wait_for()


def test_why_a_file_could_not_be_read_stays_with_it(page_of, tmp_path):
    (tmp_path / "broken.csv").write_text("time_s,force_N\n0,1\n1,oops\n")
    with workbench(tmp_path) as served, page_of(served.url) as page:
        row = page.locator("tr", has_text="broken.csv")
        row.locator(".bad", has_text="oops").wait_for()
        assert "26 B" in row.inner_text()
        row.get_by_role("link").click()
        page.locator(".empty", has_text="oops").wait_for()


WORSE = """async () => {
    const { beforeAfter } = await import(new URL("static/js/evidence_charts.js", document.baseURI));
    const one = {recording: "a", rmse_n: 1, time_s: [0, 1, 2], low: [-1, -1, -1], high: [1, 1, 1]};
    document.querySelector("main").append(beforeAfter(one, {...one, low: [-9, -9, -9], high: [9, 9, 9]}));
}"""


def test_a_model_that_is_worse_than_before_is_drawn_whole(page_of, full_folder):
    with page_of(full_folder.url) as page:
        idle(page)
        page.evaluate(WORSE)
        page.wait_for_function("() => [...document.querySelectorAll('canvas')].at(-1)?.pane !== undefined")
        low, high = page.evaluate(
            "() => { const {top, height, unY} = [...document.querySelectorAll('canvas')].at(-1).pane;"
            " return [unY(top + height), unY(top)]; }"
        )
        assert low < -9 and high > 9
