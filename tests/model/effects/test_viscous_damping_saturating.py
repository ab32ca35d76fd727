"""A dashpot at small rates, one force at large ones."""

import numpy as np
import pytest

from thrustd.model.effects.viscous_damping_saturating import EFFECT

DT_S = 0.001
LAW = {"damping_n_s_mm": 400.0, "saturates_mm_s": 0.5, "sharpness": 2.5, "filter_s": 0.005}


@pytest.mark.parametrize(("rate_mm_s", "expected_n"), [(0.01, 4.0), (-0.01, -4.0), (20.0, 200.0), (-20.0, -200.0)])
def test_force_at_a_steady_rate(rate_mm_s: float, expected_n: float) -> None:
    d = rate_mm_s * DT_S * np.arange(1000)
    force = EFFECT.stage(LAW, DT_S).from_rest({"deformation_mm": d}, np.zeros(len(d)))
    assert force[-1] == pytest.approx(expected_n, rel=1e-3)
