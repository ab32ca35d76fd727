"""Shaken and left alone: the network breaks with one time constant and heals with another."""

import numpy as np
import pytest

from thrustd.model.effects import effect_named

P = {"softening": 0.1, "vibration_c_mm_s": 10.0, "exponent_m": 0.5, "breakdown_s": 4.0, "recovery_s": 150.0}
DT_S = 0.05


def test_breaks_within_seconds_and_heals_within_minutes():
    t = np.arange(0.0, 400.0, DT_S)
    vibration = np.where((t > 10.0) & (t < 100.0), 30.0, 0.0)
    stage = effect_named("payne_recovering").stage(P, DT_S)
    u, v = vibration[:, None], np.full(len(t), 5000.0)
    softened = 1.0 - stage.run(stage.start(u[0], v[0]), u, v) / v
    settled = 0.1 * 3.0 / 4.0  # (V / Vc)^2m = 3
    broken, healed = (t > 10.0) & (t < 100.0), t >= 100.0
    assert softened[t <= 10.0] == pytest.approx(0.0, abs=1e-12)
    assert softened[broken] == pytest.approx(settled * -np.expm1((10.0 - t[broken]) / 4.0), rel=1e-9)
    left = softened[broken][-1] * np.exp((100.0 - DT_S - t[healed]) / 150.0)
    assert softened[healed] == pytest.approx(left, rel=1e-9)


def test_where_it_takes_no_time_it_is_kraus_law():
    rng = np.random.default_rng(1)
    u, v = np.abs(rng.normal(0.0, 20.0, 300))[:, None], np.full(300, 5000.0)
    at_once = effect_named("payne").stage(P, DT_S)
    quick = effect_named("payne_recovering").stage(P | {"breakdown_s": 1e-3, "recovery_s": 1e-3}, DT_S)
    found = quick.run(quick.start(u[0], v[0]), u, v)
    assert found == pytest.approx(at_once.run(at_once.start(u[0], v[0]), u, v), rel=1e-9)
