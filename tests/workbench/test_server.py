"""The server asked over HTTP: who gets an answer, what leaves the folder, what a job does."""

import asyncio
import json

import msgspec
import numpy as np
import pytest

from tests.conftest import simple_model
from tests.workbench.served import workbench
from thrustd.core.errors import UsageError
from thrustd.model.artifact import write_model
from thrustd.records.files import write_recording
from thrustd.records.recording import make_recording
from thrustd.workbench import uploads
from thrustd.workbench.folder import Folder
from thrustd.workbench.jobs import Job, JobBoard


def small_record(n=4000):
    t = np.arange(n) / 20.0
    deformation = 0.5 + 0.4 * np.sign(np.sin(2 * np.pi * t / 60))
    rng = np.random.default_rng(2)
    channels = {
        "deformation_mm": deformation,
        "force_N": 4900 * deformation + rng.standard_normal(n) * 12,
        "accel_x_g": 0.1 * np.sin(t / 7),
        "accel_z_g": 1 + 0.1 * np.sin(t / 11),
    }
    return make_recording("measured", {"time_s": t, **channels})


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bench")
    write_recording(small_record(), folder / "measured.csv")
    (folder / "model.json").write_text(write_model(simple_model()))
    (folder.parent / "secret.csv").write_text("time_s\n0\n1\n")
    (folder / "way-out.csv").symlink_to(folder.parent / "secret.csv")
    (folder.parent / "elsewhere").mkdir()
    (folder.parent / "elsewhere" / "secret.csv").write_text("time_s\n0\n1\n")
    (folder / "door").symlink_to(folder.parent / "elsewhere")
    with workbench(folder) as running:
        yield running


def test_page_and_its_headers(served):
    status, headers, body = served.ask("GET", "")
    assert status == 200 and b"thrustd workbench" in body
    policy = headers["content-security-policy"]
    assert "default-src 'none'" in policy and "unsafe" not in policy and "http" not in policy
    assert headers["x-frame-options"] == "DENY" and headers["cache-control"] == "no-store"


@pytest.mark.parametrize("token", ["", "x", "0" * 32])
@pytest.mark.parametrize("path", ["", "api/state", "static/js/main.js", "api/events"])
def test_nothing_without_the_token(served, token, path):
    status, _, body = served.ask("GET", path, token=token)
    assert status == 403 and b"token" in body and served.token.encode() not in body


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "evil.example"},
        {"Host": "127.0.0.1:1"},
        {"Origin": "https://evil.example"},
        {"Origin": "null"},
        {"Sec-Fetch-Site": "cross-site"},
    ],
)
def test_other_pages_are_refused(served, headers):
    status, _, _ = served.ask("POST", "api/session", "{}", headers)
    assert status == 403
    assert served.ask("POST", "api/session", "{}", {"Origin": f"http://127.0.0.1:{served.port}"})[0] == 200


def test_only_the_loopback_interface_listens(served):
    hexadecimal = f":{served.port:04X}"
    with open("/proc/net/tcp") as table:
        listening = [line.split()[1] for line in table if hexadecimal in line.split()[1] and line.split()[3] == "0A"]
    assert listening == [f"0100007F{hexadecimal}"]


@pytest.mark.parametrize(
    "name",
    [
        "../secret.csv", "..%2fsecret.csv", "%2e%2e/secret.csv", "/etc/passwd", "%2fetc%2fpasswd", "way-out.csv",
        "door/secret.csv", ".thrustd/session.json", ".thrustd%2fsession.json", "a/b/c.csv", "..\\secret.csv", "x" * 300,
        "%00.csv",
    ],
)  # fmt: skip
def test_nothing_outside_the_folder(served, name):
    for path in (f"api/files/{name}", f"api/lines?recording={name}&channel=force_N", f"static/{name}"):
        status, _, body = served.ask("GET", path)
        assert status in (400, 404) and b"root:" not in body and b"time_s\n0" not in body


def test_state_says_what_there_is(served):
    state = served.get("api/state")
    assert [r["name"] for r in state["recordings"]] == ["measured.csv"]
    assert [m["name"] for m in state["models"]] == ["model.json"]
    assert state["session"]["measured"] == ["measured.csv"]


def test_run_compare_and_draw(served):
    assert served.order("simulate", recording="measured.csv", models=["model.json"])["state"] == "done"
    status, _, body = served.ask("GET", "api/lines?recording=measured.csv&channel=force_N&channel=residual@model.json")
    assert status == 200 and len(body) < 100_000
    job = served.order("compare", models=["model.json"], recordings=["measured.csv"])
    report = served.get(f"api/reports/{job['result']['report']}")
    cell = report["cells"][0]
    assert cell["rmse_n"] == job["result"]["cells"][0]["rmse_n"] > 0
    assert {d["channel"] for d in cell["dependences"]} >= {"deformation_mm", "accel_x_g"}


def test_condition_gives_stretches_and_the_error_there(served):
    condition = {"channel": "force_N", "high": 2000.0, "phase": ""}
    job = served.order("compare", models=["model.json"], recordings=["measured.csv"], condition=condition)
    found = served.get(f"api/reports/{job['result']['report']}")["condition"]
    assert found["time_share"] == pytest.approx(0.5, abs=0.05)
    assert len(found["intervals"]["measured.csv"]) == pytest.approx(4, abs=2)
    job = served.order(
        "compare", models=["model.json"], recordings=["measured.csv"], condition={"low": 1e9, "channel": "force_N"}
    )
    assert job["state"] == "failed" and "condition" in job["error"]


