"""Curves beside a law: what one of its own channels says as well is no other cause."""

from thrustd.diagnose.search.better import another
from thrustd.diagnose.search.curves import Followed


def _curve(parts: tuple[str, ...], mse: float) -> Followed:
    return Followed(" * ".join(parts), parts, mse, mse, 1.0 - mse)


def test_a_law_s_channel_times_one_that_hardly_varies_is_no_other():
    own, same = _curve(("accel_x_g",), 0.100), _curve(("accel_x_g", "baro_hPa"), 0.099)
    assert another([same, own], [{"accel_x_g"}]) == []


def test_a_product_that_says_more_than_the_law_s_own_channel_is_another():
    own, more = _curve(("n1_pct",), 0.3), _curve(("anti_ice", "n1_pct"), 0.1)
    assert another([own, more], [{"n1_pct"}]) == [more]


def test_a_curve_of_another_channel_stays():
    other = _curve(("gen_A",), 0.1)
    assert another([other], [{"n1_pct"}]) == [other]


def test_what_joins_two_channels_of_two_laws_is_neither_s_own():
    joined = _curve(("bleed_temp_degC", "oil_temp_degC"), 0.1)
    assert another([joined], [{"bleed_temp_degC"}, {"oil_temp_degC"}]) == [joined]
    assert another([joined], [{"bleed_temp_degC", "oil_temp_degC"}]) == []
