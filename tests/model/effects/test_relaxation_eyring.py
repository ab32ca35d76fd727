"""Branches that flow under load, against the differential equation of each."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from thrustd.model.effects import effect_named
from thrustd.model.effects.relaxation_eyring import EFFECT
from thrustd.model.effects.relaxation_maxwell import STIFFNESSES, ladder

DT_S = 0.02
T_S = np.arange(1000) * DT_S
D = 0.5 * np.sin(0.7 * T_S) + 0.02 * T_S
SLOW = {"fastest_s": 0.5, "slowest_s": 500.0, STIFFNESSES[4]: 300.0, STIFFNESSES[7]: 120.0}


def run(p, d=D, dt_s=DT_S):
    return EFFECT.stage(EFFECT.neutral() | p, dt_s).from_rest({"deformation_mm": d}, np.zeros(len(d)))


@pytest.mark.parametrize("flow_mm", [0.03, 0.2])
def test_every_branch_is_a_spring_behind_a_dashpot_that_gives_way_under_load(flow_mm):
    expected = np.zeros(len(D))
    for name in (STIFFNESSES[4], STIFFNESSES[7]):
        tau = ladder(SLOW)[STIFFNESSES.index(name)]

        def rate(t, e, tau=tau):
            along = (np.interp(t + DT_S / 8, T_S, D) - np.interp(t - DT_S / 8, T_S, D)) / (DT_S / 4)
            return along - flow_mm / tau * np.sinh(e / flow_mm)

        expected += SLOW[name] * solve_ivp(rate, (0.0, T_S[-1]), [0.0], t_eval=T_S, max_step=DT_S / 4, rtol=1e-8).y[0]
    found = run(SLOW | {"flow_mm": flow_mm})
    assert found == pytest.approx(expected, abs=3e-3 * np.abs(expected).max())


def test_far_below_the_stretch_that_flows_it_is_a_maxwell_branch():
    maxwell = effect_named("relaxation_maxwell")
    linear = maxwell.stage(maxwell.neutral() | SLOW, DT_S).from_rest({"deformation_mm": D}, np.zeros(len(D)))
    assert run(SLOW | {"flow_mm": 1e3}) == pytest.approx(linear, abs=1e-3 * np.abs(linear).max())


def test_a_larger_step_loses_a_larger_share_at_once_and_no_step_is_too_large():
    def left_after_a_second(mm):
        out = run(SLOW | {"flow_mm": 0.05}, np.r_[0.0, np.full(51, mm)])
        return out[-1] / (mm * (300.0 + 120.0))

    in_proportion = sum(
        SLOW[k] * np.exp(-1.0 / tau) for tau, k in zip(ladder(SLOW), STIFFNESSES, strict=True) if k in SLOW
    )
    assert left_after_a_second(0.01) == pytest.approx(in_proportion / 420.0, rel=0.01)
    assert left_after_a_second(0.5) < 0.7
    assert np.isfinite(run(SLOW | {"flow_mm": 1e-6, "slowest_s": 1e9}, np.r_[0.0, np.full(9, 1e9), -1e9])).all()


def test_it_delivers_no_energy():
    x = np.cumsum(np.random.default_rng(0).standard_normal(5000)) * 0.01
    back = np.r_[x, x[::-1]]
    force = run(SLOW | {"flow_mm": 0.05}, back)
    assert np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(back)) > 0.0
