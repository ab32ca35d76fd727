"""Bad input is refused in one clear line."""

import re

import numpy as np
import pytest

from tests.diagnose.scene import inertia, mount, record
from thrustd.core.aircraft import MountPlace
from thrustd.core.errors import ModelError, RecordingError, ThrustdError
from thrustd.diagnose.compare.checks import check_channels, check_recording
from thrustd.diagnose.compare.compare import compare
from thrustd.diagnose.compare.reference import as_mount, with_reference
from thrustd.diagnose.extend.extend import extend
from thrustd.diagnose.search.candidates import judgeable
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.model.effects import effect_named
from thrustd.records.rename import read_rename
from thrustd.records.time_axis import TimeAxis, read_timed

BASE = record(n=6000)


def scaled(channel, factor, offset=0.0):
    return BASE.with_channels(**{channel: BASE[channel] * factor + offset})


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (BASE.select([c for c in BASE.channels if c != "force_N"]), "no reference"),
        (scaled("accel_z_g", 9.80665), "accel_z_g .* that is m/s2, expected g"),
        (scaled("accel_x_g", 9.80665 * 12), "accel_x_g .* that is m/s2, expected g"),
        (scaled("deformation_mm", 1e-3), "deformation_mm .* that is metres, expected mm"),
        (scaled("deformation_mm", 1e3), "deformation_mm .* that is micrometres, expected mm"),
        (scaled("force_N", 1e-3), "force_N .* that is kN, expected N"),
        (scaled("temperature_degC", 1.0, 273.15), "temperature_degC .* that is kelvin, expected degC"),
        (scaled("deformation_mm", 0.0, 0.5), "deformation_mm never moves"),
        (scaled("force_N", 0.0, 3000.0), "force_N never moves; expected the force of a changing load"),
        (scaled("deformation_mm", np.nan), "deformation_mm has no value at all; expected numbers"),
        (scaled("force_N", np.nan), "force_N has no value at all; expected numbers"),
        (scaled("deformation_mm", -1.0).with_channels(force_N=-BASE["force_N"]), "other sign .*: both signs turned?"),
        (scaled("force_N", 1 / 4.4482), r"force_N is 0\.22. times what the model says: is force_N in lbf\?"),
        (scaled("force_N", 1 / 9.80665), "is force_N in daN or force_N in kgf|is force_N in kgf"),
        (BASE.rows(slice(0, 100)), "5.0 s long, expected at least"),
        (BASE.rows(slice(0, 1000)), "slowest time constant, 60 s"),
    ],
)
def test_a_bad_record_is_refused_in_one_line(data, words):
    with pytest.raises(RecordingError, match=words) as raised:
        diagnose(mount(), [data])
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("channel", ["accel_x_g", "accel_y_g", "accel_z_g", "temperature_degC"])
def test_a_channel_without_a_value_is_in_no_wrong_unit(channel):
    """Without a warning of numpy, which is an error here."""
    check_recording(BASE.with_channels(**{channel: np.full(len(BASE), np.nan)}), mount())


def test_a_column_that_was_converted_while_it_was_read_is_in_the_unit_of_its_name(tmp_path):
    """A shaker of 12 g; the axis was recorded in m/s2 and --rename says so. Nothing is guessed at again, here."""
    shaken = scaled("accel_x_g", 9.80665 * 12).with_channels(temperature_degC=BASE["temperature_degC"] + 273.15)
    columns = {name.replace("accel_x_g", "shaker"): column for name, column in shaken.channels.items()}
    np.savez(tmp_path / "rig.npz", time_s=shaken.time_s, **columns)
    converted = read_timed(tmp_path / "rig.npz", TimeAxis(), [read_rename("shaker=accel_x_g*1.0+0.001")])
    with pytest.raises(RecordingError, match="that is kelvin"):
        check_recording(converted, mount())
    check_recording(converted.with_channels(temperature_degC=BASE["temperature_degC"]), mount())


