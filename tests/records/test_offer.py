"""What columns of foreign files may be: by name, unit, values; never by force."""

import numpy as np
import pytest

from thrustd.records.offer import offer, offered_renames
from thrustd.records.units import CONVERSIONS, unit_said

T = np.arange(0.0, 10.0, 0.1)
WAVE = 0.5 + 0.3 * np.sin(T)


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (("Time [s]", "Load [kN]", "LVDT (V)"), {"Time [s]": "s", "Load [kN]": "kN", "LVDT (V)": "V"}),
        (("t", "F", "d"), {"t": "s", "F": "", "d": ""}),
        (("Zeit [ms]", "Kraft [daN]", "Weg [mm]"), {"Zeit [ms]": "ms", "Kraft [daN]": "daN", "Weg [mm]": "mm"}),
        (("elapsed_s", "thrust_lbf", "Position (in)"), {"elapsed_s": "s", "thrust_lbf": "lbf", "Position (in)": "in"}),
        (("A", "Load cell N", "Disp. mm"), {"A": "s", "Load cell N": "", "Disp. mm": ""}),
    ],
)
def test_time_force_and_deformation_by_their_names(names, expected):
    columns = dict(zip(names, (T, 5000 * WAVE, WAVE), strict=True))
    found = offer(columns)
    assert {name: one.unit for name, one in found.items()} == expected
    assert [found[name].ours for name in names] == ["time_s", "force_N", "deformation_mm"]


def test_channels_of_effects_need_their_name_and_their_unit():
    named = {"Ax [g]": "accel_x_g", "Nz [g]": "accel_z_g", "N1 (%)": "n1_pct", "Vib [mm/s]": "vibration_mm_s",
             "Qbar [Pa]": "dynamic_pressure_Pa", "Mach [-]": "mach"}  # fmt: skip
    strange = ("humidity [%]", "shock [g]", "ax", "Fz [kN]", "m")
    found = offer({"Time [s]": T, "Load [kN]": 5 * WAVE, **dict.fromkeys((*named, *strange), WAVE)})
    assert {name: found[name].ours for name in named} == named
    assert not {one.ours for name, one in found.items() if name in strange} & {*named.values()}


def test_what_is_called_as_here_is_left_alone():
    columns = {"time_s": T, "force_N": WAVE, "deformation_mm_left_upper": WAVE, "accel_x_g": WAVE, "speed": WAVE}
    assert offer(columns) == {}


def test_units_convert_and_the_one_below_zero_is_turned():
    found = offer({"Time [ms]": T * 1e3, "Load [kN]": -5 * WAVE, "LVDT (V)": WAVE, "T [K]": 290 + WAVE})
    assert found["Load [kN]"].factor == -1000.0 and found["LVDT (V)"].factor == 1.0
    assert found["Time [ms]"].factor == pytest.approx(1e-3)
    assert (found["T [K]"].ours, found["T [K]"].offset) == ("temperature_degC", -273.15)
    found = offer({"t": T, "F": 5 * WAVE, "d": -WAVE})
    assert found["F"].factor == 1.0 and found["d"].factor == -1.0


@pytest.mark.parametrize("unit", ["N", "mm", "s", "degC", "g", "Pa", "m", "%", "kg/s", "mm/s"])
def test_every_unit_of_the_catalogue_is_its_own(unit):
    assert CONVERSIONS[unit][unit] == (1, 0)


def test_a_unit_of_something_else_is_no_match():
    assert "t [mm]" not in {
        name for name, one in offer({"t [mm]": WAVE, "F [N]": WAVE}).items() if one.ours == "time_s"
    }
    assert unit_said("pressure (bar)") == "bar" and unit_said("weg [µm]") == "um" and unit_said("x") == ""


def test_a_unit_to_be_calibrated_is_offered_with_its_place_for_the_factor():
    rising = np.arange(5.0)
    offered = offered_renames({"Time [s]": rising, "Load [kN]": rising, "LVDT (V)": rising})
    assert "LVDT (V)=deformation_mm*FACTOR+OFFSET" in offered


def test_a_lone_t_is_the_time_where_it_goes_evenly_and_a_temperature_elsewhere():
    """Its name says neither; one that warms in uneven steps rises as a clock does, too."""
    rest = {"F": 5 * WAVE, "d": WAVE}
    trembling = T + np.random.default_rng(3).normal(0.0, 0.01, len(T))
    assert [offer({"T": clock} | rest)["T"].ours for clock in (T, trembling)] == ["time_s"] * 2
    warming = 15.0 + np.cumsum(np.random.default_rng(3).exponential(0.01, len(T)))
    assert [offer({"T": warm} | rest)["T"].ours for warm in (15 + WAVE, warming)] == ["temperature_degC"] * 2
    assert offered_renames({"T": 15 + WAVE} | rest) == []  # nothing here is the time
    both = offer({"T": 15 + WAVE, "time": T} | rest)
    assert (both["T"].ours, both["time"].ours) == ("temperature_degC", "time_s")
