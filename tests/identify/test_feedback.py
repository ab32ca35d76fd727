"""Nonlinear feedback around a linear block: found where it is, and said where it is not."""

import numpy as np
import pytest

from thrustd.identify.identify import identify
from thrustd.model.artifact import read_model, write_model
from thrustd.model.compile import check_witness
from thrustd.records.recording import make_recording

RATE_HZ, NOISE = 50.0, 0.003


def spring(seed, hardening, n=3000):
    """y'' + 1.5 y' + 60 (y + hardening y^3) = 60 u by small steps."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1, 1, n // 15), 15)
    y, v, out = 0.0, 0.0, np.empty(n)
    for k in range(n):
        out[k] = y
        for _ in range(20):
            v += (60 * (u[k] - y - hardening * y**3) - 1.5 * v) / RATE_HZ / 20
            y += v / RATE_HZ / 20
    noisy = out + NOISE * rng.normal(size=n)
    return make_recording(f"{seed}", {"time_s": np.arange(n) / RATE_HZ, "deformation_mm": u, "force_N": noisy})


def test_a_hardening_spring_is_found_in_free_run():
    found = identify([spring(1, 0.4)], [spring(2, 0.4)], ["oe-2-2", "feedback"])
    linear, fed = (score.validation.rmse_n for score in found.scores)
    assert fed < 0.15 * linear
    assert found.spec.structure == "feedback"
    check_witness(read_model(write_model(found.spec), "model"), "model")


def test_a_linear_spring_stays_as_good_as_linear():
    found = identify([spring(1, 0.0, 1500)], [spring(2, 0.0)], ["oe-2-2", "feedback"])
    linear, fed = (score.validation.rmse_n for score in found.scores)
    assert fed == pytest.approx(linear, rel=0.1)
