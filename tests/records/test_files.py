"""Every file type gives back what was written, and refuses what it cannot use in one line."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from thrustd.core.errors import RecordingError
from thrustd.records.csv_file import read_csv
from thrustd.records.files import READERS, read_recording, write_recording
from thrustd.records.recording import make_recording
from thrustd.records.time_axis import TimeAxis, read_timed

NAMES = ["deformation_mm", "force_N", "accel_x_g", "hydraulic_pressure_bar"]
values = st.floats(allow_nan=True, allow_infinity=False, width=64)


@st.composite
def recordings(draw):
    times = draw(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=20, unique=True))
    names = draw(st.lists(st.sampled_from(NAMES), unique=True))
    columns = {name: draw(st.lists(values, min_size=len(times), max_size=len(times))) for name in names}
    return make_recording("drawn", {"time_s": sorted(times), **columns})


def same(a, b) -> bool:
    """Bit for bit, sign of zero included."""
    return all(
        np.array_equal(a[n], b[n], equal_nan=True) and np.array_equal(np.signbit(a[n]), np.signbit(b[n]))
        for n in ["time_s", *a.channels]
        if not np.isnan(a[n]).any()
    ) and all(np.array_equal(a[n], b[n], equal_nan=True) for n in a.channels)


@pytest.mark.parametrize("extension", list(READERS))
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(record=recordings())
def test_round_trip_is_exact(extension, record):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"a{extension}"
        write_recording(record, path)
        back = read_recording(path)
        assert list(Path(folder).iterdir()) == [path]
    assert list(back.channels) == list(record.channels)
    assert same(record, back)
    assert len(back.sha256) == 64


@pytest.mark.parametrize("extension", [".parquet", ".npz", ".mcap"])
def test_metadata_travels(extension, tmp_path):
    record = make_recording("a", {"time_s": [0.0]}, {"seed": "7"})
    write_recording(record, tmp_path / f"a{extension}")
    assert read_recording(tmp_path / f"a{extension}").metadata == {"seed": "7"}


BAD_CSV = {
    "text in a number": ("time_s,force_N\n0,1\n1,lots\n", "force_N is 'lots' in data row 2; expected a number"),
    "no time": ("force_N\n1\n", "no column 'time_s'"),
    "backwards": ("time_s,force_N\n1,1\n0,1\n", "data row 2 follows 1.0"),
    "twice": ("time_s,force_N,force_N\n1,1,1\n", "'force_N' appears 2 times"),
    "ragged": ("time_s,force_N\n1,1\n2\n", "not a rectangular CSV"),
    "empty": ("", "is empty"),
    "header only": ("time_s,force_N\n", "no samples"),
    "not text": ("\x00\x8f\x1btime_s", "not UTF-8 text"),
    "names that steer a terminal": ("time_s,\x1b[31mred\n0,1\n", "control characters in its first line"),
    "another coding": ("time_s,T_\xb0C\n0,1\n", "not UTF-8 text"),
}


@pytest.mark.parametrize("case", list(BAD_CSV))
def test_bad_csv_is_one_clear_line(case, tmp_path):
    text, message = BAD_CSV[case]
    path = tmp_path / "bad.csv"
    path.write_text(text, encoding="latin-1")
    with pytest.raises(RecordingError) as caught:
        read_recording(path)
    assert message in str(caught.value)
    assert "bad.csv" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("cells", "newtons"),
    [(("1.027", "999"), [1027.0, 999.0]), (("1.027,30", "-1.234.567,5"), [1027.3, -1234567.5])],
)
def test_a_point_beside_decimal_commas_stands_between_thousands(tmp_path, cells, newtons):
    path = tmp_path / "a.csv"
    path.write_text("time_s;force_N\n" + "".join(f"0,{row};{cell}\n" for row, cell in enumerate(cells, 1)))
    assert read_csv(path).columns["force_N"].tolist() == newtons


@pytest.mark.parametrize(
    ("cell", "words"),
    [
        ("0.050", "force_N is '0.050' in data row 2; expected a decimal comma, as elsewhere in the file"),
        ("12.5", "force_N is '12.5' in data row 2; expected a decimal comma, as elsewhere in the file"),
        ("1.02,5", "force_N is '1.02,5' in data row 2; expected a number"),
    ],
)
def test_a_point_anywhere_else_beside_decimal_commas_is_refused_as_it_is_written(tmp_path, cell, words):
    path = tmp_path / "a.csv"
    path.write_text(f"time_s;force_N\n0,1;1,5\n0,2;{cell}\n")
    with pytest.raises(RecordingError) as refused:
        read_csv(path)
    assert words in str(refused.value)


def test_semicolons_alone_leave_a_point_a_decimal_point(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time_s;force_N\n1;1.027\n2;3\n")
    assert read_csv(path).columns["force_N"].tolist() == [1.027, 3.0]


def test_csv_with_semicolons_and_decimal_commas(tmp_path):
    path = tmp_path / "excel.csv"
    path.write_text("time_s;force_N\r\n0,0;1,5\r\n0,1;2,5\r\n", encoding="utf-8-sig")
    assert read_recording(path)["force_N"].tolist() == [1.5, 2.5]


@pytest.mark.parametrize("cells", ["0,1,2", "0, 1, 2"])
def test_csv_names_may_stand_behind_spaces_and_in_quotes(tmp_path, cells):
    path = tmp_path / "a.csv"
    path.write_text(f'time_s, deformation_mm, "force_N"\n{cells}\n')
    assert read_recording(path)["force_N"].tolist() == [2.0]


@pytest.mark.parametrize("name", ['"a\nb"', '"a,b"'])
def test_csv_names_that_hold_a_line_or_a_comma_are_refused(tmp_path, name):
    path = tmp_path / "a.csv"
    path.write_text(f"time_s,force_N,{name}\n0,1,2\n")
    with pytest.raises(RecordingError, match=r"a\.csv: not a rectangular CSV"):
        read_recording(path)


def test_csv_remark_column_is_left_out_and_reported(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time_s,force_N,remark\n0,,calm\n1,2,windy\n")
    record = read_recording(path)
    assert list(record.channels) == ["force_N"]
    assert "remark: text column left out" in record.notes
    assert "force_N: 1 of 2 values missing" in record.notes


@pytest.mark.parametrize("extension", [".parquet", ".npz", ".mat", ".mcap"])
@pytest.mark.parametrize("content", [b"not this type of file at all", b"\x00" * 300])
def test_wrong_content_is_one_clear_line(extension, content, tmp_path):
    path = tmp_path / f"bad{extension}"
    path.write_bytes(content)
    with pytest.raises(RecordingError) as caught:
        read_recording(path)
    assert f"bad{extension}" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("extension", [".parquet", ".npz", ".mcap"])
def test_a_cut_file_is_refused(extension, tmp_path):
    path = tmp_path / f"cut{extension}"
    write_recording(make_recording("a", {"time_s": np.arange(5000.0)}), path)
    path.write_bytes(path.read_bytes()[:-2000])
    with pytest.raises(RecordingError, match="not a readable"):
        read_recording(path)


def test_of_a_cut_recording_what_is_whole_can_be_had(tmp_path):
    path = tmp_path / "cut.mcap"
    write_recording(make_recording("a", {"time_s": np.arange(90000.0), "mach": np.arange(90000.0)}), path)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    record = read_timed(path, TimeAxis(), salvage=True)
    assert np.array_equal(record["mach"], np.arange(float(len(record))))
    assert len(record) > 10000
    assert "cut off" in record.notes[0]


def test_unknown_type_missing_file_and_missing_column(tmp_path):
    with pytest.raises(RecordingError, match=r"type '.xlsx'; expected one of .csv"):
        read_recording(tmp_path / "a.xlsx")
    with pytest.raises(RecordingError, match="cannot be read: No such file"):
        read_recording(tmp_path / "a.csv")
    write_recording(make_recording("a", {"time_s": [0.0], "mach": [0.1]}), tmp_path / "a.csv")
    with pytest.raises(RecordingError, match="no column 'force_N'; it has mach"):
        read_recording(tmp_path / "a.csv")["force_N"]


def test_a_failed_write_leaves_the_old_file(tmp_path):
    path = tmp_path / "a.csv"
    write_recording(make_recording("a", {"time_s": [1.0]}), path)
    before = path.read_bytes()
    with pytest.raises(RecordingError, match="cannot stand in a CSV header"):
        write_recording(make_recording("a", {"time_s": [1.0], "a,b": [1.0]}), path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_write_into_a_missing_folder(tmp_path):
    with pytest.raises(RecordingError, match="cannot be written: No such file"):
        write_recording(make_recording("a", {"time_s": [1.0]}), tmp_path / "none" / "a.npz")


def test_matlab_constants_beside_columns_are_left_out_and_reported(tmp_path):
    savemat(tmp_path / "m.mat", {"time_s": np.arange(9.0), "force_N": np.ones(9), "fs": 10.0})
    loaded = read_recording(tmp_path / "m.mat")
    assert "fs" not in loaded.channels
    assert any("fs" in note for note in loaded.notes)


def test_matlab_flightdata_structure(tmp_path):
    field = lambda data, units: {"data": np.asarray(data), "units": units}  # noqa: E731
    flight = {
        "time": field([9.0, 9.1], "s"),
        "Dadc1_mach": field([0.2, 0.3], "-"),
        "Dadc1_alt": field([1000.0, 2000.0], "ft"),
        "delta_e": field([1.0, 2.0], "deg"),
    }
    savemat(tmp_path / "flight.mat", {"flightdata": flight})
    record = read_recording(tmp_path / "flight.mat")
    assert record["pressure_altitude_m"] == pytest.approx([304.8, 609.6])
    assert "delta_e_deg" in record
