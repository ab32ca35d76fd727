"""By when to calibrate again: zeros that walk are named with a date, zeros that stay are left alone."""

from datetime import date, timedelta

import msgspec
import numpy as np
import pytest

from thrustd.__main__ import main
from thrustd.commission.recalibrate import recalibrate_by, walks
from thrustd.commission.tether_file import with_tether
from thrustd.commission.tether_told import Line, TetherFit
from thrustd.commission.zero import MountZero, with_zeros
from thrustd.core.calibration import Calibration, MountCalibration, Zero, read_calibration, write_calibration
from thrustd.core.errors import ConfigError
from thrustd.installation.shipped import shipped

FIRST = date(2026, 1, 1)
STD_MM = 0.0015


def looked(days, mm, std_mm=STD_MM):
    looks = [
        Zero(on=str(FIRST + timedelta(days=day)), mm=each, std_mm=std_mm) for day, each in zip(days, mm, strict=True)
    ]
    return Calibration(on=looks[-1].on, mount={"left_upper": MountCalibration(zeros=tuple(looks))})


def test_one_that_walks_is_named_with_its_rate_and_the_day_when_it_has_walked_ten_micrometres():
    days = range(0, 43, 7)
    (walk,) = walks(looked(days, [0.001 * day for day in days]))
    assert walk.mount == "left_upper" and walk.mm_day == pytest.approx(0.001)
    assert 0.0 < walk.half_mm_day < 0.0003
    assert 7 <= (walk.by - FIRST).days - 42 <= 10  # the worse end of the interval
    assert recalibrate_by(looked(days, [0.001 * day for day in days])) == str(walk.by)


def test_the_last_look_is_the_day_where_it_has_left_what_is_a_zero():
    (walk,) = walks(looked((0, 7, 14, 21), (-0.02, -0.03, -0.04, -0.05)))
    assert (walk.by - FIRST).days == 21


@pytest.mark.parametrize(("days", "mm"), [((0, 7), (0.0, 0.02)), ((0, 0, 0), (0.0, 0.01, 0.02)),
                                          ((0, 7, 14, 21), (0.0, 0.002, -0.001, 0.001))])  # fmt: skip
def test_two_looks_one_day_and_a_zero_that_stays_say_nothing(days, mm):
    assert recalibrate_by(looked(days, mm)) is None


@pytest.mark.parametrize(("scatter", "most"), [(1.0, 0.04), (2.0, 0.2)])
def test_zeros_that_stay_are_seldom_said_to_walk_however_often_one_looks(scatter, most):
    """Four mounts, twenty weekly looks, a date asked for at each; their sigma right, or too small by two."""
    rng, ever = np.random.default_rng(1), 0
    for _ in range(100):
        series = scatter * STD_MM * rng.standard_normal((4, 20))
        ever += any(recalibrate_by(looked(range(0, 7 * n, 7), mm[:n].tolist())) for mm in series for n in range(3, 21))
    assert ever <= most * 100


def test_after_a_tethered_run_what_is_seen_at_rest_still_walks():
    """The zero that is flown is hardly moved by looks at rest; the trend is that of the looks."""
    mount = MountCalibration(zeros=(Zero(on="2026-01-01", mm=0.007, std_mm=0.001),), gain_std=0.003)
    calibration = Calibration(on="2026-01-01", tethered="2026-01-01", mount={"left_upper": mount})
    for week in range(7):
        found = [MountZero("left_upper", 0.012 + 0.004 * week, STD_MM, 0.0)]
        calibration = with_zeros(calibration, found, str(FIRST + timedelta(days=7 * week)))
    kept = calibration.of("left_upper").zeros
    assert kept[-1].mm < 0.009 and kept[-1].at_rest_mm == pytest.approx(0.036)
    assert read_calibration(write_calibration(calibration), "c") == calibration
    (walk,) = walks(calibration)
    assert walk.again == "tethered run" and str(walk.by) == calibration.on  # it has walked 24 um, none was taken off


