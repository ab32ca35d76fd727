"""Bouc-Wen's model with exponent and skew, against its differential equation solved to a millionth."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from thrustd.model.effects.hysteresis import EFFECT as USUAL
from thrustd.model.effects.hysteresis_bouc_wen import EFFECT

FRICTION_N, YIELD_MM = 100.0, 0.05


def run(effect, x, **shape):
    parameters = {"friction_n": FRICTION_N, "yield_mm": YIELD_MM, "deadband_mm": 0.0} | shape
    stage = effect.stage(parameters, 0.05)
    state = stage.start(x[:1], 0.0)
    return np.array([stage.step(state, stage.c, x[k : k + 1], 0.0) for k in range(len(x))])


def solved(x, gamma, exponent):
    """Force (n,) at readings x (n,), mm, by a solver of its own."""
    z, force = 0.0, [0.0]
    for dx in np.diff(x):
        sign = np.sign(dx)

        def slope(_, y, sign=sign):
            loading = (1.0 - abs(gamma)) * np.sign(y[0] * sign) + gamma
            return [sign * (1.0 - abs(y[0]) ** exponent * loading) / YIELD_MM]

        z = float(solve_ivp(slope, (0.0, abs(dx)), [z], rtol=1e-7, atol=1e-9, max_step=YIELD_MM / 20).y[0, -1])
        force.append(FRICTION_N * z)
    return np.array(force)


def swept(most):
    return most * np.concatenate([np.linspace(0, 1, 40), np.linspace(1, -0.6, 60)[1:], np.linspace(-0.6, 0.8, 50)[1:]])


@pytest.mark.parametrize(("gamma", "exponent"), [(0.3, 2.0), (0.7, 1.0), (-0.3, 1.5), (-0.58, 1.0)])
def test_it_solves_its_equation(gamma, exponent):
    x = swept(0.3)
    expected = solved(x, gamma, exponent)
    assert run(EFFECT, x, gamma=gamma, exponent=exponent) == pytest.approx(expected, abs=2e-3 * np.abs(expected).max())


def test_with_the_usual_exponent_and_skew_it_is_the_usual_law():
    x = swept(0.3)
    assert run(EFFECT, x, gamma=0.5, exponent=1.0) == pytest.approx(run(USUAL, x), abs=2e-3 * FRICTION_N)


def test_a_sample_that_moves_by_much_ends_where_friction_slips():
    assert run(EFFECT, np.array([0.0, 40.0]), gamma=0.3, exponent=2.0)[-1] == pytest.approx(FRICTION_N, rel=1e-3)
    assert np.isfinite(run(EFFECT, 40.0 * np.sin(np.arange(200.0)), gamma=-0.9, exponent=8.0)).all()
