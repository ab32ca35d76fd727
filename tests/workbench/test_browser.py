"""The page in a real browser: the whole loop on a hidden effect, long records, reloads, bad files."""

import math
import re

import numpy as np
import pytest

from tests.workbench.browser import LONG_MS, idle, next_step
from tests.workbench.served import workbench
from thrustd.records.files import read_recording, write_recording
from thrustd.records.recording import make_recording
from thrustd.twin.hide import hide

pytestmark = pytest.mark.long
N_LONG = 10_000_000
SPIKE_AT_S = 61_234.56
RECORD_S = 1200.0  # of each record of the exercise
KEPT = ("force_N", "deformation_mm", "accel_x_g", "accel_z_g", "temperature_degC")  # fewer channels, fewer questions


@pytest.fixture(scope="module")
def exercise(browser, tmp_path_factory):
    folder = tmp_path_factory.mktemp("exercise")
    hide(("axial_inertia",), seed=3, strength=4.0, out_dir=folder / "exercise-1", seconds=RECORD_S)
    for path in (folder / "exercise-1").glob("*.csv"):
        record = read_recording(path)
        kept = {"time_s": record.time_s} | {name: record[name] for name in KEPT if name in record}
        write_recording(make_recording(path.stem, kept), path)
    (folder / ".thrustd" / "sealed").mkdir(parents=True)
    (folder / "exercise-1" / "truth.json").rename(folder / ".thrustd" / "sealed" / "exercise-1.json")
    (folder / ".thrustd" / "session.json").write_text('{"exercise": "exercise-1"}')
    with workbench(folder) as served:
        yield served


def test_whole_loop_on_a_hidden_effect(page_of, exercise):
    with page_of(exercise.url) as page:
        reload_and_cancel(page, exercise)
        next_step(page, "Identify a model")
        page.locator("nav a", has_text="Identify").click()
        page.locator("h2", has_text="Static curve").wait_for()
        page.locator(".advice", has_text=re.compile(r"never goes below \d+ % of its largest;")).wait_for()
        next_step(page, "Compare")
        see_where_it_fails(page)
        next_step(page, "What is missing?")
        page.locator("h3", has_text="axial_inertia: leaves").wait_for(timeout=LONG_MS)
        verdict = page.locator(".verdict .name")
        verdict.wait_for(timeout=LONG_MS)
        assert verdict.inner_text() == "axial_inertia"
        assert "kg" in page.locator("tr.candidate").first.inner_text()
        next_step(page, "Add axial_inertia")
        see_the_fallen_bar(page)
        next_step(page, "Compare")
        see_before_and_after(page)
        next_step(page, "What is missing?")
        page.get_by_text("Nothing is left").wait_for(timeout=LONG_MS)
        assert "remove nothing" in page.locator(".idle").inner_text()
        page.locator("#next:not([disabled])", has_text="Open the sealed answer").click()
        estimate = see_found_beside_true(page)
        keep_it(page)
        assert (
            page.get_by_text(f"{estimate} kg", exact=True).count() == 1
        )  # one parameter, one interval on every screen
        exclude_and_be_told(page)
        undo(page)


def reload_and_cancel(page, served):
    """A fit goes on while the page is loaded again, and stops when it is told to."""
    page.get_by_text("with force_N").nth(2).wait_for(timeout=LONG_MS)  # every recording is read
    idle(page)
    served.hold_worker()
    page.locator("#next:not([disabled])", has_text="Identify").click()
    job = page.locator(".job", has_text="identify")
    job.wait_for()
    page.reload()
    job.wait_for()
    job.get_by_role("button", name="Cancel").click()
    idle(page)
    assert job.count() == 0


def see_where_it_fails(page):
    """A click on the first sentence takes the pictures, then the time history, to those samples."""
    first = page.locator(".reasons button").first
    first.wait_for()
    assert re.search(r"\d+ % of the squared error in [\d.]+ % of the time", first.inner_text())
    first.click()
    page.get_by_text("the chosen samples").wait_for()
    page.get_by_role("button", name="Show in the time history").click()
    sheet = page.locator(".sheet[data-ready]")
    sheet.wait_for()
    low, high = map(float, sheet.get_attribute("data-ready").split())
    assert high - low < RECORD_S - 1


