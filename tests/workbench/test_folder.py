"""Names, sessions, undo, exercises: what is in files."""

import json
import os

import msgspec
import pytest

from tests.conftest import simple_model
from thrustd.core.errors import UsageError
from thrustd.model.artifact import LedgerEntry, write_model
from thrustd.workbench.exercise import make_exercise, reveal
from thrustd.workbench.folder import Folder, model_cards
from thrustd.workbench.html_report import write_html
from thrustd.workbench.session import Session, after_job, change_session, read_session
from thrustd.workbench.versions import undo


@pytest.fixture
def folder(tmp_path):
    (tmp_path / ".thrustd").mkdir()
    return Folder(tmp_path)


def quiet(fraction, note):
    """A page nobody looks at."""


def test_only_models_are_models(folder):
    (folder.root / "model.json").write_text(write_model(simple_model()))
    (folder.root / "notes.json").write_text('{"a": 1}')
    (folder.root / "broken.json").write_text('{"schema": "thrustd-model/1", "name": 3}')
    assert folder.models() == ["broken.json", "model.json"]
    problems = {card.name: card.problem for card in model_cards(folder)}
    assert problems["model.json"] == "" and "broken.json" in problems["broken.json"]


@pytest.mark.parametrize(
    "name", ["\x1b[31mx.csv", "a\nb.csv", os.fsdecode(b"\xff.csv"), "a\\b.csv", "x" * 210 + ".csv"]
)
def test_a_file_of_a_name_that_cannot_be_shown_spoils_no_page(folder, name):
    for path in (folder.root / name, folder.root / "inner" / name, folder.root / "good.csv"):
        path.parent.mkdir(exist_ok=True)
        path.write_text("time_s,force_N\n0,1\n1,2\n")
    assert folder.recordings() == ["good.csv"]
    assert [folder.path(each) for each in folder.recordings()] == [folder.root / "good.csv"]


def test_a_file_that_goes_while_the_folder_is_looked_at_is_one_that_is_gone(folder, monkeypatch):
    listed = list(Folder(folder.root)._files())
    without = folder.stamp()
    monkeypatch.setattr(folder, "_files", lambda: iter([*listed, folder.root / "gone.csv"]))
    assert folder.stamp() == without


def test_session_survives_nonsense_and_missing_files(folder):
    assert read_session(folder) == Session()
    (folder.state / "session.json").write_text("{")
    assert read_session(folder) == Session()
    with pytest.raises(UsageError, match="session"):
        change_session(folder, b'{"colour": "red"}')
    (folder.root / "a.csv").write_text("time_s\n0\n1\n")
    with pytest.raises(UsageError, match="no model of the folder"):
        change_session(folder, b'{"measured": ["a.csv"], "model": "gone.json"}')
    change_session(folder, b'{"measured": ["a.csv"]}')
    assert read_session(folder).measured == ("a.csv",) and read_session(folder).model == ""


def test_what_is_fitted_to_checks_nothing(folder):
    for name in ("a.csv", "holdout.csv"):
        (folder.root / name).write_text("time_s\n0\n1\n")
    change_session(folder, b'{"measured": ["holdout.csv"]}')
    assert read_session(folder).heldout == ()  # its name says check, but it is the measured one
    with pytest.raises(UsageError, match="is fitted to cannot check it"):
        change_session(folder, b'{"heldout": ["holdout.csv"]}')


def test_undo_goes_back_to_the_parent(folder):
    parent = simple_model("parent")
    text = json.dumps(json.loads(write_model(parent)))  # the same model, spelled differently
    (folder.root / "parent.json").write_text(text)
    import hashlib

    digest = hashlib.sha256(write_model(parent).encode()).hexdigest()
    entry = LedgerEntry("creep", 50.0, 20.0, "measured.csv", digest)
    child = msgspec.structs.replace(parent, name="child", ledger=[entry])
    (folder.root / "child.json").write_text(write_model(child))
    after_job(folder, "extend", {"model": "child.json"})
    assert read_session(folder).model == "child.json"
    assert undo(folder, "child.json").model == "parent.json"
    assert folder.models() == ["parent.json"]
    assert len(list((folder.state / "undone").iterdir())) == 1
    with pytest.raises(UsageError, match="parent"):
        undo(folder, "parent.json")


def test_exercise_is_sealed_until_revealed(folder):
    name = make_exercise(folder, {"strength": 3.0}, quiet)["exercise"]
    assert folder.recordings() == [f"{name}/{part}.csv" for part in ("bench", "heldout", "measured")]
    assert not [path for path in folder.root.rglob("truth*") if ".thrustd" not in path.parts]
    after_job(folder, "exercise", {"exercise": name})
    assert read_session(folder).bench == (f"{name}/bench.csv",)
    answer = reveal(folder, {"exercise": name}, quiet)
    assert len(answer["effects"]) == 1 and answer["effects"][0]["force_rms_n"] == pytest.approx(45, abs=1)
    with pytest.raises(UsageError, match="sealed"):
        reveal(folder, {"exercise": "exercise-9"}, quiet)


def test_report_needs_something_to_report(folder):
    with pytest.raises(UsageError, match="choose a model"):
        write_html(folder, {}, quiet)
