"""Anyone's columns in the two roles, with their own names and units in every sentence."""

import numpy as np
import pytest

from thrustd.core.errors import RecordingError
from thrustd.records.recording import make_recording, no_column
from thrustd.records.roles import Roles, roles_of, units_trusted, with_roles, with_trusted_units


def rig():
    t = np.arange(50.0)
    return make_recording("rig.csv", {"time_s": t, "travel_cm": t, "Load [tonf]": 2 * t, "oil_bar": 0 * t})


def test_the_columns_take_the_roles_and_leave_no_copy_that_would_explain_everything():
    record = with_roles(rig(), Roles("travel_cm", "Load [tonf]"))
    assert sorted(record.channels) == ["deformation_mm", "force_N", "oil_bar"]
    assert record["force_N"][3] == 6.0
    assert roles_of([record]) == Roles("travel_cm", "Load [tonf]")


@pytest.mark.parametrize(
    ("output", "unit"),
    [("force_N", "N"), ("Load [tonf]", "tonf"), ("p_kPa", "kPa"), ("f_kN", "kN"), ("level_V", "V"), ("y", "")],
)
def test_units_are_those_of_the_names(output, unit):
    assert Roles("x", output).output_unit == unit


def test_a_mounts_own_file_needs_no_other_words():
    assert roles_of([rig()]).own and roles_of([]).own
    assert Roles("x", "y").in_words("force_N over deformation_mm") == "y over x"


def test_a_column_that_is_not_there_is_refused_with_the_nearest_names():
    with pytest.raises(RecordingError, match=r"no column 'load \[tonf\]'; it has .*; did you mean Load \[tonf\]\?"):
        with_roles(rig(), Roles("travel_cm", "load [tonf]"))
    assert "meant" not in no_column("f", "zzz", ["force_N"])


def test_one_column_has_one_role():
    with pytest.raises(RecordingError, match="'travel_cm' is input and output"):
        with_roles(rig(), Roles("travel_cm", "travel_cm"))


def test_trust_is_said_of_a_recording():
    assert units_trusted(with_trusted_units(rig())) and not units_trusted(rig())


def test_an_output_without_a_unit_is_called_by_its_column():
    assert Roles("travel_cm", "force").unit == "(force)"
    assert Roles("travel_cm", "Load [tonf]").unit == "tonf"


def test_units_of_parameters_are_those_of_the_columns():
    assert Roles("travel_cm", "force").measured_in("N s/mm") == "(force) s/cm"
    assert Roles().measured_in("N s/mm") == "N s/mm"
