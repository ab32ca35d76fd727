"""Figures of PH-LAB stand only beside a mount of its size."""

import pytest

from tests.diagnose.scene import record
from thrustd.diagnose.compare.scale import is_phlab_size
from thrustd.records.roles import Roles, with_roles


def test_a_mount_of_its_size_is_one():
    assert is_phlab_size([record(n=2000)])


@pytest.mark.parametrize("factors", [{"force_N": 12.0}, {"force_N": 0.01}, {"deformation_mm": 20.0}])
def test_another_order_of_magnitude_is_none(factors):
    base = record(n=2000)
    assert not is_phlab_size([base.with_channels(**{n: base[n] * f for n, f in factors.items()})])


def test_columns_of_another_name_are_none():
    base = record(n=2000)
    assert not is_phlab_size([with_roles(base.with_channels(y=base["force_N"]), Roles("deformation_mm", "y"))])
    assert not is_phlab_size([]) and not is_phlab_size([base.select(["deformation_mm"])])
