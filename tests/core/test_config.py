"""A configuration that says something impossible is refused in one line that names file, key and value."""

import dataclasses
import json

import msgspec
import pytest

from tests.conftest import ROOT, small_aircraft
from thrustd.core.calibration import read_calibration
from thrustd.core.config import read_config
from thrustd.core.errors import ConfigError, ModelError

GOOD = small_aircraft().files["config.toml"].decode()


def test_the_shipped_configurations_are_read():
    for name in ("ph-lab.toml", "hil.toml"):
        config = read_config((ROOT / "deploy" / name).read_text(), name)
        assert config.mounts_of("left") == (0, 1)
        assert config.mounts_of("right") == (2, 3)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('deck = "deck.json"', 'deck = "deck.json"\ndekc = 1', ("dekc: no such key", "aircraft, mount, adc")),
        ("channels = 4", "channels = 4\nspeed = 3", ("adc.speed: no such key", "port, sample_hz, channels, baud")),
        ("adc_channel = 3", "adc_channel = 3\nscale = 3", ("mount[3].scale: no such key", "scale_mm")),
        ("[aircraft]", "[live_view]\nporrt = 1\n\n[aircraft]", ("live_view.porrt: no such key", "host, port")),
        ("[aircraft]", '[live_view]\nhost = ""\n\n[aircraft]', ("live_view.host = ''", "{1,253}")),
        ("[aircraft]", '[live_view]\nhost = "a\\u0000"\n\n[aircraft]', ("live_view.host = 'a\\x00'", "{1,253}")),
        ('port = "loop://"', 'port = ""', ("adc.port = ''", ">= 1")),
        ("[aircraft]", "[live_view]\n[health]\nport = 8765\n[aircraft]", ("live_view.port = 8765", "health.port")),
        ("[adc]", "[[adc]]", ("adc = a list", "object")),
        ("estimate_hz = 50.0", "estimate_hz = 30.0", ("steps.estimate_hz = 30", "33.3333 comes nearest")),
        ("estimate_hz = 50.0", "estimate_hz = 70.0", ("steps.estimate_hz = 70", "100 comes nearest")),
        (
            "[aircraft]",
            "[can_out]\nnode_id = 1\nrate_hz = 60.0\n[aircraft]",
            ("can_out.rate_hz = 60", "at most steps.estimate_hz, 50"),
        ),
        ("sample_hz = 100.0", "sample_hz = -3.0", ("adc.sample_hz", "-3.0", ">= 10")),
        ("sample_hz = 100.0", 'sample_hz = "fast"', ("adc.sample_hz", "'fast'", "float")),
        ("channels = 4", "channels = 9", ("adc.channels", "9", "<= 8")),
        ('engines = ["left", "right"]', 'engines = ["left"]', ("mount[2].engine", "'right'", "left")),
        ("adc_channel = 3", "adc_channel = 2", ("mount[3].adc_channel", "2", "twice")),
        ("adc_channel = 3", "adc_channel = 7", ("mount[3].adc_channel", "7", "0 to 3")),
        ("scale_mm = 2.9802322387695312e-07", "scale_mm = 0", ("mount[0].scale_mm", "0")),
        ('engine = "right"', 'engine = "left"', ("engine 'left' has 4 mounts", "expected 1 or 2")),
        ('engines = ["left", "right"]', 'engines = ["left", "right", "tail"]', ("engine 'tail' has 0 mounts",)),
        ("estimate_hz = 50.0", "estimate_hz = 100.0\nbridge_gap_ms = 9e9", ("steps.bridge_gap_ms", "<= 2000")),
        ("[aircraft]", "[aircraft", ("not TOML",)),
        ('name = "test"', 'name = ""', ("aircraft.name",)),
        ('name = "test"', "name = " + 5000 * "[", ("nested too deep",)),
        ("estimate_hz = 50.0", "estimate_hz = " + 5000 * "9", ("not TOML", "4300 digits")),
        ("estimate_hz = 50.0", "estimate_hz = 0x" + 4000 * "f", ("steps.estimate_hz = a number of 16000 bits",)),
        ('name = "test"', 'name = "\\u001b[2J"', ("aircraft.name = '\\x1b[2J'",)),
    ],
)
def test_an_impossible_configuration_is_refused(old, new, words):
    assert old in GOOD
    with pytest.raises(ConfigError, match=r"^aircraft\.toml: ") as refused:
        read_config(GOOD.replace(old, new), "aircraft.toml")
    message = str(refused.value)
    assert "\n" not in message
    for word in words:
        assert word in message