def test_an_effect_already_present_is_refused():
    with pytest.raises(ModelError, match="axial_inertia' is already in the model"):
        extend(mount(effects=[inertia(100.0)]), [BASE], ["axial_inertia"])


def test_a_constant_channel_is_refused():
    with pytest.raises(RecordingError, match="vibration_mm_s is constant"):
        extend(mount(), [BASE], ["vibration_rectification"])


def test_two_rooms_that_are_each_at_one_temperature_move_it():
    rooms = [BASE.with_channels(temperature_degC=np.full(len(BASE), degc)) for degc in (10.0, 50.0)]
    thermal = effect_named("thermal_stiffness")
    check_channels(rooms, thermal)
    assert judgeable([thermal], rooms, ())[0] == [thermal]
    with pytest.raises(RecordingError, match="temperature_degC is constant"):
        check_channels(rooms[:1], thermal)


def test_a_missing_channel_is_refused():
    data = BASE.select([c for c in BASE.channels if c != "accel_x_g"])
    with pytest.raises(RecordingError, match="no column 'accel_x_g', which effect axial_inertia reads"):
        extend(mount(), [data], ["axial_inertia"])


@pytest.mark.parametrize("name", ["no_such_effect", "__import__('os').system('true')", "k * mach.real"])
def test_an_effect_that_cannot_be_is_refused(name):
    with pytest.raises(ThrustdError) as raised:
        extend(mount(), [BASE], [name])
    assert "expected" in str(raised.value) and "\n" not in str(raised.value)


def test_a_model_that_would_be_worse_is_not_written():
    noise = record(n=6000, seed=5)
    rng = np.random.default_rng(0)
    blind = noise.with_channels(vibration_mm_s=np.abs(rng.normal(0, 1, len(noise))))
    with pytest.raises(ModelError, match=r"payne not added: .* no model written"):
        extend(mount(), [blind], ["payne"])


PLACE = MountPlace("left_upper", "left", 0, 0.46)


def test_a_mount_and_the_thrust_of_its_engine_are_found_in_a_flight():
    flight = BASE.with_channels(
        deformation_mm_left_upper=BASE["deformation_mm"],
        thrust_N_left=BASE["force_N"] / PLACE.share,
        n1_pct_left=BASE["accel_z_g"],
    )
    flight = flight.select([c for c in flight.channels if c not in ("deformation_mm", "force_N")])
    seen = with_reference(as_mount(flight, PLACE), place=PLACE)
    assert np.allclose(seen["force_N"], BASE["force_N"])
    assert np.array_equal(seen["n1_pct"], BASE["accel_z_g"])
    with pytest.raises(RecordingError, match="no mount 'right_upper', it has left_upper"):
        as_mount(flight, PLACE._replace(mount="right_upper", engine="right"))
    with pytest.raises(RecordingError, match="brochure"):
        compare({"mount": mount()}, [flight], mount=PLACE, against="brochure")


@pytest.mark.parametrize("value", [-999.0, 65535.0])
def test_a_value_that_a_logger_writes_for_nothing_is_said_with_its_time(value):
    x = BASE["deformation_mm"].copy()
    x[900:905] = value
    data = BASE.with_channels(deformation_mm=x)
    line = f"deformation_mm is {value:.4g} mm at 45.0 s, one of 5 (of 6000)"
    assert any(line in remark for remark in compare({"mount": mount()}, [data]).remarks)
    with pytest.raises(RecordingError, match=re.escape(line) + ".*expected such samples empty or excluded"):
        diagnose(mount(), [data])


def test_a_spike_that_a_motion_may_reach_is_no_such_value():
    x = BASE["deformation_mm"].copy()
    x[900:905] = 12.0
    assert not any(
        "samples empty" in line for line in compare({"mount": mount()}, [BASE.with_channels(deformation_mm=x)]).remarks
    )
