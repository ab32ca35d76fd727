"""Units are part of the name, also outside the catalogue."""

import pytest

from thrustd.records.recording import unit_of


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("n1_pct_left", "%"),
        ("deformation_mm_left_upper", "mm"),
        ("tas_m_s", "m/s"),
        ("roll_rate_deg_s", "deg/s"),
        ("hydraulic_pressure_bar", "bar"),
        ("flap_handle", ""),
    ],
)
def test_unit_of(name, unit):
    assert unit_of(name) == unit
