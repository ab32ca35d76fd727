"""An engine that hangs as a rigid body: its mounts begin where its weight holds them, on a curve that stiffens."""

import msgspec
import numpy as np
import pytest

from thrustd.cli.files import read_models
from thrustd.core.aircraft import place_of, read_aircraft
from thrustd.core.errors import ConfigError
from thrustd.installation.installation import read_installation
from thrustd.installation.shipped import shipped
from thrustd.model.calibrated import calibrated
from thrustd.model.compile import compile_model
from thrustd.mounts.start import at_rest, resting_n
from thrustd.twin.installation import PLAIN, carried_parts
from thrustd.twin.mount import LOWER, UPPER, advance
from thrustd.twin.mount import at_rest as unloaded

INSTALLATION = read_installation(shipped("deploy/hil.toml", "config"))
RIGID = msgspec.structs.replace(INSTALLATION.aircraft(), rigid_body=True)
SETTLE_S = 100_000  # rubber; friction left out: a model that moved differently knows another


def settled_mm(thrust_n, load_g=1.0):
    """Of left upper and lower in the twin, whose statics are its own code."""
    loads_n = carried_parts(
        0.46, PLAIN._replace(statics=True), np.array([thrust_n]), np.array([[0.0], [0.0], [load_g]]), 0.0
    )
    ends = []
    for physics, load_n in zip((UPPER, LOWER), loads_n[:, 0], strict=True):
        smooth = physics._replace(friction_n=(), friction_mm=())
        ends.append(advance(smooth, unloaded(smooth), np.full(SETTLE_S, load_n), 1.0)[-1])
    return np.array(ends)


def says_n(aircraft, mm, load_g=1.0):
    """What the shipped models say of both mounts at rest."""
    forces_n = []
    for name, each in zip(("left_upper", "left_lower"), mm.tolist(), strict=True):
        (spec,) = read_models([shipped(f"models/{name.replace('_', '-')}.json", "model")]).values()
        smooth = [e for e in spec.effects if not e.name.startswith("hysteresis")]
        place = place_of(name, INSTALLATION.config, aircraft)
        model = compile_model(
            calibrated(msgspec.structs.replace(spec, effects=smooth, witness=None), place, name), 10.0
        )
        forces_n.append(resting_n(model, at_rest(model, {"accel_z_g": load_g})(each)))
    return np.array(forces_n)


@pytest.mark.parametrize("thrust_n", [0.0, 2000.0, 6000.0])
def test_both_mounts_say_what_they_carry_of_a_thrust(thrust_n):
    read_mm = settled_mm(thrust_n) - settled_mm(0.0)  # transducers are rigged to zero at 1 g
    said_n = says_n(RIGID, read_mm)
    assert said_n == pytest.approx(thrust_n * np.array([0.35, 0.65]), abs=20.0 + 0.015 * thrust_n)
    assert said_n.sum() == pytest.approx(thrust_n, abs=20.0 + 0.015 * thrust_n)
    if thrust_n > 3000.0:  # as mounts that move together would say it
        assert says_n(INSTALLATION.aircraft(), read_mm).sum() < 0.96 * thrust_n


def test_more_weight_is_no_thrust():
    read_mm = settled_mm(3000.0, 1.5) - settled_mm(0.0)
    for aircraft, least, most in ((RIGID, 0.0, 0.05), (INSTALLATION.aircraft(), 0.85, 1.2)):
        moved_n = says_n(aircraft, read_mm, 1.5) - says_n(aircraft, settled_mm(3000.0) - settled_mm(0.0))
        assert np.all((least * 711.0 <= abs(moved_n)) & (abs(moved_n) < most * 711.0))  # half of 1423 N


def test_a_rigid_body_needs_its_geometry():
    text = shipped("deploy/citation-ii.toml", "data").read_text().replace("rigid_body = false", "rigid_body = true")
    assert read_aircraft(text, "a.toml").share(0) == pytest.approx(0.35, abs=0.01)
    begin, end = text.index("mounts = ["), text.index("# Where the accelerometer is")
    with pytest.raises(ConfigError, match="rigid_body: expected mounts"):
        read_aircraft(text[:begin] + text[end:], "a.toml")