def see_the_fallen_bar(page):
    bars = page.locator(".ledger .step")
    bars.nth(1).wait_for()
    before, after = (float(bars.nth(i).locator("b").inner_text().split()[0]) for i in (0, 1))
    assert after < 0.6 * before
    heights = bars.locator("i").evaluate_all("all => all.map(one => one.getBoundingClientRect().height)")
    assert heights[1] < 0.6 * heights[0]
    page.get_by_text("which nothing was fitted to").wait_for()
    page.get_by_text(re.compile(r"^[\d.]+ ± [\d.]+ kg$")).wait_for()
    page.get_by_text("promised on held-back blocks").wait_for()
    page.locator(".pair canvas").nth(1).wait_for()


def see_before_and_after(page):
    """Parent and child on the same samples, in one table and on the same pictures."""
    rows = page.locator("table.cells tbody tr")
    rows.nth(1).wait_for()
    before, after = (float(rows.nth(i).locator("td.num").first.inner_text().split()[0]) for i in (0, 1))
    assert after < 0.6 * before
    assert page.locator("h2", has_text="Force over deformation").count() == 2
    assert page.locator("h2", has_text="Error over force and rate").count() == 2


def see_found_beside_true(page):
    row = page.locator("table.truth tbody tr").first
    row.wait_for()
    effect, found, parameter, true, estimate, off, _ = row.locator("td").all_inner_texts()
    assert (effect, parameter) == ("axial_inertia", "mass_kg") and "found" in found
    assert abs(float(true) / float(estimate.split()[0]) - 1) < 0.05 and "sigma" in off
    assert "that is what the model holds" in page.locator(".guide").inner_text()
    assert page.get_by_role("button", name="Open the sealed answer").count() == 0
    return estimate


def keep_it(page):
    """Compiled for flight, a report that needs nothing else, a copy of the model."""
    page.locator("nav a", has_text="Add it").click()
    page.locator("#next", has_text="Save and compile").click()
    page.locator(".file", has_text="to the bit").wait_for(timeout=LONG_MS)
    page.locator(".guide b", has_text="Done").wait_for()
    assert str(page.locator(".file code").first.inner_text()).endswith("bench-model+axial_inertia.json")
    with page.expect_download(timeout=LONG_MS) as report:
        page.locator("#next", has_text="Write the report").click()
    text = report.value.path().read_text()
    assert "axial_inertia" in text and "mass_kg" in text and "data:image/png;base64," in text
    assert set(re.findall(r"""(?:src|href)=["']?(.{5})""", text)) == {"data:"} and "<script" not in text
    with page.expect_download() as copy:
        page.get_by_role("button", name="Save a copy").click()
    assert "axial_inertia" in copy.value.path().read_text()


def exclude_and_be_told(page):
    """A stretch that is left out makes the answers old: the page asks to compare again; with it back they are good."""
    page.locator("nav a", has_text="Time histories").click()
    page.locator(".sheet[data-ready]").wait_for()
    page.locator(".keys", has_text="95 % interval").first.wait_for(timeout=LONG_MS)  # the model has run
    with page.expect_download() as window:
        page.get_by_role("button", name="CSV of window").click()
    assert (
        window.value.path()
        .read_text()
        .startswith("time_s,force_N,model@exercise-1/bench-model+axial_inertia.json,residual@")
    )
    with page.expect_download() as picture:
        page.get_by_role("button", name="PNG").click()
    assert picture.value.path().read_bytes().startswith(b"\x89PNG")
    page.get_by_label("from limit").fill("-100")
    page.get_by_label("to limit").fill("2000")
    page.get_by_label("phase").select_option("unloading")
    page.get_by_role("button", name="Show", exact=True).click()
    page.get_by_text(re.compile(r"of the time; RMSE there [\d.]+ N")).wait_for(timeout=LONG_MS)
    idle(page)
    assert page.locator(".shade-key", has_text="unloading, force_N").count() == 1
    page.get_by_role("button", name="Mark this window").click()
    page.get_by_label("exclude").check()
    page.locator("dialog button", has_text="Mark").click()
    page.locator("#next", has_text="Compare").wait_for()
    page.get_by_role("button", name="remove").click()
    page.locator("#next", has_text="Compare").wait_for(state="detached")


