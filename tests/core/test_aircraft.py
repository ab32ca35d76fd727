"""The aircraft's own file: what it says of mounts and sensors, and files that are refused."""

import msgspec
import pytest

from tests.conftest import ROOT, small_aircraft
from thrustd.core.aircraft import NO_MOUNT, place_of, places, read_aircraft
from thrustd.core.errors import ConfigError, RecordingError
from thrustd.installation.installation import installation_from_files

CITATION = read_aircraft((ROOT / "deploy" / "citation-ii.toml").read_text(), "citation-ii.toml")


def test_mounts_carry_the_thrust_in_the_ratio_of_their_springs():
    config = small_aircraft().config
    upper, lower = (place_of(f"right_{name}", config, CITATION) for name in ("upper", "lower"))
    assert (upper.engine, upper.number) == ("right", 1)
    assert upper.share == pytest.approx(5079.0 / (5079.0 + 5954.0))
    assert upper.share + lower.share == pytest.approx(1.0)
    with pytest.raises(RecordingError, match="expected one of left_upper, left_lower"):
        place_of("tail", config, CITATION)


def test_one_mount_alone_carries_it_all():
    assert msgspec.structs.replace(CITATION, spring_n_mm=[11033.0]).share(0) == 1.0


def test_of_mounts_that_have_no_transducer_the_names_of_the_others_tell_the_place():
    config = small_aircraft().config

    def named(*names):
        mounts = [msgspec.structs.replace(config.mount[i], name=name) for i, name in enumerate(names)]
        return msgspec.structs.replace(config, mount=[*mounts[1:], *config.mount[2:]])

    assert places(named("left_upper", "left_lower"), CITATION) == ((NO_MOUNT, 0), (1, 2))
    assert place_of("left_lower", named("left_upper", "left_lower"), CITATION).share == pytest.approx(0.5397, abs=1e-4)
    with pytest.raises(ConfigError, match=r"mount port: .*expected a name that ends with upper or lower$"):
        places(named("left_upper", "port"), CITATION)


def test_a_log_of_before_flies_on_the_shipped_file(aircraft):
    assert aircraft.config.aircraft.data is None
    assert aircraft.aircraft() == CITATION
    assert "citation-ii.toml" in aircraft.files


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("name = 3", "name = 3"),
        ("name = ", "not TOML"),
        ('name = "x"\nengine_mass_kg = -1.0\nspring_n_mm = [1.0]\nlimits = {}', "engine_mass_kg = -1.0"),
        ('name = "x"\nengine_mass_kg = 1.0\nspring_n_mm = [1.0]\nlimits = {}\ncolour = 1', "colour: no such key"),
    ],
)
def test_other_files_are_refused_in_one_line(text, words):
    with pytest.raises(ConfigError, match=words) as refused:
        read_aircraft(text, "other.toml")
    assert str(refused.value).startswith("other.toml: ")
    assert "\n" not in str(refused.value)


REAR = '    { name = "rear", at_mm = [-390.1, -367.5, 33.5], spring_n_mm = [0.0, 875.0, 875.0] },\n'
UPPER_X, LOWER_X = "spring_n_mm = [5079.0, 1646.0", "spring_n_mm = [5954.0, 1926.0"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (REAR, "", "mounts: upper, lower leave an engine free to move"),
        (UPPER_X, "spring_n_mm = [0.0, 0.0", "expected those of spring_n_mm"),
        ("\nmounts = [\n", f"\nmounts = [\n{REAR}", "expected those of spring_n_mm"),  # the rear one first
        (UPPER_X, "spring_n_mm = [6079.0, 1646.0", "in this order"),  # upper and lower in each other's place
        (UPPER_X, "spring_n_mm = [nan, 1646.0", "mounts"),
        (UPPER_X, "spring_n_mm = [-5079.0, 1646.0", "mounts"),
        (LOWER_X, "spring_n_mm = [inf, 1926.0", "mounts"),
        ("at_mm = [263.9,", "at_mm = [nan,", "mounts"),
        ("centre_of_gravity_mm = [0.0,", "centre_of_gravity_mm = [nan,", "centre_of_gravity_mm"),
        ("# accelerometer_m = { left = [2.0,", "accelerometer_m = { left = [nan,", "accelerometer_m"),
        (
            "# accelerometer_m = { left = [2.0,",
            "accelerometer_m = { left = [2000.0,",
            r"accelerometer_m.left\[0\] = 2000",
        ),
        (
            "# cant = { left = { deg = 0.0,",
            "cant = { left = { deg = 45.0,",
            "cant.left.deg = 45.0: Expected `float` <= 20.0",
        ),
        ("# cant = { left = { deg = 0.0,", "cant = { left = { dig = 1.0,", "cant.left"),
        ("mach = { jump = 0.02,", "mach = { jump = 0.0,", "limits.mach.jump = 0.0: Expected `float` > 0.0"),
        ("mach = { jump = 0.02,", "mach = { jmp = 0.02,", "limits.mach.jmp: no such key, expected one of jump, noise"),
        ('name = "lower"', 'name = "upper"', "mounts: upper, upper, rear: expected every name once"),
        (
            "rigid_body = false\ncentre_of_gravity_mm = [0.0, 0.0, 0.0]",
            "rigid_body = true\ncentre_of_gravity_mm = [0.0, 0.0, 3000.0]",
            "would carry 494 % and -394 % of a thrust",
        ),
    ],
)
def test_a_geometry_that_no_engine_has_is_refused_in_one_line(old, new, words):
    text = (ROOT / "deploy" / "citation-ii.toml").read_text()
    assert text.count(old) == 1
    with pytest.raises(ConfigError, match=words) as refused:
        read_aircraft(text.replace(old, new), "other.toml")
    assert "\n" not in str(refused.value)


def test_data_that_lack_what_the_installation_has_are_refused(aircraft):
    """A spring rate for every mount of an engine, limits for every sensor."""
    text = aircraft.files["citation-ii.toml"].decode()
    for old, new, words in (
        ("spring_n_mm = [5079.0, 5954.0]", "spring_n_mm = [5079.0]", "expected one for each of 2 mounts"),
        ("accel_y_g = {", "accel_w_g = {", "limits: no accel_y_g"),
    ):
        assert old in text
        files = {**aircraft.files, "citation-ii.toml": text.replace(old, new).encode()}
        with pytest.raises(ConfigError, match=words):
            installation_from_files(files, "test").pipeline()
