"""A body that heat has to be conducted into, beside the closed solution of a slab (Carslaw & Jaeger, ch. 3)."""

import numpy as np
import pytest

from thrustd.model.effects import effect_named

DT_S, LAG_S = 1.0, 400.0
WARM = np.where(np.arange(4000) < 100, 20.0, 30.0)


def slab(after_s):
    """Mean temperature's share of a step of its faces, of 200 modes."""
    order = 2.0 * np.arange(200) + 1.0
    left = 8.0 / (np.pi * order) ** 2 * np.exp(-np.maximum(after_s, 0.0)[:, None] * order**2 / LAG_S)
    return 1.0 - left.sum(axis=1)


def shift(surface_s):
    law = effect_named("thermal_expansion_body")
    told = {"expansion_mm_k": 0.01, "reference_degc": 20.0, "lag_s": LAG_S, "surface_s": surface_s}
    stage = law.stage(law.neutral() | told, DT_S)
    return -stage.run(stage.start(WARM[:1], 0.0), WARM[:, None], np.zeros(len(WARM))) / 0.1


def test_it_warms_as_a_slab_does():
    after_s = np.arange(len(WARM)) - 99.0
    assert shift(0.01)[100:] == pytest.approx(slab(after_s)[100:], abs=0.03)
    assert shift(0.01)[130:] == pytest.approx(slab(after_s)[130:], abs=0.003)


def test_its_surface_may_warm_after_its_sensor():
    late_s = float(np.sum(1.0 - shift(150.0)[100:])) * DT_S
    assert late_s == pytest.approx(150.0 + LAG_S * np.pi**2 / 12, rel=0.01)
    assert np.all(shift(150.0)[:100] == 0.0)


@pytest.mark.parametrize("law", ["thermal_stiffness_body", "thermal_stiffness_body_spring"])
def test_stiffness_follows_the_same_temperature(law):
    told = {"stiffness_1_k": -0.01, "reference_degc": 20.0, "bend": 1.0, "lag_s": LAG_S, "surface_s": 30.0}
    stage = effect_named(law).stage(effect_named(law).neutral() | told, DT_S)
    found = stage.run(stage.start(WARM[:1], 1.0), WARM[:, None], np.ones(len(WARM)))
    y = -0.1 * shift(30.0)
    assert found == pytest.approx(1.0 + y + 0.5 * y * y, rel=1e-12)


@pytest.mark.parametrize("law", ["thermal_expansion_late", "thermal_expansion_body"])
def test_a_record_may_begin_when_its_sensor_is_warm_already_and_the_rubber_is_not(law):
    """In a room of the reference, the sensor warm since this moment, it does as it would if recorded from before."""
    effect, before = effect_named(law), 20
    told = {"expansion_mm_k": 0.01, "reference_degc": 20.0, "lag_s": LAG_S, "surface_s": 30.0}
    warm = np.where(np.arange(600) < before, 20.0, 45.0)[:, None]

    def run(t_degc, **given):
        stage = effect.stage(effect.neutral() | told | given, DT_S)
        return stage.run(stage.start(t_degc[0], 0.0), t_degc, np.zeros(len(t_degc)))

    assert run(warm[before:], begin_share=1.0) == pytest.approx(run(warm)[before:], abs=1e-12)
    assert run(warm[before:])[0] == pytest.approx(-0.25)