def undo(page):
    page.locator("nav a", has_text="Add it").click()
    page.get_by_role("button", name="Undo").click()
    page.get_by_text("is chosen again").wait_for()
    assert page.locator(".context select").first.input_value() == "exercise-1/bench-model.json"


@pytest.fixture(scope="module")
def long_record(browser, tmp_path_factory):
    folder = tmp_path_factory.mktemp("long")
    time_s = np.arange(N_LONG) / 100.0
    deformation = 0.5 + 0.3 * np.sin(time_s / 500) + np.random.default_rng(0).standard_normal(N_LONG) * 1e-3
    deformation[round(SPIKE_AT_S * 100)] = 4.321
    write_recording(make_recording("long", {"time_s": time_s, "deformation_mm": deformation}), folder / "long.npz")
    with workbench(folder) as served:
        assert served.order("prepare", recording="long.npz")["state"] == "done"
        yield served


ZOOMED = """span => {
    const [low, high] = (document.querySelector(".sheet[data-ready]")?.dataset.ready ?? "0 1e9").split(" ");
    return high - low < span;
}"""


def test_zooming_ten_million_samples(page_of, long_record):
    sizes = []
    with page_of(long_record.url + "#histories") as page:
        page.on("response", lambda r: sizes.append(int(r.headers["content-length"])) if "api/lines" in r.url else None)
        sheet = page.locator(".sheet[data-ready]")
        sheet.wait_for()
        box = page.locator(".u-over").first.bounding_box()

        def x_of(t_s):
            low, high = map(float, sheet.get_attribute("data-ready").split())
            return box["x"] + box["width"] * (t_s - low) / (high - low)

        for _ in range(6):
            assert any("4.32" in hovered(page, x_of(SPIKE_AT_S) + aside, box["y"] + 40) for aside in (0, -1, 1, -2, 2))
            shown = sheet.get_attribute("data-ready")
            for _ in range(4):
                page.mouse.wheel(0, -120)
            low, high = map(float, shown.split())
            page.wait_for_function(ZOOMED, arg=1.01 * (high - low) * math.exp(-1.0))  # all four turns, and drawn
        low, high = map(float, sheet.get_attribute("data-ready").split())
        assert high - low < 600
        sheet.press("0")
        page.wait_for_selector(".sheet[data-ready^='0 ']")
    assert len(sizes) >= 8 and max(sizes) < 100_000


def hovered(page, x, y):
    """What the readout says with the pointer there; a column of the screen is one bucket."""
    page.mouse.move(x, y)
    return page.locator(".plot .readout").first.inner_text()


def test_marking_a_bad_stretch(page_of, long_record):
    with page_of(long_record.url + "#histories") as page:
        page.locator(".sheet[data-ready]").wait_for()
        page.get_by_role("button", name="Mark this window").click()
        page.get_by_label("label").fill("spike")
        page.get_by_label("exclude").check()
        page.locator("dialog button", has_text="Mark").click()
        page.locator("table.marks", has_text="spike").wait_for()
        page.reload()
        page.locator("table.marks", has_text="excluded").wait_for()
        page.get_by_role("button", name="remove").click()
        page.locator("table.marks").wait_for(state="detached")


def test_a_corrupt_file_dropped_in(page_of, long_record):
    with page_of(long_record.url) as page:
        bad = {"name": "bad.csv", "mimeType": "text/csv", "buffer": b"time_s,force_N\n0,1\n1,oops\n"}
        page.locator("input[type=file]").set_input_files(bad)
        notice = page.locator(".notice.problem", has_text="oops")
        notice.wait_for(timeout=LONG_MS)
        assert "bad.csv" in notice.inner_text() and "data row 2" in notice.inner_text()
        assert page.locator("td", has_text="bad.csv").count() == 0


def test_without_the_token_and_outside_the_folder(page_of, long_record):
    bare = f"http://127.0.0.1:{long_record.port}/"
    with page_of(bare) as page:
        assert "token" in page.inner_text("body")
        assert page.request.get(long_record.url + "api/files/..%2f..%2fetc%2fpasswd").status == 400
        assert page.request.get(bare + "static/js/main.js").status == 403
