"""The standard atmosphere against the tables of ISO 2533; numbers and arrays alike."""

import numpy as np
import pytest

from thrustd.core import atmosphere as air

TABLE = ((0.0, 288.15, 101325.0), (5000.0, 255.65, 54019.9), (11000.0, 216.65, 22632.0), (15000.0, 216.65, 12044.6))


@pytest.mark.parametrize(("altitude_m", "static_k", "pressure_pa"), TABLE)
def test_it_is_that_of_the_standard(altitude_m, static_k, pressure_pa):
    """Geopotential altitudes; the constants are rounded to six figures."""
    assert air.isa_k(altitude_m) == pytest.approx(static_k)
    assert air.static_pressure_pa(altitude_m) == pytest.approx(pressure_pa, rel=2e-4)


def test_numbers_and_arrays_are_one():
    altitudes_m, mach = np.array([row[0] for row in TABLE]), np.array([0.0, 0.2, 0.5, 0.8])
    for function in (air.dynamic_pressure_pa, air.total_pressure_ratio):
        one_by_one = [function(m, h) for m, h in zip(mach.tolist(), altitudes_m.tolist(), strict=True)]
        assert function(mach, altitudes_m).tolist() == one_by_one


def test_dynamic_pressure_and_sound():
    assert air.dynamic_pressure_pa(0.5, 0.0) == pytest.approx(17732, rel=1e-3)
    assert air.dynamic_pressure_pa(1.0, 13700.0) == pytest.approx(0.7 * 14779, rel=2e-3)
    assert air.sound_m_s(288.15) == pytest.approx(340.294, rel=1e-5)
    assert np.isnan(air.dynamic_pressure_pa(float("nan"), 0.0))
