"""One flight is chosen: both flight screens and the time histories look at it, and an answer is of what is chosen."""

import re
import shutil

import pytest

from tests.conftest import ROOT, simple_model
from tests.flighttest.scene import made_flight
from tests.workbench.browser import LONG_MS, idle
from tests.workbench.served import workbench
from tests.workbench.test_follow import write_log
from tests.workbench.test_server import small_record
from thrustd.model.artifact import write_model
from thrustd.records.files import write_recording

MACHS = (0.2, 0.25, 0.3, 0.35, 0.4)


@pytest.fixture(scope="module")
def flown(browser, tmp_path_factory):
    """Two flights, two logs, and the loop's recordings."""
    folder = tmp_path_factory.mktemp("flown")
    for name in ("flight-a.csv", "flight-b.csv"):
        write_recording(made_flight(MACHS), folder / name)
    for name in ("measured.csv", "other.csv"):
        write_recording(small_record(), folder / name)
    (folder / "model.json").write_text(write_model(simple_model()))
    write_log(folder / "log-a.mcap", seconds=20)
    shutil.copy(folder / "log-a.mcap", folder / "log-b.mcap")
    with workbench(folder) as served:
        for path in sorted((*folder.glob("*.csv"), *folder.glob("*.mcap"))):
            assert served.order("prepare", recording=path.name)["state"] == "done"
        served.ask("POST", "api/session", '{"model": "model.json", "measured": ["measured.csv"]}')
        yield served


def go(page, view):
    page.locator(f"nav a[href='#{view}']").click()
    page.locator(f"nav a[href='#{view}'][aria-current='page']").wait_for()


def shown(page, *names):
    """The time histories are those of these recordings."""
    page.locator(".sheet[data-ready]").first.wait_for()
    idle(page)
    assert page.locator(".panel:has(.sheet) > header h2").all_inner_texts() == list(names)


def test_time_histories_are_those_of_the_screen_before(page_of, flown):
    with page_of(f"{flown.url}#flight") as page:
        page.get_by_label("flight log").select_option("log-b.mcap")
        go(page, "histories")
        shown(page, "log-b.mcap")
        go(page, "fails")
        go(page, "histories")
        shown(page, "measured.csv")
        page.get_by_label("measured recording").select_option("other.csv")
        page.locator("header h2", has_text="other.csv").wait_for()
        shown(page, "other.csv")
        page.get_by_label("measured recording").select_option("measured.csv")


def test_recordings_that_were_picked_stay_while_one_of_them_is_worked_with(page_of, flown):
    with page_of(f"{flown.url}#histories") as page:
        shown(page, "measured.csv")
        page.locator("summary", has_text="Recordings").click()
        page.get_by_role("checkbox", name="other.csv").check()
        page.locator(".panel:has(.sheet)").nth(1).wait_for()
        go(page, "fails")
        go(page, "histories")
        shown(page, "measured.csv", "other.csv")


def test_where_only_flights_are_the_one_with_estimates_is_opened(page_of, tmp_path):
    shutil.copy(ROOT / "replay_logs" / "throttle-steps.mcap", tmp_path / "a-raw.mcap")
    write_log(tmp_path / "b-flown.mcap", seconds=20)
    with workbench(tmp_path) as served:
        for name in ("a-raw.mcap", "b-flown.mcap"):
            assert served.order("prepare", recording=name)["state"] == "done"
        with page_of(f"{served.url}#flight") as page:
            assert page.get_by_label("flight log").input_value() == "b-flown.mcap"
            go(page, "histories")
            shown(page, "b-flown.mcap")


def test_the_loop_s_choices_do_not_stand_over_flights(page_of, flown):
    with page_of(f"{flown.url}#flight") as page:
        page.locator(".engine .lamp").first.wait_for()
        assert not page.locator(".context").is_visible() and not page.locator(".guide").is_visible()
        go(page, "flighttest")
        assert not page.locator(".context").is_visible()
        go(page, "fails")
        assert page.get_by_label("measured recording").is_visible() and page.locator(".guide").is_visible()


