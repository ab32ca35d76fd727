"""Foreign columns under the names of the catalogue: what is said, what is refused, and the verb convert."""

import numpy as np
import pytest
from scipy.io import savemat

from thrustd.__main__ import main
from thrustd.core.errors import RecordingError, UsageError
from thrustd.records.files import read_recording
from thrustd.records.rename import Rename, check_unit, read_rename, renamed


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("x=deformation_mm", Rename("x", "deformation_mm")),
        ("Load [kN]=force_N*1000", Rename("Load [kN]", "force_N", 1000.0)),
        ("T [K] = temperature_degC-273.15", Rename("T [K]", "temperature_degC", 1.0, -273.15)),
        ("u=v=force_N*-1e3+2.5", Rename("u=v", "force_N", -1000.0, 2.5)),
        ("T [°C]=temperature_degC", Rename("T [°C]", "temperature_degC")),
    ],
)
def test_names_factor_and_offset(text, expected):
    assert read_rename(text) == expected


@pytest.mark.parametrize("text", ["x", "=force_N", "x=", "x=force N", "x=force_N*", "x=force_N*two", "x=[N]"])
def test_what_is_no_renaming_is_told_how_it_looks(text):
    with pytest.raises(UsageError, match="expected THEIRS=OURS"):
        read_rename(text)


@pytest.mark.parametrize(
    ("theirs", "factor"),
    [("Load [kN]", "1000.0"), ("load_kN", "1000.0"), ("Load (lbf)", "4.4"), ("Load [ell]", "FACTOR")],
)
def test_another_unit_needs_a_factor(theirs, factor):
    with pytest.raises(UsageError, match=r"force_N is in N; expected --rename .*=force_N\*" + factor):
        read_rename(f"{theirs}=force_N")
    assert read_rename(f"{theirs}=force_N*1").factor == 1.0


@pytest.mark.parametrize("theirs", ["Load [N]", "load_N", "Load (left)", "Load", "load_left"])
def test_the_same_unit_or_none_does_not(theirs):
    check_unit(theirs, "force_N")


def test_columns_that_are_not_there_or_taken_are_named():
    columns = {"a": np.ones(3), "b": np.ones(3)}
    with pytest.raises(RecordingError, match=r"f.csv: no column 'c'; it has a, b"):
        renamed("f.csv", columns, [Rename("c", "mach")])
    with pytest.raises(RecordingError, match="'a' cannot become 'b'"):
        renamed("f.csv", columns, [Rename("a", "b")])
    swapped, remarks = renamed("f.csv", columns, [Rename("a", "mach", 2.0, 1.0), Rename("b", "force_n")])
    assert set(swapped) == {"mach", "force_n"}
    assert swapped["mach"].tolist() == [3.0, 3.0, 3.0]
    assert remarks == ["force_n: no channel of the catalogue, kept; did you mean force_N?"]


@pytest.fixture
def rig(tmp_path):
    time_ms = np.arange(50) * 10.0
    table = np.column_stack((time_ms, 5 + time_ms / 1000, time_ms / 500))
    np.savetxt(tmp_path / "rig.csv", table, delimiter=",", header="t [ms],Load [kN],x", comments="")
    return tmp_path / "rig.csv"


def test_convert_takes_a_file_of_other_names_and_units(rig):
    out = rig.with_name("bench.parquet")
    renames = ["t [ms]=time_s*0.001", "Load [kN]=force_N*1000", "x=deformation_mm"]
    assert main(["convert", str(rig), *(word for text in renames for word in ("--rename", text)), "-o", str(out)]) == 0
    record = read_recording(out)
    assert record.sample_hz == pytest.approx(100.0)
    assert record["force_N"] == pytest.approx(5000 + 1000 * record.time_s)
    assert record["deformation_mm"] == pytest.approx(2 * record.time_s)


def test_convert_takes_a_file_without_a_time(rig):
    out = rig.with_name("bench.csv")
    assert main(["convert", str(rig), "--sampled", "20", "--rate", "10", "-o", str(out)]) == 0
    assert read_recording(out).duration_s == pytest.approx(2.4)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--time", "t [ms]"], "time_s is in s"),
        (["--time", "t"], "no column 't'; it has Load [kN], t [ms], x"),
        ([], "no column 'time_s'"),
        (["--sampled", "10", "--rename", "y=mach"], "no column 'y'"),
        (["--sampled", "0"], "--sampled 0: expected above 0"),
        (["--sampled", "10", "--rename", "x"], "expected THEIRS=OURS"),
    ],
)
def test_convert_refuses_in_one_line(rig, capsys, options, words):
    assert main(["convert", str(rig), *options, "-o", str(rig.with_name("out.csv"))]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert words in line
    assert not rig.with_name("out.csv").exists()


def test_a_matlab_structure_gives_its_fields(tmp_path):
    time_s = np.arange(20) * 0.1
    savemat(tmp_path / "rig.mat", {"rig": {"time_s": time_s, "force_N": 2 * time_s}, "force_N": 3 * time_s})
    record = read_recording(tmp_path / "rig.mat")
    assert record["force_N"] == pytest.approx(3 * time_s)
    assert record["rig_force_N"] == pytest.approx(2 * time_s)


@pytest.mark.parametrize(
    ("variables", "words"),
    [
        ({"rig": {"force": {"data": [1.0, 2.0]}}}, "force: structure or cell left out"),
        ({"table": np.ones((4, 3))}, r"table: shape \(4, 3\) of float64 left out"),
    ],
)
def test_a_matlab_file_without_vectors_says_what_it_has(tmp_path, variables, words):
    savemat(tmp_path / "rig.mat", variables)
    with pytest.raises(RecordingError, match=f"rig.mat: no column of numbers: {words}; expected one per channel"):
        read_recording(tmp_path / "rig.mat")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("0,5.1,0.2\n1,5.2,0.2\n", "first line is no header: 0, 5.1, 0.2; expected one line of channel names"),
        ("0;5,1;0,2\n1;5,2;0,2\n", "first line is no header: 0, 5,1, 0,2; expected"),
        ("\ntime_s,force_N\n0,1\n", "first line is no header: nothing in it"),
        ("Rig 4\nOperator,X,2019\ntime_s,force_N\n0,1\n", "not a rectangular CSV.*expected a line of names"),
        ("a,b\nx,y\n", "no column of numbers: a: text column left out; b: text column left out"),
    ],
)
def test_a_table_without_its_line_of_names_is_told(tmp_path, text, words):
    (tmp_path / "rig.csv").write_text(text)
    with pytest.raises(RecordingError, match=words):
        read_recording(tmp_path / "rig.csv")
