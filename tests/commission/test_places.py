"""Whose bench a record is, and in what unit: by the aircraft's file, before minutes of work."""

import numpy as np
import pytest

from tests.installation.test_geometry import changed
from thrustd.__main__ import main
from thrustd.commission.places import check_places, check_units, misnamed
from thrustd.core.errors import RecordingError
from thrustd.installation.installation import read_installation
from thrustd.installation.shipped import shipped
from thrustd.records.files import write_recording
from thrustd.records.recording import make_recording

ROWS = 4000
NAMES = "left_upper", "left_lower", "right_upper", "right_lower"


@pytest.fixture(scope="module")
def hil():
    return read_installation(shipped("deploy/hil.toml", "config"))


@pytest.mark.parametrize(
    ("scale", "words"),
    [
        ({"deformation_mm": 1e3}, "deformation_mm in um"),
        ({"force_N": 1 / 4.4482}, "force_N in lbf"),
        ({"deformation_mm": 1e-3}, "deformation_mm in m?"),
        ({"force_N": 1e3}, "expected about 5079"),
        ({"force_N": 40.0}, "another mount?"),
    ],
)
def test_another_unit_is_refused_before_a_mount_is_identified(scale, words, tmp_path, capsys, monkeypatch):
    def never(*_):
        raise AssertionError("a minute of work before a mistake is told that shows in seconds")

    monkeypatch.setattr("thrustd.commission.commission.mount_models", never)
    mm = np.abs(np.sin(0.005 * np.arange(ROWS)))
    columns = {"deformation_mm": mm, "force_N": 5500.0 * mm}
    for name, factors in (("good", {}), ("off", scale)):
        table = {column: factors.get(column, 1.0) * values for column, values in columns.items()}
        write_recording(make_recording(name, {"time_s": 0.1 * np.arange(ROWS), **table}), tmp_path / f"{name}.csv")
    given = [f"upper={tmp_path / 'off.csv'}", f"lower={tmp_path / 'good.csv'}"]
    assert main(["commission", "--bench", *given, "-o", str(tmp_path / "aircraft")]) == 2
    (line,) = (line for line in capsys.readouterr().err.splitlines() if not line.startswith("read"))
    assert line.startswith("thrustd: --bench left_upper: ") and words in line
    assert not (tmp_path / "aircraft").exists()


def test_a_weight_record_in_m_s2_is_refused_before_a_mount_is_identified(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("thrustd.commission.commission.mount_models", lambda *_: {})
    mm = np.abs(np.sin(0.005 * np.arange(ROWS)))
    columns = {"time_s": 0.1 * np.arange(ROWS), "deformation_mm": mm, "force_N": 5500.0 * mm}
    write_recording(make_recording("bench", columns), tmp_path / "bench.csv")
    write_recording(make_recording("w", {**columns, "accel_z_g": 9.80665 * (1.0 + mm)}), tmp_path / "w.csv")
    given = [f"{place}={tmp_path / 'bench.csv'}" for place in ("upper", "lower")]
    more = ["--weight", str(tmp_path / "w.csv"), "-o", str(tmp_path / "aircraft")]
    assert main(["commission", "--bench", *given, *more]) == 2
    said = capsys.readouterr().err
    assert "w.csv: accel_z_g reaches 19.6" in said and "--trust-units" not in said  # which is no option here


def test_rubber_that_shakes_is_no_other_unit(hil):
    """A raw record may be stiffer or softer than a file of static rates."""
    for times in (0.5, 1.0, 2.0):
        check_units({name: [5500.0 * times] for name in NAMES}, hil)


def stiff(monkeypatch, *n_mm):
    found = iter(n_mm)
    monkeypatch.setattr("thrustd.commission.places.secant_n_mm", lambda *_: next(found))


@pytest.mark.parametrize("upper_lower", [(5323.0, 4793.0), (6176.0, 5460.0), (7000.0, 5000.0)])
def test_swapped_benches_are_told_however_far_they_are_apart(hil, monkeypatch, upper_lower):
    stiff(monkeypatch, *upper_lower)
    with pytest.raises(RecordingError, match="each other's"):
        check_places({one.name: hil.bench_model(one) for one in hil.config.mount}, hil)


@pytest.mark.parametrize(
    ("upper_lower", "told"),
    [
        ((5079.0, 5954.0), True), ((4793.0, 5323.0), True), ((5079.0, 6500.0), True), ((5300.0, 5600.0), False)
    ],
)  # fmt: skip
def test_benches_that_nothing_tells_apart_are_said_not_refused(hil, monkeypatch, upper_lower, told):
    stiff(monkeypatch, *upper_lower, 5079.0, 5954.0)
    untold = check_places({one.name: hil.bench_model(one) for one in hil.config.mount}, hil)
    assert list(untold) == ([] if told else ["left_upper"])
    assert told or "nothing on hand tells its bench from that of left_lower" in untold["left_upper"]


def test_mounts_alike_by_the_file_are_no_two_of_one_place(monkeypatch):
    rows = ("spring_n_mm = [5079.0, 5954.0]", "spring_n_mm = [5500.0, 5600.0]"), ("5079.0, 1646", "5500.0, 1646")
    alike = changed(*rows, ("5954.0, 1926", "5600.0, 1926"))
    stiff(monkeypatch, 5700.0, 5500.0, 5500.0, 5600.0)
    assert list(check_places({one.name: alike.bench_model(one) for one in alike.config.mount}, alike)) == [
        "left_upper", "right_upper"
    ]  # fmt: skip


def test_a_file_named_after_another_mount_is_said():
    both = {"left_upper": ["b_left_lower.parquet"], "left_lower": ["b_left_upper.parquet"]}
    assert list(misnamed(both)) == ["left_upper", "left_lower"]
    own = {"left_upper": ["left-upper 2.csv", "b1.csv"], "left_lower": ["lower.csv"], "right_upper": ["b1.csv"]}
    assert misnamed(own) == {}
    assert misnamed({"left_upper": ["left_upper.csv"], "right_upper": ["left_upper.csv"]}) == {}
