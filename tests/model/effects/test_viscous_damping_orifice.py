"""A dashpot at small rates, an orifice at large ones."""

import numpy as np
import pytest

from thrustd.model.effects.viscous_damping_orifice import EFFECT

DT_S = 0.001
LAW = {"damping_n_s_mm": 400.0, "orifice_n_s2_mm2": 2000.0, "filter_s": 0.005}


@pytest.mark.parametrize(("rate_mm_s", "expected_n"), [(0.001, 0.402), (-0.1, -60.0), (0.2, 160.0), (2.0, 8800.0)])
def test_force_at_a_steady_rate(rate_mm_s: float, expected_n: float) -> None:
    d = rate_mm_s * DT_S * np.arange(1000)
    force = EFFECT.stage(LAW, DT_S).from_rest({"deformation_mm": d}, np.zeros(len(d)))
    assert force[-1] == pytest.approx(expected_n, rel=1e-6)
