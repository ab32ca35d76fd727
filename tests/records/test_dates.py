"""Dates and times of day in time_s are seconds since the first."""

import datetime as dt

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

from thrustd.core.errors import RecordingError
from thrustd.records.files import read_recording
from thrustd.records.time_axis import TimeAxis, read_timed

START = dt.datetime(2026, 3, 1, 23, 59, 59)
STAMPS = [START + dt.timedelta(seconds=0.05 * row) for row in range(100)]
WRITTEN = {
    "date": [stamp.isoformat() for stamp in STAMPS],
    "date with a space": [stamp.isoformat(" ") for stamp in STAMPS],
    "date and zone": [stamp.isoformat() + "+01:00" for stamp in STAMPS],
    "universal time": [stamp.isoformat() + "Z" for stamp in STAMPS],
    "time of day, past midnight": [stamp.time().isoformat() for stamp in STAMPS],
}
KINDS = {
    "timestamp[us]": STAMPS,
    "time64[us]": [stamp.time() for stamp in STAMPS],
    "duration[us]": [stamp - START for stamp in STAMPS],
}


@pytest.mark.parametrize("written", WRITTEN)
def test_of_a_csv(written, tmp_path):
    path = tmp_path / "rig.csv"
    path.write_text("time_s,force_N\n" + "".join(f"{cell},1.5\n" for cell in WRITTEN[written]))
    record = read_recording(path)
    assert record.time_s == pytest.approx(np.arange(100) * 0.05, abs=1e-9)
    assert record.notes == (f"time_s: seconds since {WRITTEN[written][0]}",)


@pytest.mark.parametrize("kind", KINDS)
def test_of_a_parquet_file(kind, tmp_path):
    parquet.write_table(pa.table({"time_s": KINDS[kind], "force_N": np.ones(100)}), tmp_path / "rig.parquet")
    assert read_recording(tmp_path / "rig.parquet").time_s == pytest.approx(np.arange(100) * 0.05, abs=1e-9)


def test_a_date_that_may_be_a_month_is_refused_with_what_is_read(tmp_path):
    (tmp_path / "rig.csv").write_text("time_s,force_N\n01.03.2026 10:00:00,1\n01.03.2026 10:00:01,2\n")
    with pytest.raises(
        RecordingError, match=r"time_s is '01.03.2026 10:00:00' in data row 1; expected seconds, or times"
    ):
        read_recording(tmp_path / "rig.csv")


def test_dates_that_go_back_are_no_midnight(tmp_path):
    (tmp_path / "rig.csv").write_text("time_s,force_N\n2026-03-01T23:00:00,1\n2026-03-01T01:00:00,2\n")
    with pytest.raises(RecordingError, match="expected strictly rising times"):
        read_recording(tmp_path / "rig.csv")


@pytest.mark.parametrize("extension", [".csv", ".parquet"])
def test_times_of_another_name_are_told_how_to_get_in(extension, tmp_path):
    path = tmp_path / f"rig{extension}"
    if extension == ".csv":
        path.write_text("stamp,force_N\n" + "".join(f"{stamp.isoformat()},1.5\n" for stamp in STAMPS))
    else:
        parquet.write_table(pa.table({"stamp": STAMPS, "force_N": np.ones(100)}), path)
    with pytest.raises(
        RecordingError, match=r"stamp: .* left out \(times are read where the column is called time_s\)"
    ):
        read_timed(path, TimeAxis("stamp"))
