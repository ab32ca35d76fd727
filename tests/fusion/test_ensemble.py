"""The ensemble that judges the band: installations drawn from the sigmas of the aircraft's file."""

import numpy as np
import pytest

from benchmarks.fusion_ensemble import drawn
from thrustd.installation.installation import read_installation
from thrustd.installation.shipped import shipped


def test_drawn_installations_err_as_the_aircrafts_file_says():
    aircraft = read_installation(shipped("deploy/hil.toml", "config")).aircraft()
    known, knobs = aircraft.installation, [drawn(aircraft, seed) for seed in range(400)]
    left = np.array([(each.zero_mm[0], each.scale[0], each.drag_m2, each.expansion_mm_k) for each in knobs])
    zero_n, scale, drag_m2, temperature_n = left.std(axis=0) * (sum(aircraft.spring_n_mm), 1.0, 1.0, 20.0 * 11033.0)
    found = zero_n / known.zero_n, scale / known.scale, drag_m2 / known.drag_m2, temperature_n / known.temperature_n
    assert found == pytest.approx((1.0,) * 4, rel=0.12)  # 400 drawn: 3.5 % is one sigma
    assert all(each.zero_mm[0] == each.zero_mm[1] != each.zero_mm[2] for each in knobs)
