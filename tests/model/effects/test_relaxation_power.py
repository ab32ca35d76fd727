"""Branches that flow under load, against the differential equation of each."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from thrustd.model.effects import effect_named
from thrustd.model.effects.relaxation_maxwell import STIFFNESSES, ladder
from thrustd.model.effects.relaxation_power import EFFECT

DT_S = 0.02
T_S = np.arange(1000) * DT_S
D = 0.5 * np.sin(0.7 * T_S) + 0.02 * T_S
SLOW = {"fastest_s": 0.5, "slowest_s": 500.0, STIFFNESSES[4]: 300.0, STIFFNESSES[7]: 120.0}


def run(p, d=D, dt_s=DT_S):
    return EFFECT.stage(EFFECT.neutral() | p, dt_s).from_rest({"deformation_mm": d}, np.zeros(len(d)))


@pytest.mark.parametrize(("flow_mm", "power"), [(0.05, 4.0), (0.2, 1.5), (0.15, 9.0)])
def test_every_branch_is_a_spring_behind_a_dashpot_that_gives_way_under_load(flow_mm, power):
    expected = np.zeros(len(D))
    for name in (STIFFNESSES[4], STIFFNESSES[7]):
        tau = ladder(SLOW)[STIFFNESSES.index(name)]

        def rate(t, e, tau=tau):
            along = (np.interp(t + DT_S / 8, T_S, D) - np.interp(t - DT_S / 8, T_S, D)) / (DT_S / 4)
            return along - flow_mm / tau * np.sign(e) * np.abs(e / flow_mm) ** power

        expected += SLOW[name] * solve_ivp(rate, (0.0, T_S[-1]), [0.0], t_eval=T_S, max_step=DT_S / 4, rtol=1e-8).y[0]
    found = run(SLOW | {"flow_mm": flow_mm, "power": power})
    assert found == pytest.approx(expected, abs=3e-3 * np.abs(expected).max())


def test_in_proportion_it_is_a_maxwell_branch():
    maxwell = effect_named("relaxation_maxwell")
    linear = maxwell.stage(maxwell.neutral() | SLOW, DT_S).from_rest({"deformation_mm": D}, np.zeros(len(D)))
    almost = run(SLOW | {"flow_mm": 0.3, "power": 1.01})
    assert almost == pytest.approx(linear, abs=0.02 * np.abs(linear).max())


def test_of_a_larger_step_a_smaller_share_is_left_and_no_step_is_too_large():
    """Alone, e = e_0 (1 + (m - 1) (e_0 / s)^(m - 1) t / tau)^(-1 / (m - 1))."""
    tau, p = ladder(SLOW)[4], {STIFFNESSES[7]: 0.0, "flow_mm": 0.05, "power": 4.0}
    for mm in (0.001, 0.05, 0.5):
        out = run(SLOW | p, np.r_[0.0, np.full(51, mm)])
        left = out[1:] / 300.0
        assert left == pytest.approx(left[0] * (1.0 + 3.0 * (left[0] / 0.05) ** 3 * T_S[:51] / tau) ** (-1.0 / 3.0))
    assert left[-1] < 0.2 * left[0]
    assert np.isfinite(run(SLOW | {"flow_mm": 1e-6, "power": 30.0}, np.r_[0.0, np.full(9, 1e9), -1e9])).all()


def test_it_delivers_no_energy():
    x = np.cumsum(np.random.default_rng(0).standard_normal(5000)) * 0.01
    back = np.r_[x, x[::-1]]
    force = run(SLOW | {"flow_mm": 0.05, "power": 4.0}, back)
    assert np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(back)) > 0.0
