"""What a page does about others: a server that is gone, another tab of the same session."""

import json
from contextlib import ExitStack

from tests.workbench.browser import idle
from tests.workbench.served import workbench
from tests.workbench.test_server import small_record
from thrustd.records.files import write_recording


def test_tabs_agree_and_a_server_that_is_gone_is_said(page_of, tmp_path):
    for name in ("measured.csv", "other.csv"):
        write_recording(small_record(), tmp_path / name)
    with ExitStack() as running:
        served = running.enter_context(workbench(tmp_path))
        end = running.pop_all()
        running.callback(end.close)  # whatever is found out before its end
        one, two = (running.enter_context(page_of(served.url)) for _ in range(2))
        idle(one)
        assert not one.locator(".gone").is_visible()
        one.get_by_label("measured recording").select_option("other.csv")
        two.wait_for_function(
            "() => document.querySelector(\"select[aria-label='measured recording']\").value === 'other.csv'"
        )
        end.close()
        one.locator(".gone").wait_for(state="visible")
        assert "thrustd workbench" in one.locator(".gone").inner_text()


def test_a_press_whose_release_was_swallowed_holds_nothing_up(page_of, tmp_path):
    for name in ("measured.csv", "other.csv"):
        write_recording(small_record(), tmp_path / name)
    with workbench(tmp_path) as served, page_of(served.url) as page:
        idle(page)
        page.get_by_role("button", name="Light / dark").dispatch_event("pointerdown", {"button": 0})
        page.mouse.move(300, 300)
        served.ask("POST", "api/session", '{"bench": ["other.csv"]}')
        page.get_by_label("bench recording").locator("option:checked", has_text="other").wait_for(state="attached")


def test_the_focus_goes_from_the_end_of_one_job_to_no_other(page_of, tmp_path):
    for name in ("measured.csv", "other.csv"):
        write_recording(small_record(), tmp_path / name)
    with workbench(tmp_path) as served, page_of(served.url) as page:
        idle(page)
        served.hold_worker()
        first, _ = (
            json.loads(served.ask("POST", "api/jobs", json.dumps({"kind": "prepare", "recording": name}))[2])
            for name in ("measured.csv", "other.csv")
        )
        jobs = page.locator(".job")
        jobs.nth(1).wait_for()
        jobs.filter(has_text="measured.csv").get_by_role("button", name="Cancel").focus()
        served.ask("DELETE", f"api/jobs/{first['id']}")
        jobs.filter(has_text="measured.csv").wait_for(state="detached")
        assert "Cancel" not in page.evaluate("document.activeElement.textContent.slice(0, 6)")