def test_both_flight_screens_look_at_one_flight_and_a_reload_keeps_it(page_of, flown):
    with page_of(f"{flown.url}#flight") as page:
        page.get_by_label("flight log").select_option("log-b.mcap")
        page.reload()
        page.locator(".engine .lamp").first.wait_for()
        assert page.get_by_label("flight log").input_value() == "log-b.mcap"
        go(page, "flighttest")
        assert page.get_by_label("flight", exact=True).input_value() == "log-b.mcap"


def test_an_answer_is_of_the_flight_that_is_chosen(page_of, flown):
    assert flown.order("flighttest", question="points", recordings=["flight-a.csv"])["state"] == "done"
    with page_of(f"{flown.url}#flighttest") as page:
        chosen = page.get_by_label("flight", exact=True)
        chosen.select_option("flight-a.csv")
        page.get_by_role("heading", name="Test points of flight-a.csv").wait_for()
        chosen.select_option("flight-b.csv")
        page.get_by_text("Test points of flight-b.csv: not evaluated yet.").wait_for()
        assert page.get_by_role("heading", name="Test points of flight-a.csv").count() == 0
        page.get_by_role("button", name="Evaluate").click()
        page.get_by_role("heading", name="Test points of flight-b.csv").wait_for(timeout=LONG_MS)
        chosen.select_option("flight-a.csv")
        page.get_by_role("heading", name="Test points of flight-a.csv").wait_for()


def test_why_there_is_no_answer_stays_with_its_flight(page_of, flown):
    with page_of(f"{flown.url}#flighttest") as page:
        page.get_by_label("flight", exact=True).select_option("log-a.mcap")
        page.get_by_role("button", name="Evaluate").click()
        page.locator(".empty .bad", has_text="log-a.mcap").wait_for(timeout=LONG_MS)
        page.reload()
        page.locator(".empty .bad", has_text="log-a.mcap").wait_for()


def test_a_polar_without_a_mass_is_asked_for_on_the_page_s_own_words(page_of, flown):
    with page_of(f"{flown.url}#flighttest") as page:
        page.get_by_role("button", name="Drag polar").click()
        page.get_by_role("button", name="Evaluate").click()
        page.locator(".notice.problem", has_text="Give the four masses").wait_for()


def test_a_raw_log_is_replayed_by_a_button_and_its_estimates_are_shown(page_of, tmp_path):
    shutil.copy(ROOT / "replay_logs" / "throttle-steps.mcap", tmp_path / "raw.mcap")
    with workbench(tmp_path) as served, page_of(f"{served.url}#flight") as page:
        page.get_by_role("button", name="Replay it").click(timeout=LONG_MS)
        page.locator(".engine .lamp").first.wait_for(timeout=LONG_MS)
        assert page.get_by_label("flight log").input_value() == "raw-replayed.mcap"
        assert (tmp_path / "raw-replayed.mcap").exists()


def test_the_thrust_of_a_flight_stays_over_the_channels_that_are_picked(page_of, flown):
    with page_of(f"{flown.url}#flight") as page:
        page.get_by_label("flight log").select_option("log-b.mcap")
        go(page, "histories")
        shown(page, "log-b.mcap")
        titles = page.locator(".plot .title")
        assert "left engine: net thrust [N], forward +; band 95 %" in titles.all_inner_texts()
        page.locator("summary", has_text="Channels").click()
        page.get_by_role("checkbox", name=re.compile("^mount_force_n")).first.check()
        titles.get_by_text(re.compile(r"^mount_force_n_")).wait_for()
        assert "left engine: net thrust [N], forward +; band 95 %" in titles.all_inner_texts()
        page.locator(".u-over").first.hover()
        page.locator(".plot .readout").first.get_by_text(re.compile(r"^one sigma [\d.]+")).wait_for()