@pytest.mark.parametrize(
    "order",
    [
        {"kind": "compare", "models": ["no.json"], "recordings": ["measured.csv"]},
        {"kind": "compare", "models": [], "recordings": ["measured.csv"]},
        {"kind": "extend", "model": "model.json", "effects": ["creep"], "recordings": ["measured.csv"], "heldout": [],
         "out": "../out.json"},
        {"kind": "extend", "model": "model.json", "effects": ["creep"], "recordings": ["measured.csv"], "heldout": [],
         "out": "model.json"},
        {"kind": "shell", "command": "true"},
        {"kind": "prepare", "recording": "measured.csv", "extra": 1},
        ["prepare"],
    ],
)  # fmt: skip
def test_orders_that_make_no_sense_are_one_line(served, order):
    status, _, body = served.ask("POST", "api/jobs", json.dumps(order))
    assert status == 400
    assert "\n" not in json.loads(body)["error"]


def test_uploads_are_checked_before_the_folder_gets_them(served):
    good = b"time_s,deformation_mm\n0,0\n1,0.1\n2,0.2\n"
    for name, content, word in (
        ("corrupt.csv", b"time_s,force_N\n0,1\n1,oops\n", "force_N"),
        ("broken.parquet", b"PAR1 not really", "broken.parquet"),
        ("model-b.json", b'{"schema": "thrustd-model/1"}', "model-b.json"),
    ):
        status, _, body = served.ask("PUT", f"api/files/{name}", content)
        assert status == 200
        job = finished(served, json.loads(body)["id"])
        assert job["state"] == "failed" and word in job["error"] and "\n" not in job["error"]
        assert not (served.folder / name).exists()
    for name, word in (("x.exe", "type"), ("measured.csv", "already"), (".hidden.csv", "name"), ("..%2fy.csv", "name")):
        status, _, body = served.ask("PUT", f"api/files/{name}", good)
        assert status == 400 and word in json.loads(body)["error"]
    status, _, body = served.ask("PUT", "api/files/good.csv", good)
    assert finished(served, json.loads(body)["id"])["state"] == "done"
    assert (served.folder / "good.csv").read_bytes() == good
    assert not list((served.folder / ".thrustd" / "incoming").iterdir())
    (served.folder / "good.csv").unlink()


def finished(served, job_id):
    """Wait for a job by doing another one after it: the queue keeps its order."""
    served.order("prepare", recording="measured.csv")
    return next(job for job in served.get("api/state")["jobs"] if job["id"] == job_id)


def test_no_upload_through_a_link_that_leads_out(served):
    status, _, body = served.ask("PUT", "api/files/door/new.csv", b"time_s,force_N\n0,1\n1,2\n")
    assert status == 400 and b"outside" in body
    assert [path.name for path in (served.folder / "door").iterdir()] == ["secret.csv"]


@pytest.mark.parametrize("path", ["api/session", "api/jobs", "api/undo"])
@pytest.mark.parametrize("body", [b"\xff\xfe", b"{", b'{"model":' + b"[" * 300_000, b"x" * (1 << 21), b""])
def test_bodies_that_are_no_request_are_one_line(served, path, body):
    status, _, said = served.ask("POST", path, body)
    assert status == 400 and "\n" not in json.loads(said)["error"]


def test_an_upload_is_bounded_and_leaves_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(uploads, "MAX_UPLOAD_BYTES", 1000)

    class Endless:
        async def stream(self):
            while True:
                yield b"0,1\n" * 100

    with pytest.raises(UsageError, match=r"big.csv: more than"):
        asyncio.run(uploads.receive(Folder(tmp_path), "big.csv", Endless()))
    assert not list((tmp_path / ".thrustd" / "incoming").iterdir())


def test_marks_are_kept_beside_the_recording(served):
    marks = [{"start_s": 1.0, "stop_s": 2.0, "label": "bump", "exclude": True}]
    assert served.ask("PUT", "api/marks/measured.csv", json.dumps(marks))[0] == 200
    assert served.get("api/state")["recordings"][0]["marks"] == marks
    for bad in ([{"start_s": 2.0, "stop_s": 1.0}], [{"start": 1}], {"a": 1}):
        assert served.ask("PUT", "api/marks/measured.csv", json.dumps(bad))[0] == 400
    assert served.ask("PUT", "api/marks/measured.csv", "[]")[0] == 200


def test_window_csv_and_bad_numbers(served):
    served.order("prepare", recording="measured.csv")
    status, _, body = served.ask("GET", "api/window.csv?recording=measured.csv&channel=force_N&from=1&to=2")
    assert status == 200 and body.startswith(b"time_s,force_N\n1.0,")
    for query in ("from=a", "to=nan", "buckets=inf"):
        assert served.ask("GET", f"api/lines?recording=measured.csv&channel=force_N&{query}")[0] == 400


def test_compile_checks_the_witness(served):
    job = served.order("compile", model="model.json", rate_hz=1000.0)
    assert job["state"] == "done" and job["result"]["channels"][0] == "deformation_mm"
    broken = msgspec.json.decode((served.folder / "model.json").read_bytes())
    broken["witness"]["force_n"][3] += 50
    (served.folder / "broken.json").write_bytes(msgspec.json.encode(broken))
    job = served.order("compile", model="broken.json", rate_hz=1000.0)
    assert job["state"] == "failed" and "witness" in job["error"]
    (served.folder / "broken.json").unlink()


def test_jobs_of_a_closed_workbench_are_said_to_be_lost(tmp_path):
    (tmp_path / "jobs").mkdir()
    for state in ("running", "done"):
        job = Job(state, "fit", "a fit", {}, state)
        (tmp_path / "jobs" / f"{state}.json").write_bytes(msgspec.json.encode(job))
    board = JobBoard(tmp_path, tmp_path)
    assert board.job("running").state == "failed" and "closed" in board.job("running").error
    assert board.job("done").state == "done"
