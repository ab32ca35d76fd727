"""Files whose columns are called otherwise: asked once, remembered, read in newtons and millimetres."""

import json

import numpy as np
import pytest

from tests.workbench.served import workbench
from thrustd.core.errors import UsageError
from thrustd.workbench.folder import Folder
from thrustd.workbench.mapping import Column, ColumnNames, Said, checked, keep_mapping
from thrustd.workbench.model_runs import recording_of
from thrustd.workbench.prepare import prepare
from thrustd.workbench.tasks import TASKS

SAID = {
    "columns": [
        {"theirs": "Time [s]", "ours": "time_s"},
        {"theirs": "Load [kN]", "ours": "force_N", "factor": -1000.0},
        {"theirs": "LVDT (V)", "ours": "deformation_mm", "factor": 0.25, "offset": -0.075},
    ]
}
THEIRS = [one["theirs"] for one in SAID["columns"]]


def write_foreign(path, n=2000, seed=0):
    """A mount of 5000 N/mm as somebody else's rig writes it: kN, compression negative, volts."""
    t = np.arange(n) / 20.0
    deformation = 0.5 + 0.3 * np.sin(t / 3) + 0.1 * np.sign(np.sin(t / 7))
    force = 5000 * deformation + 12 * np.random.default_rng(seed).standard_normal(n)
    rows = zip(t, -force / 1000, deformation * 4 + 0.3, strict=True)
    path.write_text("Time [s],Load [kN],LVDT (V)\n" + "".join(f"{a:.9g},{b:.9g},{c:.9g}\n" for a, b, c in rows))


def quiet(share, note=""):
    """Nobody listens."""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / ".thrustd").mkdir()
    write_foreign(tmp_path / "rig.csv")
    write_foreign(tmp_path / "test run.csv", seed=1)
    return Folder(tmp_path)


def test_a_strange_file_is_no_problem_but_a_question(folder):
    assert prepare(folder, "rig.csv", quiet) == {"recording": "rig.csv", "unmapped": True}
    table = json.loads(folder.table_path("rig.csv").read_bytes())
    assert not table["timed"] and table["wanting"] == ["force_N", "deformation_mm"]
    assert table["offered"]["Load [kN]"]["factor"] == -1000.0 and table["offered"]["LVDT (V)"]["unit"] == "V"


def test_what_was_said_is_read_and_remembered_for_the_others(folder):
    prepare(folder, "rig.csv", quiet)
    keep_mapping(folder.state, "rig.csv", checked(json.dumps(SAID).encode(), THEIRS), THEIRS)
    for name in ("rig.csv", "test run.csv"):
        assert prepare(folder, name, quiet) == {"recording": name}
        record = recording_of(folder, name)
        assert set(record.channels) == {"force_N", "deformation_mm"}
        slope = np.polyfit(record["deformation_mm"], record["force_N"], 1)
        assert slope == pytest.approx([5000, 0], abs=20)
    before = folder.columns_folder("rig.csv")
    keep_mapping(folder.state, "rig.csv", ColumnNames(), THEIRS)  # taken back: read as it is
    assert folder.columns_folder("rig.csv") != before and folder.columns("rig.csv") is None


def test_a_column_is_read_the_same_in_every_file_also_when_it_is_said_anew(folder):
    rows = (folder.root / "rig.csv").read_text().splitlines()
    text = [rows[0] + ",Temp [degC]", *(f"{row},20.5" for row in rows[1:])]
    (folder.root / "engine run.csv").write_text("\n".join(text))
    for name in folder.recordings():
        prepare(folder, name, quiet)
    said = checked(json.dumps(SAID).encode(), THEIRS)
    keep_mapping(folder.state, "rig.csv", said, THEIRS)
    assert [one.ours for one in folder.mapping("engine run.csv").columns] == ["time_s", "force_N", "deformation_mm"]
    other = {"columns": [*SAID["columns"][:2], {**SAID["columns"][2], "factor": 0.5}]}
    keys = {name: folder.key(name) for name in folder.recordings()}
    keep_mapping(folder.state, "test run.csv", checked(json.dumps(other).encode(), THEIRS), THEIRS)
    for name in folder.recordings():
        assert folder.mapping(name).columns[2].factor == 0.5 and folder.key(name) != keys[name]
    temp = ColumnNames((Column("Temp [degC]", "temperature_degC"),))
    keep_mapping(folder.state, "engine run.csv", temp, ["Temp [degC]"])
    assert "temperature_degC" in recording_of(folder, "engine run.csv")
    keep_mapping(folder.state, "rig.csv", said, THEIRS, only=True)
    assert [folder.mapping(name).columns[2].factor for name in ("rig.csv", "test run.csv")] == [0.25, 0.5]


