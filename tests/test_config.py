"""A configuration that says something impossible is refused in one line that names file, key and value."""

import pytest

from tests.conftest import ROOT, small_aircraft
from thrustd.config import read_config
from thrustd.errors import ConfigError

GOOD = small_aircraft().files["config.toml"].decode()


def test_the_shipped_configurations_are_read():
    for name in ("ph-lab.toml", "hil.toml"):
        config = read_config((ROOT / "deploy" / name).read_text(), name)
        assert config.mounts_of("left") == (0, 1)
        assert config.mounts_of("right") == (2, 3)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('deck = "deck.json"', 'deck = "deck.json"\ndekc = 1', ("dekc",)),
        ("sample_hz = 100.0", "sample_hz = -3.0", ("adc.sample_hz", "-3.0", ">= 10")),
        ("sample_hz = 100.0", 'sample_hz = "fast"', ("adc.sample_hz", "'fast'", "float")),
        ("channels = 4", "channels = 9", ("adc.channels", "9", "<= 8")),
        ('engines = ["left", "right"]', 'engines = ["left"]', ("mount[2].engine", "'right'", "left")),
        ("adc_channel = 3", "adc_channel = 2", ("adc_channel", "2", "twice")),
        ("adc_channel = 3", "adc_channel = 7", ("mount[3].adc_channel", "7", "0 to 3")),
        ("scale_mm = 2.9802322387695312e-07", "scale_mm = 0", ("mount[0].scale_mm", "0")),
        ("estimate_hz = 50.0", "estimate_hz = 100.0\nbridge_gap_ms = 9e9", ("steps.bridge_gap_ms", "<= 2000")),
        ("[aircraft]", "[aircraft", ("not TOML",)),
        ('name = "test"', 'name = ""', ("aircraft.name",)),
        ('name = "test"', "name = " + 5000 * "[", ("nested too deep",)),
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
