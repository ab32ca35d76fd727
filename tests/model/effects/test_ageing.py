"""Ageing by a dose of heat, and by the logarithm of time: against closed forms of the textbooks."""

import numpy as np
import pytest

from thrustd.model.effects import effect_named

DT_S = 10.0


def _gain(name, p, columns):
    """A force of 1 N with the effect, from the first row on."""
    effect = effect_named(name)
    stage = effect.stage(effect.neutral() | p, DT_S)
    return stage.run(stage.start(columns[0], 1.0), columns, np.ones(len(columns)))


def test_at_room_temperature_a_dose_is_the_hours():
    time_s = np.arange(0.0, 7200.0, DT_S)
    found = _gain(
        "ageing_arrhenius",
        {"ageing_1_h": 0.05, "settling_h": 0.2},
        np.column_stack((time_s, np.full(len(time_s), 23.0))),
    )
    np.testing.assert_allclose(found, 1.0 + 0.01 * np.log1p(time_s / 3600.0 / 0.2), rtol=1e-12)


def test_warm_hours_count_as_arrhenius_says():
    """52 kJ/mol between 23 and 33 degC: twice as fast ten kelvins warmer (Celina 2005)."""
    time_s = np.arange(0.0, 7200.0, DT_S)
    p = {"ageing_1_h": 0.01, "settling_h": 10000.0, "activation_kj_mol": 52.25}
    room, warm = (
        _gain("ageing_arrhenius", p, np.column_stack((time_s, np.full(len(time_s), t)))) - 1.0 for t in (23.0, 33.0)
    )
    assert warm[-1] / room[-1] == pytest.approx(2.0, abs=2e-3)


def test_a_dose_begun_before_the_record_goes_on():
    """Constant temperature: whether it is run from the reference on or begun later, the gain is the same."""
    time_s = np.arange(0.0, 7200.0, DT_S)
    columns = np.column_stack((time_s, np.full(len(time_s), 40.0)))
    p = {"ageing_1_h": 0.05, "settling_h": 0.5, "reference_s": 600.0}
    whole, half = (_gain("ageing_arrhenius", p, columns[skip:]) for skip in (0, 360))
    np.testing.assert_allclose(half, whole[360:], rtol=1e-12)
    assert (whole[:61] == 1.0).all()


def test_every_tenfold_of_time_is_worth_as_much():
    time_s = np.array([-50.0, 0.0, 540.0, 5940.0, 59_940.0])
    found = _gain("ageing_logarithm", {"ageing_per_decade": 0.02, "start_s": 60.0}, time_s[:, None])
    np.testing.assert_allclose(found, [1.0, 1.0, 1.02, 1.04, 1.06], rtol=1e-12)
