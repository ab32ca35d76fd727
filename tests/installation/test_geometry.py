"""Every number of an engine's geometry is a key of the aircraft's file, and turning it turns what flies or is said."""

import msgspec
import numpy as np
import pytest

from thrustd.commission.mount_models import Made, _hang
from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.core.statics import carried, left_over
from thrustd.identify.artifact import witness_rows
from thrustd.installation.as_calibrated import as_estimated
from thrustd.installation.installation import Installation, read_installation
from thrustd.installation.shipped import shipped
from thrustd.model.artifact import EffectSpec
from thrustd.sensors.errors import installed_n2
from thrustd.sensors.past import ALONG_G, WIDTH

HIL = read_installation(shipped("deploy/hil.toml", "config"))
FILE = "citation-ii.toml"
UPPER = "at_mm = [263.9, -289.1, 235.5], spring_n_mm = [5079.0, 1646.0, 1646.0]"
RIGID = ("rigid_body = false", "rigid_body = true")


def changed(*pairs: tuple[str, str]) -> Installation:
    text = HIL.files[FILE].decode()
    for old, new in pairs:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return Installation(HIL.config, {**HIL.files, FILE: text.encode()}, "test")


@pytest.mark.parametrize(
    "new",
    [
        UPPER.replace("263.9", "243.9"),  # position: forward
        UPPER.replace("-289.1", "-269.1"),  # inboard
        UPPER.replace("235.5", "215.5"),  # up
        UPPER.replace("5079.0", "4579.0"),  # spring rates, the same three directions
        UPPER.replace("[5079.0, 1646.0", "[5079.0, 1146.0"),
        UPPER.replace("1646.0]", "1146.0]"),
    ],
)
def test_places_and_spring_rates_of_a_mount_move_what_it_carries_and_how_it_flies(new):
    rigid, other = changed(RIGID), changed(RIGID, (UPPER, new))
    assert carried(other.aircraft()) != carried(rigid.aircraft())
    mount = HIL.config.mount[0]
    assert other.place(mount.name) != rigid.place(mount.name)
    assert other.model(mount) != rigid.model(mount)  # its couple, and where its curve begins


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_centre_of_gravity_is_where_places_are_counted_from(axis):
    """Moved by 20 mm it does what mounts moved by as much the other way do."""
    cg_mm = [0.0, 0.0, 0.0]
    cg_mm[axis] = 20.0
    key, rigid = "centre_of_gravity_mm = ", changed(RIGID)
    moved = changed(RIGID, (f"{key}[0.0, 0.0, 0.0]", f"{key}{cg_mm}"))
    assert moved.model(HIL.config.mount[0]) != rigid.model(HIL.config.mount[0])
    places = [msgspec.structs.replace(each, at_mm=tuple(at - cg for at, cg in zip(each.at_mm, cg_mm, strict=True)))
              for each in rigid.aircraft().mounts]  # fmt: skip
    same = msgspec.structs.replace(rigid.aircraft(), mounts=tuple(places))
    for found in (carried, left_over):
        assert found(same) == found(moved.aircraft()) != found(rigid.aircraft())


def test_mass_and_its_sigma():
    heavy = changed(("engine_mass_kg = 373.0", "engine_mass_kg = 400.0"))
    vague = changed(("engine_mass_std_kg = 4.0", "engine_mass_std_kg = 8.0"))
    plain, more, less_sure = (carried(each.aircraft())[0] for each in (HIL, heavy, vague))
    assert more.weight_n == pytest.approx(plain.weight_n * 400.0 / 373.0)
    assert less_sure.weight_std_n == pytest.approx(2.0 * plain.weight_std_n)
    assert less_sure_n_g(vague) == pytest.approx([2.0 * each for each in less_sure_n_g(HIL)])
    assert hung(heavy)["axial_inertia"]["mass_kg"] == pytest.approx(400.0 * 5079.0 / (5079.0 + 5954.0), abs=0.1)


def less_sure_n_g(installation: Installation) -> list[float]:
    """Of the inertia, of the couple of a rigid body."""
    rigid = msgspec.structs.replace(installation.aircraft(), rigid_body=True)
    return [installation.aircraft().installed().inertia_n_g, rigid.installed().couple_n_g]


def test_what_is_unsure_of_the_mass_is_in_the_band_as_the_specific_force_goes_and_of_one_mount_as_its_couple():
    installed = HIL.aircraft().installed()
    assert installed.inertia_n_g == pytest.approx(4.0 * STANDARD_GRAVITY_M_S2)
    assert installed.couple_n_g == 0.0  # mounts that move together know none
    rows = np.zeros((2, WIDTH))
    rows[0, ALONG_G], rows[1, ALONG_G] = 0.3, -0.1
    known = installed._replace(inertia_n_g=0.0)
    apart_n2 = [installed_n2(rows, 0, b, installed) - installed_n2(rows, 0, b, known) for b in (0, 1)]
    assert apart_n2 == pytest.approx([(0.3 * installed.inertia_n_g) ** 2, -0.03 * installed.inertia_n_g**2])


def test_a_mass_that_the_models_have_estimated_has_its_sigma_in_their_error_maps():
    spec = HIL.bench_model(HIL.config.mount[0])
    told = [
        EffectSpec(each.name, each.parameters, {"mass_kg": 30.0} if each.name == "axial_inertia" else {})
        for each in spec.effects
    ]
    estimated, plain = msgspec.structs.replace(spec, effects=told), HIL.aircraft()
    assert as_estimated(plain, [estimated, spec]) == plain  # one of both mounts has it from the file
    found = as_estimated(plain, [estimated, estimated])
    assert found.installed().inertia_n_g == 0.0 and found.engine_mass_std_kg == plain.engine_mass_std_kg


def test_the_accelerometers_place_becomes_the_lever_arm():
    assert "lever_arm" not in hung(HIL)
    arm = "# accelerometer_m = { left", "accelerometer_m = { left"
    assert hung(changed(arm))["lever_arm"] != hung(changed(arm, ("left = [2.0,", "left = [1.0,")))["lever_arm"]


def hung(installation: Installation) -> dict[str, dict[str, float]]:
    """Effects that `commission` puts into a model for where the mount hangs."""
    mount = HIL.config.mount[0]
    bare = msgspec.structs.replace(HIL.bench_model(mount), effects=[], witness=None)
    made = Made(msgspec.structs.replace(bare, witness=witness_rows(bare, 10.0)), 0.0, 0.0, [])
    _hang(made, mount.name, installation)
    return {effect.name: effect.parameters for effect in made.spec.effects}
