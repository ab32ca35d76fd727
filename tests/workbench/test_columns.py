"""Prepared columns and the binary windows the page draws."""

import json
import struct

import numpy as np
import pytest

from thrustd.records.files import read_recording, write_recording
from thrustd.records.marks import Mark, read_marks, without_excluded, write_marks
from thrustd.records.recording import make_recording
from thrustd.workbench.columns import forget_old, open_columns, write_columns
from thrustd.workbench.exporting import window_csv
from thrustd.workbench.lines import MAX_BYTES, Line, window


def record(n=50_000, gap=False):
    time_s = np.arange(n) / 100.0
    if gap:
        time_s[n // 2 :] += 30.0
    rng = np.random.default_rng(1)
    return make_recording(
        "r", {"time_s": time_s, **{f"force_N_{i}": rng.standard_normal(n) for i in range(11)}, "force_N": time_s}
    )


def unpack(content):
    length = struct.unpack_from("<I", content)[0]
    head = json.loads(content[4 : 4 + length])
    times = np.frombuffer(content, "<f8", head["count"], 4 + length)
    rest = np.frombuffer(content, "<f4", offset=4 + length + times.nbytes)
    return head, times, rest.reshape(-1, head["count"])


def lines_of(folder, rec):
    write_columns(folder, rec)
    columns = open_columns(folder)
    return [Line(c.name, columns, c.name) for c in columns.meta.channels]


def test_columns_come_back_with_their_meaning(tmp_path):
    rec = record(3000)
    write_columns(tmp_path / "c", rec)
    columns = open_columns(tmp_path / "c")
    assert np.array_equal(columns.column("force_N"), rec["force_N"])
    meta = next(c for c in columns.meta.channels if c.name == "force_N")
    assert meta.unit == "N" and "forward thrust +" in meta.meaning
    assert meta.high == pytest.approx(29.99, rel=1e-6)
    assert list(tmp_path.iterdir()) == [tmp_path / "c"]


@pytest.mark.parametrize("count", [1, 4, 12])
@pytest.mark.parametrize("buckets", [200, 5000])
def test_answers_are_small_and_aligned(tmp_path, count, buckets):
    lines = lines_of(tmp_path / "c", record())[-count:]
    for start_s, stop_s in ((0, 500), (100, 103), (499, 10_000)):
        content = window(lines, start_s, stop_s, buckets)
        assert len(content) < MAX_BYTES <= 100_000
        head, times, values = unpack(content)
        assert head["channels"] == [line.label for line in lines]
        assert len(values) == count * (1 if head["raw"] else 2)
        assert (np.diff(times) > 0).all()


def test_a_gap_breaks_the_line(tmp_path):
    lines = lines_of(tmp_path / "c", record(gap=True))[:1]
    head, times, _ = unpack(window(lines, 0, 1000, 500))
    assert len(head["breaks"]) == 1
    assert times[head["breaks"][0] + 1] - times[head["breaks"][0]] > 29


def test_window_csv_is_exact(tmp_path):
    rec = record(1000)
    lines = lines_of(tmp_path / "c", rec)
    text = b"".join(window_csv(lines[:2], 1.0, 2.0)).decode().splitlines()
    assert text[0] == "time_s,force_N_0,force_N_1"
    assert len(text) == 1 + 101
    assert float(text[1].split(",")[1]) == rec["force_N_0"][100]


def test_old_columns_are_forgotten(tmp_path):
    for name in ("a", "b"):
        write_columns(tmp_path / "columns" / name, record(1000))
    forget_old(tmp_path, keep_bytes=10)
    assert not list((tmp_path / "columns").iterdir())


def test_excluded_marks_take_the_reference_away(tmp_path):
    path = tmp_path / "r.csv"
    write_recording(record(1000), path)
    write_marks(path, (Mark(1.0, 2.0, "bump", True), Mark(3.0, 4.0, "look here", False)))
    assert read_marks(path)[0].label == "bump"
    force_n = without_excluded(read_recording(path), read_marks(path))["force_N"]
    assert np.isnan(force_n[100:201]).all() and np.isfinite(force_n[201:]).all()
    write_marks(path, ())
    assert [p.name for p in tmp_path.iterdir()] == ["r.csv"]
