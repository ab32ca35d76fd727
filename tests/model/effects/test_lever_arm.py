"""The lever arm takes out what the twin, which has it from its own code, puts in."""

import numpy as np

from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.model.effects import effect_named
from thrustd.model.stage import free_run
from thrustd.twin.installation import PLAIN, felt_g

DT_S, MASS_KG = 0.01, 180.0
ARM_M = (2.0, 1.5, -0.4)  # forward, right, up: the twin's


def test_mass_times_what_the_sensor_feels_is_corrected_to_what_the_engine_feels():
    time_s = np.arange(0.0, 40.0, DT_S)
    rates = np.stack([8 * np.sin(0.7 * time_s), 20 * np.sin(0.4 * time_s + 1), 6 * np.cos(0.9 * time_s)])
    true_g = np.stack([0.05 * np.sin(0.2 * time_s), np.zeros_like(time_s), np.ones_like(time_s)])
    felt = felt_g(true_g, rates, time_s, PLAIN._replace(arm_m=ARM_M))
    weight_n = MASS_KG * STANDARD_GRAVITY_M_S2
    before_n = weight_n * (felt[0] - true_g[0])
    moments = dict(zip(("forward_kg_m", "right_kg_m", "down_kg_m"), MASS_KG * np.array(ARM_M), strict=True))
    moments["down_kg_m"] *= -1.0
    stage = effect_named("lever_arm").stage(moments | {"filter_s": 0.01}, DT_S)
    names = ("pitch_rate_deg_s", "roll_rate_deg_s", "yaw_rate_deg_s")
    after_n = free_run([stage], dict(zip(names, rates, strict=True)), weight_n * felt[0]) - weight_n * true_g[0]
    assert np.sqrt(np.mean(before_n**2)) > 20.0
    assert np.sqrt(np.mean(after_n[100:] ** 2)) < 0.05 * np.sqrt(np.mean(before_n**2))
