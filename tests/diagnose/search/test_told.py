"""What is printed of a number of an effect."""

from tests.diagnose.scene import inertia, mount, record
from thrustd.diagnose.extend.extend import extend
from thrustd.diagnose.search.told import ParameterEstimate, shown


def number(name, value, std, bound=""):
    return ParameterEstimate("hysteresis", name, value, std, "N", "", bound)


def test_an_interval_has_two_digits_of_its_half_width_and_a_number_that_cannot_move_has_none():
    assert number("friction_n", 151.234, 1.0).interval == "151.2 +- 2.0 N"
    assert number("friction_n", 1.5e-6, 1e-7).interval == "0.00000150 +- 0.00000020 N"
    assert number("friction_n", 0.0, 0.0).interval == "0 N"
    assert number("exponent", 3.0, 0.0, "upper").interval == "3 N (its upper bound)"


def test_a_table_shows_the_first_number_that_is_not_nothing():
    assert shown([number("friction_n", 0.0, 0.0), number("level_n", 12.0, 1.0)]) == "level_n 12.0 +- 2.0 N"
    assert shown([number("friction_n", 0.0, 0.0)]) == "friction_n 0 N"


def test_a_mass_that_is_less_than_nothing_says_what_that_means():
    (mass,) = extend(mount(), [record([inertia(-60.0)], n=4000)], ["axial_inertia"]).parameters
    assert mass.value < -50.0 and "negative: accel_x_g turned" in mass.sentence and "accel_x_g turned" in mass.interval