def test_two_columns_of_one_meaning_do_not_meet_in_one_file():
    said = Said((Column("a", "force_N"), Column("b", "force_N"), Column("c", "mach")))
    assert [one.theirs for one in said.of("x.csv", ["a", "b", "c"]).columns] == ["b", "c"]
    assert said.of("x.csv", ["a", "force_N", "mach"]) == ColumnNames()


@pytest.mark.parametrize(
    ("columns", "word"),
    [
        ([{"theirs": "no", "ours": "force_N"}], "no column"),
        ([{"theirs": "Load [kN]", "ours": "force_N"}, {"theirs": "LVDT (V)", "ours": "force_N"}], "two columns"),
        ([{"theirs": "Load [kN]", "ours": "force N"}], "columns"),
        ([{"theirs": "Load [kN]", "ours": "force_N", "factor": 0}], "factor"),
    ],
)
def test_what_cannot_be_is_one_line(columns, word):
    with pytest.raises(UsageError, match=word) as problem:
        checked(json.dumps({"columns": columns}).encode(), THEIRS)
    assert "\n" not in str(problem.value)


def test_spelled_as_the_command_line_takes_it():
    names = checked(json.dumps(SAID).encode(), THEIRS)
    assert [one.spelled for one in names.columns] == [
        "Time [s]=time_s", "Load [kN]=force_N*-1000.0", "LVDT (V)=deformation_mm*0.25-0.075",
    ]  # fmt: skip


def test_over_http_and_the_roles_of_the_files(folder):
    with workbench(folder.root) as served:
        for name in folder.recordings():
            assert served.order("prepare", recording=name)["result"]["unmapped"]
        card = served.get("api/state")["recordings"][0]
        assert card["table"] == {"timed": False, "wanting": ["force_N", "deformation_mm"], "unseen": []}
        assert card["meta"] is None
        assert served.get("api/columns/rig.csv")["rows"] == 2000
        assert (
            served.ask("PUT", "api/columns/rig.csv", json.dumps({"columns": [{"theirs": "x", "ours": "y"}]}))[0] == 400
        )
        assert served.ask("PUT", "api/columns/rig.csv", json.dumps(SAID))[0] == 200
        served.order("prepare", recording="test run.csv")
        state = served.get("api/state")
        assert all(
            {c["name"] for c in one["meta"]["channels"]} == {"force_N", "deformation_mm"} for one in state["recordings"]
        )
        assert state["session"]["bench"] == ["rig.csv"] and state["session"]["heldout"] == ["test run.csv"]


def test_a_column_that_a_model_does_not_read_may_be_named_later(folder):
    path = folder.root / "rig.csv"
    heads, *rows = path.read_text().splitlines()
    path.write_text("\n".join([f"{heads},Ax [g]", *(f"{row},0.1" for row in rows)]) + "\n")
    there = [*THEIRS, "Ax [g]"]

    def say(*more, factor=0.25):
        columns = [*SAID["columns"][:2], SAID["columns"][2] | {"factor": factor}, *more]
        keep_mapping(folder.state, "rig.csv", checked(json.dumps({"columns": columns}).encode(), there), there)
        return folder.reading("rig.csv")

    prepare(folder, "rig.csv", quiet)  # the table, before anything is said
    say()
    made = TASKS["fit"](folder, {"recordings": ["rig.csv"], "out": "m.json"}, quiet)
    assert {"time_s", "deformation_mm", "force_N"} <= set(made["reads"])

    def changed(reading):
        return [name for name in ["", *made["reads"]] if reading.get(name) != made["reading"]["rig.csv"].get(name)]

    key = folder.key("rig.csv")
    assert not changed(say({"theirs": "Ax [g]", "ours": "accel_x_g"})) and folder.key("rig.csv") != key
    assert changed(say(factor=0.5)) == ["deformation_mm"]
    path.write_text(path.read_text() + "100.05,-2.5,2.3,0.1\n")
    prepare(folder, "rig.csv", quiet)
    assert "" in changed(folder.reading("rig.csv"))
