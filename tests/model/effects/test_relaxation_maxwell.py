"""Maxwell branches beside the spring, against the differential equation of each."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from thrustd.model.effects import effect_named
from thrustd.model.effects.relaxation_maxwell import EFFECT, STIFFNESSES, ladder

DT_S = 0.05
T_S = np.arange(400) * DT_S
D = 0.5 * np.sin(0.7 * T_S) + 0.2 * T_S
STIFFNESS = {"fastest_s": 0.1, "slowest_s": 50.0, STIFFNESSES[1]: 300.0, STIFFNESSES[4]: 120.0}


def test_every_branch_is_a_spring_behind_a_dashpot():
    """On a deformation that is a ramp between samples the discretisation is exact."""
    found = EFFECT.stage(EFFECT.neutral() | STIFFNESS, DT_S).from_rest({"deformation_mm": D}, np.zeros(len(D)))
    expected = np.zeros(len(D))
    for name in (STIFFNESSES[1], STIFFNESSES[4]):
        tau = ladder(STIFFNESS)[STIFFNESSES.index(name)]

        def lags(t, s, tau=tau):
            return (np.interp(t, T_S, D) - s) / tau

        lag = solve_ivp(lags, (0.0, T_S[-1]), [D[0]], t_eval=T_S, max_step=DT_S / 4, rtol=1e-9, atol=1e-11).y[0]
        expected += STIFFNESS[name] * (D - lag)
    assert found == pytest.approx(expected, abs=1e-4 * np.abs(expected).max())


def test_it_relaxes_to_nothing_and_a_gain_turns_it_with_the_rubber():
    stage = EFFECT.stage(EFFECT.neutral() | STIFFNESS, DT_S)
    held = stage.from_rest({"deformation_mm": np.r_[0.0, np.ones(20_000)]}, np.zeros(20_001))
    assert held[1] > 300.0 and abs(held[-1]) < 1e-6
    assert (EFFECT.site, effect_named("thermal_stiffness").site) == ("linear", "gain")
