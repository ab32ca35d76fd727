"""The report's story, and its script: run in the folder it makes the same model again."""

import json
import subprocess
import sys

import msgspec
import pytest

from tests.workbench.test_mapping import SAID, THEIRS, quiet, write_foreign
from thrustd.workbench.finding import fit
from thrustd.workbench.folder import Folder
from thrustd.workbench.html_report import write_html
from thrustd.workbench.jobs import Job
from thrustd.workbench.mapping import checked, keep_mapping
from thrustd.workbench.prepare import prepare, write_report
from thrustd.workbench.session import change_session, read_session
from thrustd.workbench.story import script_of, steps_of


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A model identified from a foreign file, and a diagnosis of it, as the page would have left them."""
    root = tmp_path_factory.mktemp("story")
    (root / ".thrustd" / "jobs").mkdir(parents=True)
    write_foreign(root / "1 rig.csv", n=6000)
    write_foreign(root / "test run.csv", n=6000, seed=1)
    folder = Folder(root)
    keep_mapping(folder.state, "1 rig.csv", checked(json.dumps(SAID).encode(), THEIRS), THEIRS)
    for name in folder.recordings():
        prepare(folder, name, quiet)
    made = fit(folder, {"recordings": ["1 rig.csv"], "out": "bench-model.json"}, quiet)
    keep(folder, Job("1", "fit", "", {"recordings": ["1 rig.csv"]}, "done", result=made))
    asked = {"verdict": ["none"], "grade": "strong", "depends_on": [], "more_left": False, "floor_n": 12.0,
             "rmse_before_n": 12.1, "rmse_after_n": 12.1, "candidates": [], "advice": ["nothing more"],
             "evidence": []}  # fmt: skip
    answer = {"report": write_report(folder, "a", asked)}
    keep(folder, Job("2", "diagnose", "", {"model": "bench-model.json", "recordings": []}, "done", result=answer))
    change_session(folder, b'{"model": "bench-model.json", "measured": ["test run.csv"], "heldout": []}')
    return folder


def keep(folder, job):
    (folder.state / "jobs" / f"{job.id}.json").write_bytes(msgspec.json.encode(job))


def test_the_report_tells_identification_verdict_and_floor(folder):
    text = (folder.state / "reports" / write_html(folder, {"title": "my mount"}, quiet)["report"]).read_text()
    for words in (
        "my mount",
        "Identified from 1 rig.csv",
        "Missing in it: none",
        "the floor is 12",
        "import thrustd as td",
    ):
        assert words in text, words
    assert "<script" not in text


def test_the_script_makes_the_model_again(folder):
    script = script_of(folder, steps_of(folder, "bench-model.json"), read_session(folder))
    assert "record_1_rig = td.read('1 rig.csv', rename=['Time [s]=time_s', 'Load [kN]=force_N*-1000.0'" in script
    said = (sys.executable, "-c", script)
    done = subprocess.run(said, cwd=folder.root, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    again, first = (json.loads((folder.root / name).read_text()) for name in ("again.json", "bench-model.json"))
    for part in ("input_curve", "linear", "output_curve"):
        assert again[part] == first[part], part
    assert "test run.csv" in done.stdout
    (folder.root / "again.json").unlink()