@pytest.mark.parametrize("key", ["n1_100_pct_rpm", "n2_100_pct_rpm", "fuel_density_kg_l"])
@pytest.mark.parametrize("value", ["0.0", "-0.8", "nan", "inf"])
def test_an_engine_or_fuel_that_cannot_be_is_refused_before_anything_is_divided_by_it(key, value):
    aircraft = small_aircraft()
    impossible = dataclasses.replace(aircraft, config=read_config(f"{GOOD}\n[can.units]\n{key} = {value}\n", "x"))
    with pytest.raises(ConfigError, match=rf"can\.units: {key} = .*: Expected `float` "):
        impossible.parts()


def test_a_line_too_slow_for_the_adc_is_refused():
    aircraft = small_aircraft()
    text = GOOD.replace("loop://", "/dev/ttyUSB0").replace("channels = 4", "channels = 4\nbaud = 9600")
    slow = dataclasses.replace(aircraft, config=read_config(text, "x"))
    with pytest.raises(ConfigError, match=r"adc\.baud = 9600: expected at least 28000 for 100 frames of 28 bytes"):
        slow.parts()
    aircraft.parts()


def test_an_effect_that_nobody_knows_is_named_with_file_and_place():
    aircraft = small_aircraft()
    name = aircraft.config.mount[0].model
    model = json.loads(aircraft.files[name])
    model["effects"] = [{"name": "magic", "parameters": {}}]
    strange = dataclasses.replace(aircraft, files=dict(aircraft.files) | {name: json.dumps(model).encode()})
    with pytest.raises(ModelError, match=rf"{name}: effects\[0\]\.name: unknown effect 'magic'"):
        strange.parts()


def test_a_model_that_corrects_no_load_factor_is_said():
    """The bench of a mount knows neither acceleration nor weight, and a model of it flies: with a word."""
    aircraft = small_aircraft()
    assert aircraft.uncorrected() == []
    bench = {name: file for name, file in aircraft.files.items()}
    for name in {mount.model for mount in aircraft.config.mount}:
        bench[name] = json.dumps(json.loads(bench[name]) | {"effects": []}).encode()
    lines = dataclasses.replace(aircraft, files=bench).uncorrected()
    assert len(lines) == 4
    assert "left_upper: left_upper.json has no axial_inertia and no engine_weight" in lines[0]


def test_an_engine_of_which_one_mount_has_no_transducer_is_said():
    aircraft = small_aircraft()
    left = msgspec.structs.replace(aircraft.config, mount=[*aircraft.config.mount[:1], *aircraft.config.mount[2:]])
    (line,) = dataclasses.replace(aircraft, config=left).uncorrected()
    assert line == "left_upper: of 2 mounts the only one with a transducer, its force counts as 46 % of the thrust"


@pytest.mark.parametrize(
    ("line", "words"),
    [("gate = 3", "aircraft.toml: fusion: gate: no such key"), ("gate_chi2 = -1.0", "aircraft.toml: fusion: ")],
)
def test_settings_of_the_fusion_are_refused_with_their_file(line, words):
    config = read_config(f"{GOOD}\n[fusion]\n{line}\n", "aircraft.toml")
    with pytest.raises(ConfigError, match=words):
        dataclasses.replace(small_aircraft(), config=config, where="aircraft.toml").parts()


@pytest.mark.parametrize("day", ["2027-11-31", "2026-02-29", "24.11.2026"])
def test_a_day_that_the_calendar_does_not_have_is_one_short_line(day):
    with pytest.raises(ConfigError) as refused:
        read_calibration(f'[mount.left_upper]\nzeros = [{{ on = "{day}", mm = 0.0, std_mm = 0.001 }}]\n', "c.toml")
    said = f"c.toml: mount.left_upper.zeros[0].on = '{day}': Expected a day of the calendar, as 2026-02-28"
    assert str(refused.value) == said
