"""An engine that hangs as a rigid body: its mounts begin where its weight holds them, on a curve that stiffens."""

import msgspec
import numpy as np
import pytest

from thrustd.cli.files import read_models
from thrustd.core.aircraft import place_of, read_aircraft
from thrustd.core.errors import ConfigError, ModelError
from thrustd.installation.installation import read_installation
from thrustd.installation.shipped import shipped
from thrustd.model.c_model import c_source
from thrustd.model.calibrated import calibrated
from thrustd.model.compile import compile_model
from thrustd.mounts.start import LOAD_AGE_S, Past, Unseen, at_rest, resting_n
from thrustd.twin.installation import PLAIN, carried_parts
from thrustd.twin.mount import LOWER, UPPER, advance
from thrustd.twin.mount import at_rest as unloaded

INSTALLATION = read_installation(shipped("deploy/hil.toml", "config"))
RIGID = msgspec.structs.replace(INSTALLATION.aircraft(), rigid_body=True)
SETTLE_S = 100_000  # rubber; friction left out: a model that moved differently knows another
HELD_S, PULLED_S, RISE_S = 1800, 60, 10  # under the weight alone, under a thrust


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


@pytest.mark.parametrize("thrust_n", [500.0, 2000.0, 6000.0])
def test_what_friction_held_of_the_weight_turns_with_the_thrust(thrust_n):
    """Thrust loads the lower mount further and turns the upper one: some 130 N of friction each, to either side."""
    still, pulled = (
        carried_parts(0.46, PLAIN._replace(statics=True), np.array([each]), np.array([[0.0], [0.0], [1.0]]), 0.0)[:, 0]
        for each in (0.0, thrust_n)
    )
    said_n = []
    for name, physics, held_n, load_n in zip(("left_upper", "left_lower"), (UPPER, LOWER), still, pulled, strict=True):
        state = unloaded(physics)
        held_mm = advance(physics, state, held_n * np.minimum(np.arange(1, HELD_S + 1) / RISE_S, 1.0), 1.0)[-1]
        rises = np.minimum(np.arange(1, 10 * PULLED_S + 1) / (10 * RISE_S), 1.0)
        read_mm = advance(physics, state, held_n + rises * (load_n - held_n), 0.1) - held_mm
        (spec,) = read_models([shipped(f"models/{name.replace('_', '-')}.json", "model")]).values()
        model = compile_model(calibrated(spec, place_of(name, INSTALLATION.config, RIGID), name), 10.0)
        row = at_rest(model, {"accel_z_g": 1.0})
        assert resting_n(model, row(0.0)) == pytest.approx(0.0, abs=1.0)
        rows = np.stack([row(each) for each in [0.0, *read_mm.tolist()]])
        said_n.append(model.simulate(rows)[-1])
    assert said_n == pytest.approx(thrust_n * np.array([0.352, 0.648]), abs=25.0 + 0.01 * thrust_n)


@pytest.mark.parametrize("thrust_n", [500.0, 2000.0, 6000.0])
def test_after_a_flight_the_lower_mount_holds_the_friction_of_a_load_that_fell(thrust_n):
    """A tethered run has told its zero: what it shows at rest is friction, some 260 N, and 30 N of creep."""
    still, pulled = (
        carried_parts(0.46, PLAIN._replace(statics=True), np.array([each]), np.array([[0.0], [0.0], [1.0]]), 0.0)[1, 0]
        for each in (0.0, thrust_n)
    )
    state = unloaded(LOWER)
    rise = np.minimum(np.arange(1, HELD_S + 1) / RISE_S, 1.0)
    held_mm = advance(LOWER, state, still * rise, 1.0)[-1]
    landed_mm = advance(LOWER, state, np.concatenate((still + 6000.0 * rise, still + 6000.0 * (1.0 - rise))), 1.0)[-1]
    rises = np.minimum(np.arange(1, 10 * PULLED_S + 1) / (10 * RISE_S), 1.0)
    read_mm = advance(LOWER, state, still + rises * (pulled - still), 0.1) - held_mm
    (spec,) = read_models([shipped("models/left-lower.json", "model")]).values()
    model = compile_model(calibrated(spec, place_of("left_lower", INSTALLATION.config, RIGID), "left_lower"), 10.0)
    row, shown_mm = at_rest(model, {"accel_z_g": 1.0}), float(landed_mm - held_mm)
    assert resting_n(model, row(shown_mm)) > 200.0
    state = Unseen(model).start(row, shown_mm, Past(None, LOAD_AGE_S, rested=True, carries_nothing=True))
    said_n = model.simulate(np.stack([row(each) for each in [shown_mm, *read_mm.tolist()]]), state)
    assert said_n[0] == pytest.approx(0.0, abs=40.0)
    assert said_n[-1] == pytest.approx(0.648 * thrust_n, abs=30.0 + 0.01 * thrust_n)


def test_below_its_bench_a_curve_goes_on_as_on_the_other_side():
    for name, side in (("left_upper", 1.0), ("left_lower", 0.0)):
        (spec,) = read_models([shipped(f"models/{name.replace('_', '-')}.json", "model")]).values()
        pressed = calibrated(spec, place_of(name, INSTALLATION.config, RIGID), name)
        low_mm = spec.valid.deformation_mm[0]
        for curve in (pressed.input_curve, pressed.output_curve):
            assert np.all(np.diff(curve.x) > 0.0)
        x, y = np.array(pressed.input_curve.x), np.array(pressed.input_curve.y)
        at_mm = np.linspace(0.05, 0.3, 6)
        across = np.interp(-at_mm, x, y) + np.interp(at_mm, x, y)
        assert np.ptp(across) < 0.01 * np.interp(0.3, x, y)  # odd about where it carries nothing
        assert np.interp(at_mm, x, y) == pytest.approx(np.interp(at_mm, spec.input_curve.x, spec.input_curve.y))
        assert (pressed.pressed_mm < 0.0) == bool(side) and pressed.valid.deformation_mm[
            0
        ] == low_mm - pressed.pressed_mm


def test_what_hangs_under_its_engine_is_no_model_for_another_computer():
    (spec,) = read_models([shipped("models/left-upper.json", "model")]).values()
    flies = calibrated(spec, place_of("left_upper", INSTALLATION.config, RIGID), "left_upper")
    with pytest.raises(ModelError, match="under its engine's weight; expected a model of the bench"):
        c_source(compile_model(flies, 100.0))


def test_a_rigid_body_needs_its_geometry():
    text = shipped("deploy/citation-ii.toml", "data").read_text().replace("rigid_body = false", "rigid_body = true")
    assert read_aircraft(text, "a.toml").share(0) == pytest.approx(0.35, abs=0.01)
    begin, end = text.index("mounts = ["), text.index("# Where the accelerometer is")
    with pytest.raises(ConfigError, match="rigid_body: expected mounts"):
        read_aircraft(text[:begin] + text[end:], "a.toml")
