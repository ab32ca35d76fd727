"""What a record cannot tell is said before anybody asks it."""

import numpy as np
import pytest

from tests.diagnose.scene import mount, record
from thrustd.core.errors import RecordingError
from thrustd.diagnose.compare.checks import check_recording
from thrustd.diagnose.compare.compare import compare
from thrustd.diagnose.compare.first_look import first_look
from thrustd.records.recording import make_recording
from thrustd.records.roles import with_trusted_units

DT_S = 0.05


def of(x, **columns):
    x = np.asarray(x, dtype=float)
    time_s = np.arange(len(x)) * DT_S
    rate = np.gradient(x, DT_S)
    return make_recording("rig", {"time_s": time_s, "deformation_mm": x, "force_N": 5000 * x + 20 * rate, **columns})


T = np.arange(4000) * DT_S
ANY = np.random.default_rng(0).normal(size=4000)


@pytest.mark.parametrize(
    ("x", "words"),
    [
        (0.6 + 0.3 * np.sin(2 * T), "moves at one frequency (0.32 Hz) and one amplitude"),
        (0.6 + 0.002 * T * np.sin(2 * T), "moves at one frequency (0.32 Hz): delay and viscous damping"),
        (0.1 + 0.004 * T, "deformation_mm never turns back"),
        (0.6 + 0.005 * np.sin(2 * T) + 0.003 * np.sin(0.7 * T), "stays at one level (0.6 mm)"),
        (0.6 + 0.3 * np.sign(np.sin(0.2 * T)) * np.abs(np.sin(0.2 * T)) ** 0.2, "turns at one amplitude"),
    ],
)
def test_a_poor_record_is_said_to_be_one(x, words):
    lines = first_look([of(x, other=ANY)]).lines
    assert any(words in line for line in lines), lines


def test_what_thrustd_said_itself_is_no_channel_that_goes_with_another():
    own = {name: ANY for name in ("estimate_thrust_n_left", "estimate_mount_n_left", "check_asymmetry_n_left")}
    own |= {f"deformation_mm_{mount}": ANY for mount in ("left_upper", "left_lower")}
    lines = first_look([of(0.6 + 0.3 * np.sin(2 * T), other=np.roll(ANY, 7), **own)]).lines
    assert not any("goes with" in line for line in lines), lines


def test_a_rich_record_has_nothing_to_be_said():
    look = first_look([record()])
    assert look.lines == () and look.turns > 5 and not look.delivers_energy
    assert look.fastest_s == pytest.approx(0.1) and look.slowest_s == pytest.approx(150, rel=0.01)


def test_channels_that_are_not_there_or_one_are_said():
    x = record()["deformation_mm"][:4000]
    assert any("no other column that moves" in line for line in first_look([of(x, idle=0 * T)]).lines)
    both = first_look([of(x, oil=ANY, again=2 * ANY + 1)]).lines
    assert any("oil goes with again" in line or "again goes with oil" in line for line in both)


@pytest.mark.parametrize(("size", "trusted", "said"), [(0.25, False, False), (2.4, False, True), (2.4, True, False)])
def test_an_acceleration_that_no_aircraft_has_is_asked_for_its_unit(size, trusted, said):
    """Its mass was 6 kg of 60, strong, without a word."""
    rig = of(0.6 + 0.3 * np.sin(2 * T) + 0.1 * np.sin(0.7 * T), accel_x_g=size * np.sin(0.3 * T))
    lines = first_look([with_trusted_units(rig) if trusted else rig]).lines
    assert any("accel_x_g reaches 2.4" in line and "m/s2?" in line for line in lines) == said


def test_noise_is_no_motion():
    data = record(n=4000)
    still = data.with_channels(deformation_mm=0.6 + 3e-4 * ANY)
    with pytest.raises(RecordingError, match="deformation_mm never moves beyond its noise"):
        check_recording(still, mount())
    check_recording(data.with_channels(deformation_mm=0.5 * ANY), mount())  # a white drive is a motion
    check_recording(data.with_channels(deformation_mm=0.5 + 0.3 * np.sin(np.pi / 2 * np.arange(4000))), mount())


def test_thirteen_g_are_one_line():
    data = record(n=4000)
    high = data["accel_z_g"].copy()
    high[1000:1200] = 13.0
    with pytest.raises(RecordingError, match=r"accel_z_g reaches 13, expected -5 to 8 g .*--trust-units"):
        check_recording(data.with_channels(accel_z_g=high), mount())


def test_compare_says_it_first():
    data = record(n=4000)
    report = compare({"mount": mount()}, [data.with_channels(force_N=-data["force_N"])])
    (look,) = report.to_json()["first_look"]
    assert look["delivers_energy"] and "sign of force_N" in look["lines"][0]