def test_an_older_log_that_is_looked_at_later_is_no_newer_zero():
    calibration = looked((0, 7, 14), (0.0, 0.001, 0.0))
    after = with_zeros(calibration, [MountZero("left_upper", 0.004, STD_MM, 0.0)], "2025-12-24")
    looks = after.of("left_upper").zeros
    assert [look.on for look in looks] == sorted(look.on for look in looks) and looks[0].on == "2025-12-24"
    assert after.on == calibration.on and after.of("left_upper").zero_mm == 0.0
    with pytest.raises(ConfigError, match="expected the oldest first"):
        read_calibration(write_calibration(turned(after)), "c")


@pytest.mark.parametrize("day", ["2026-02-29", "2026-13-01", "2026-04-31", "0000-01-01"])
def test_a_day_that_no_calendar_has_is_one_line(day):
    text = write_calibration(looked((0, 7, 14), (0.0, 0.001, 0.0)))
    leap = text.replace(str(FIRST), "2024-02-29")
    assert read_calibration(leap, "c").of("left_upper").zeros[0].on == "2024-02-29"
    with pytest.raises(ConfigError, match=r"^c: .*zeros\[0\]\.on"):
        read_calibration(text.replace(str(FIRST), day), "c")


def turned(calibration):
    mount = calibration.of("left_upper")
    mount = msgspec.structs.replace(mount, zeros=mount.zeros[::-1])
    return msgspec.structs.replace(calibration, mount={"left_upper": mount})


def test_a_tethered_run_keeps_what_was_seen_that_day_and_the_date_goes_on_from_it():
    days = (0, 7, 14, 21)
    walked = looked(days, [0.001 * day for day in days])
    walked = msgspec.structs.replace(walked, recalibrate_by=recalibrate_by(walked))
    line = Line(expansion_mm_k=0.0, expansion_std_mm_k=1e-4, reference_degc=20.0, bow_mm=0.0, range_mm=1.5)
    fit = TetherFit(gains={"left_upper": (1.0, 0.003)}, engine_stds={"left": 0.002},
                    zeros_mm={"left_upper": (-0.004, 0.001)}, frictions={"left_upper": 1.0}, beyond={},
                    lines={"left_upper": line}, numbers=[], before_n=0.0,
                    after_n=0.0, lag_s=0.0, bands_n=[], remarks=[])  # fmt: skip
    after = with_tether(walked, fit, walked.on, "cell")
    last = after.of("left_upper").zeros[-1]
    assert last.mm == pytest.approx(0.017) and last.at_rest_mm == pytest.approx(0.021)
    assert after.recalibrate_by == walked.recalibrate_by


@pytest.fixture
def its_folder(tmp_path):
    """With a configuration that names a calibration file."""
    folder = shipped("deploy/hil.toml", "config").parent
    text = (folder / "hil.toml").read_text().replace("../models", str(folder.parent / "models"))
    (tmp_path / "hil.toml").write_text('calibration = "c.toml"\n' + text)
    for name in ("citation-ii.toml", "canaerospace.dbc"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    return tmp_path


@pytest.mark.parametrize(("gain", "warned"), [(1.7, True), (0.84, True), (1.149, False), (1.0, False)])
def test_check_warns_of_a_gain_that_no_tethered_run_is_believed_to_say(its_folder, capsys, gain, warned):
    """1.7 flew without a word."""
    (its_folder / "c.toml").write_text(f'on = "2026-01-01"\n[mount.left_upper]\ngain = {gain}\n')
    assert main(["check", str(its_folder / "hil.toml")]) == 0
    words = (
        f"warning: c.toml: gain of left_upper {gain:.3f}, expected 0.85 to 1.15, which `calibrate tether` would refuse"
    )
    assert (words in capsys.readouterr().out) == warned


def test_check_warns_when_the_day_is_over(its_folder, capsys):
    for by, warned in (("2026-01-31", True), ("2999-01-01", False)):
        (its_folder / "c.toml").write_text(f'on = "2026-01-01"\nrecalibrate_by = "{by}"\n')
        assert main(["check", str(its_folder / "hil.toml")]) == 0
        assert (f"warning: c.toml: recalibrate by {by}, and it is " in capsys.readouterr().out) == warned
