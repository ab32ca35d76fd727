"""Somebody who was not there, with a CSV from a rig of his own, in a real browser."""

import json

import msgspec
import numpy as np
import pytest

from tests.diagnose.scene import DT_S, mount, record
from tests.workbench.browser import LONG_MS, idle, next_step
from tests.workbench.served import workbench
from tests.workbench.test_mapping import SAID, write_foreign
from thrustd.identify.artifact import witness_rows
from thrustd.model.artifact import write_model
from thrustd.records.files import write_recording
from thrustd.records.recording import make_recording

N = 6000  # samples
HEARD = """async () => {
    const { store } = await import(new URL("static/js/store.js", document.baseURI));
    return store.server.recordings[0].mapped.columns?.length === 3;
}"""


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


def test_columns_half_said_stay_while_another_screen_is_looked_at(page_of, tmp_path):
    write_foreign(tmp_path / "rig.csv", n=6000)
    with workbench(tmp_path) as served, page_of(served.url) as page:
        idle(page)
        page.locator("#next", has_text="Name the columns").click()
        page.get_by_label("scale of LVDT (V)").fill("0.25")
        page.get_by_label("reverse the sign of Load [kN]").uncheck()
        _look_elsewhere(page)
        assert page.get_by_label("scale of LVDT (V)").input_value() == "0.25"
        assert not page.get_by_label("reverse the sign of Load [kN]").is_checked()
        page.get_by_label("zero of LVDT (V)").fill("0.3")
        page.get_by_text("one of the two signs is reversed").wait_for()  # the preview is that of what is shown
        page.locator("nav a[href='#histories']").click()
        assert served.ask("PUT", "api/columns/rig.csv", json.dumps(SAID))[0] == 200  # another tab has said it
        page.wait_for_function(HEARD)
        _look_elsewhere(page)
        page.locator("input[aria-label='reverse the sign of Load [kN]']:checked").wait_for()  # once it is asked again


def _look_elsewhere(page):
    """And back."""
    for view in ("fails", "overview"):
        page.locator(f"nav a[href='#{view}']").click()
        page.locator(f"nav a[href='#{view}'][aria-current='page']").wait_for()
    page.locator("#take-columns").wait_for()


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


def test_what_has_no_law_is_added_as_the_curve_of_its_channel(page_of, tmp_path):
    incidence_deg = 8.0 * np.sin(np.arange(N) * DT_S / 7.0)
    hidden = record(n=N, added=lambda columns: 150.0 * np.tanh(incidence_deg / 2.0))
    kept = {name: hidden[name] for name in ("time_s", "force_N", "deformation_mm")} | {"incidence_deg": incidence_deg}
    write_recording(make_recording("flight", kept), tmp_path / "flight.csv")
    model = msgspec.structs.replace(mount(), witness=witness_rows(mount(), 1 / DT_S))
    (tmp_path / "mount.json").write_text(write_model(model))
    with workbench(tmp_path) as served:
        assert served.order("prepare", recording="flight.csv")["state"] == "done"
        served.ask("POST", "api/session", '{"model": "mount.json", "measured": ["flight.csv"]}')
        job = served.order("diagnose", model="mount.json", recordings=["flight.csv"])
        assert job["state"] == "done", job["error"]
        with page_of(f"{served.url}#missing") as page:
            page.locator(".verdict .name", has_text="unknown").wait_for()
            assert page.locator(".verdict .chip").count() == 0  # how sure nothing is, is no question
            page.get_by_role("button", name="Add curve of incidence_deg").first.click()
            steps = page.locator(".ledger .step b")
            steps.nth(1).wait_for(timeout=LONG_MS)
            before, after = (float(steps.nth(i).inner_text().split()[0]) for i in (0, 1))
            assert after < 0.2 * before
            promised = page.locator("tr", has_text="promised on held-back blocks").locator("b").inner_text()
            assert float(promised.split()[0]) < 0.2 * before
            page.locator(".floor", has_text="floor").wait_for()
            page.get_by_text("16 heights of").wait_for()
            page.get_by_role("img", name="added to the force [N] against incidence_deg").wait_for()
            assert page.get_by_text("height_08").count() == 0
            page.get_by_role("button", name="Save and compile").last.click()  # a curve is kept like any law
            page.locator(".file", has_text="reads").wait_for(timeout=LONG_MS)
        assert served.order("report")["state"] == "done"
        (report,) = (tmp_path / ".thrustd" / "reports").glob("*.html")
        told = report.read_text()
        assert "<b>Missing in it: unknown</b>:" in told and "; curve of incidence_deg would leave 1" in told
        assert "16 heights of" in told and "16 places of" in told and "height_08" not in told
        assert 'alt="curve of incidence_deg, band: 95 %"' in told
