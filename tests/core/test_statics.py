"""What the mounts carry by statics: the twin's own code says the same; nothing is made up where nothing is known."""

import msgspec
import pytest

from thrustd.core.aircraft import read_aircraft
from thrustd.core.statics import carried
from thrustd.installation.shipped import shipped
from thrustd.twin.installation import loads

DATA = read_aircraft(shipped("deploy/citation-ii.toml", "data").read_text(), "citation-ii.toml")


def test_the_twin_which_shares_no_code_says_the_same():
    for mine, row in zip(carried(DATA), loads(), strict=True):
        assert mine.thrust_share == pytest.approx(row[0], abs=1e-9)
        assert mine.weight_n == pytest.approx(373.0 * 9.80665 * row[2], abs=1e-6)


def test_one_g_is_a_couple_of_1_4_kilonewtons_and_the_shares_add_up():
    upper, lower, rear = carried(DATA)
    assert upper.thrust_share + lower.thrust_share == pytest.approx(1.0)
    assert 0.33 < upper.thrust_share < 0.37 and rear.thrust_share == 0.0
    assert -1450.0 < upper.weight_n < -1400.0 and lower.weight_n == pytest.approx(-upper.weight_n)
    assert upper.weight_std_n == pytest.approx(abs(upper.weight_n) * 4.0 / 373.0)


def test_a_file_without_geometry_says_nothing():
    assert carried(msgspec.structs.replace(DATA, mounts=())) == []
