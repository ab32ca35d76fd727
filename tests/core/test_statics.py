"""What the mounts carry by statics: the twin's own code says the same; nothing is made up where nothing is known."""

import msgspec
import numpy as np
import pytest

from thrustd.core.aircraft import read_aircraft
from thrustd.core.statics import carried, left_over
from thrustd.installation.shipped import shipped
from thrustd.twin.installation import loads

DATA = read_aircraft(shipped("deploy/citation-ii.toml", "data").read_text(), "citation-ii.toml")
WEIGHT_N = 373.0 * 9.80665


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


def test_with_one_front_mount_lost_the_other_carries_all_and_nothing_holds_the_engine_about_one_line():
    """Forces by hand: only a front mount holds along x. Rear mounts alone hold nothing there."""
    left = {one.lost: one for one in left_over(DATA) if one.lost != "rear"}
    assert {one.lost: one.mount for one in left.values()} == {"upper": "lower", "lower": "upper"}
    arms = {place.name: np.array(place.at_mm) / 1e3 for place in DATA.mounts}
    for one in left.values():
        line = arms["rear"] - arms[one.mount]
        line /= np.linalg.norm(line)
        moments = [np.dot(np.cross(-arms[one.mount], pull), line) for pull in ((1.0, 0.0, 0.0), (0.0, 0.0, -WEIGHT_N))]
        assert one.thrust_share == pytest.approx(1.0)
        assert [one.thrust_turns_m, one.weight_turns_nm] == pytest.approx(np.abs(moments))
        assert 0.05 < one.thrust_turns_m < 0.15 and 1000.0 < one.weight_turns_nm < 1200.0
    assert [one.thrust_share for one in left_over(DATA) if one.lost == "rear"] == pytest.approx(
        [0.258, 0.742], abs=0.001
    )
    assert left_over(msgspec.structs.replace(DATA, mounts=())) == []
