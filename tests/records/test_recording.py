"""The columnar recording: what it accepts, refuses, reports, and how it resamples."""

import numpy as np
import pytest

from thrustd.core.errors import RecordingError
from thrustd.records.recording import make_recording, signal_of, unit_of


def ramp(rate_hz: float = 10.0, seconds: float = 10.0):
    time_s = np.arange(round(rate_hz * seconds)) / rate_hz
    return make_recording("ramp", {"time_s": time_s, "force_N": 3 * time_s, "bleed_valve_pct": time_s * 0})


def test_unknown_columns_are_kept():
    assert "bleed_valve_pct" in ramp()


def test_no_time_column_is_named():
    with pytest.raises(RecordingError, match=r"no column 'time_s'.*force_N"):
        make_recording("a.csv", {"force_N": [1.0]})


def test_time_running_backwards_names_the_row():
    with pytest.raises(RecordingError, match=r"a.csv: time_s = 1.0 in data row 4 follows 2.0"):
        make_recording("a.csv", {"time_s": [0.0, 1.0, 2.0, 1.0]})


def test_time_that_is_not_a_number_names_the_row():
    with pytest.raises(RecordingError, match="data row 2"):
        make_recording("a.csv", {"time_s": [0.0, np.nan, 2.0]})


def test_empty_recording_is_refused():
    with pytest.raises(RecordingError, match="no samples"):
        make_recording("a.csv", {"time_s": []})


def test_uneven_columns_are_refused():
    with pytest.raises(RecordingError, match=r"force_N has shape \(2,\); expected \(3,\)"):
        make_recording("a.csv", {"time_s": [0.0, 1.0, 2.0], "force_N": [1.0, 2.0]})


def test_missing_and_infinite_values_are_reported():
    record = make_recording("a.csv", {"time_s": [0.0, 1.0, 2.0], "force_N": [1.0, np.nan, np.inf]})
    assert np.isnan(record["force_N"][1:]).all()
    assert record.notes == ("force_N: 2 of 3 values missing",)
    many = {f"x{i}_N": [1.0, np.nan, 3.0] for i in range(20)} | {"y_N": [np.nan, np.nan, 3.0]}
    notes = make_recording("a log", {"time_s": [0, 1, 2], **many}).notes
    assert notes == ("21 channels with values missing; most: y_N, 2 of 3",)


def test_gaps_split_and_are_reported():
    record = make_recording("a.csv", {"time_s": [0.0, 0.1, 0.2, 5.0, 5.1]})
    assert record.segments() == [slice(0, 3), slice(3, 5)]
    assert record.notes == ("1 gap in time_s longer than 1.5 steps",)


def test_missing_column_says_what_there_is():
    with pytest.raises(RecordingError, match="no column 'mach'; it has bleed_valve_pct, force_N"):
        ramp()["mach"]


def test_window_and_select():
    part = ramp().window(2.0, 3.0).select(["force_N"])
    assert len(part) == 10
    assert list(part.channels) == ["force_N"]
    with pytest.raises(RecordingError, match=r"covers 0 to 9\.9 s"):
        ramp().window(20.0, 30.0)


@pytest.mark.parametrize("rate_hz", [2.0, 5.0, 10.0, 100.0])
def test_resampling_keeps_a_straight_line(rate_hz):
    record = ramp().resample(rate_hz)
    inner = slice(1, -2)  # bins at the ends are cut in half
    assert record.sample_hz == pytest.approx(rate_hz)
    half_bin_s = 0.05 if rate_hz < 10 else 0.0
    assert record["force_N"][inner] == pytest.approx(3 * record.time_s[inner], abs=3 * half_bin_s + 1e-9)


def test_resampling_leaves_missing_values_out():
    time_s = np.arange(100) / 10
    values = np.where(np.arange(100) % 7 == 0, np.nan, 2.0)
    record = make_recording("a", {"time_s": time_s, "force_N": values}).resample(2.0)
    assert record["force_N"] == pytest.approx(2.0)


@pytest.mark.parametrize("rate_hz", [1.0, 10.0, 30.0])
def test_resampling_invents_nothing_where_nothing_was_measured(rate_hz):
    time_s = np.arange(6000) / 10
    hole = (time_s > 100) & (time_s < 300)
    columns = {
        "mach": np.where(hole | (time_s < 20), np.nan, 0.4),
        "temperature_degC": np.where(np.arange(6000) % 20 == 0, 30.0, np.nan),  # a reading every 2 s
        "force_N": time_s,
    }
    whole = make_recording("a", {"time_s": time_s, **columns}).resample(rate_hz)
    for begin_s, end_s, there in ((0, 19, False), (21, 99, True), (102, 298, False), (302, 590, True)):
        assert np.isfinite(whole.window(begin_s, end_s)["mach"]).all() == there
        assert np.isfinite(whole.window(begin_s, end_s)["mach"]).any() == there
    assert np.isfinite(whole.window(0, 597)["temperature_degC"]).all()
    cut = make_recording("a", {"time_s": time_s[~hole], "force_N": time_s[~hole]})
    assert np.isnan(cut.resample(rate_hz).window(102, 298)["force_N"]).all()
    assert cut.resample(rate_hz, np.inf).window(102, 298)["force_N"] == pytest.approx(np.arange(102, 298, 1 / rate_hz))


@pytest.mark.parametrize(("trembles", "rate_hz"), [(0.0, 10.0), (0.0, 3.0), (0.0, 25.0), (0.01, 10.0), (0.03, 9.0)])
def test_a_grid_knows_how_much_of_the_noise_its_steps_show(trembles, rate_hz):
    rng = np.random.default_rng(3)
    time_s = np.sort(
        np.arange(200_000) / 10.0 + rng.normal(0.0, trembles, 200_000) if trembles else np.arange(200_000) / 10.0
    )
    there = rng.random(200_000) > 0.02
    data = {"time_s": time_s[there], "force_N": rng.normal(0.0, 1.0, 200_000)[there]}
    even = make_recording("a", data).resample(rate_hz, np.inf, 0.02)
    shows = np.mean(np.diff(even["force_N"]) ** 2) / 2.0 / np.var(even["force_N"])
    assert even.step_share == pytest.approx(shows, rel=0.02)
    assert even.with_channels(mach=even.time_s).rows(slice(100)).step_share == even.step_share
    assert even.resample(rate_hz).step_share == pytest.approx(even.step_share)  # its own rows once more


def test_resampling_refuses_a_rate_of_zero():
    with pytest.raises(RecordingError, match="expected > 0"):
        ramp().resample(0.0)


def test_units_come_from_the_catalogue_or_the_name():
    assert unit_of("n1_pct_left") == "%"
    assert unit_of("deformation_mm_left_upper") == "mm"
    assert unit_of("hydraulic_pressure_bar") == "bar"
    assert unit_of("remark") == ""
    assert signal_of("mach_number") is None


@pytest.mark.parametrize(("seconds", "told"), [(0.05, "50.0 s, 20 Hz"), (50.0, "13.89 h, 0.02 Hz")])
def test_how_long_a_recording_is_and_at_what_rate_is_told(seconds, told):
    assert make_recording("rig.csv", {"time_s": np.arange(1001) * seconds}).extent == f"rig.csv: 1001 samples, {told}"
