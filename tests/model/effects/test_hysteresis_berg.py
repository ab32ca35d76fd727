"""Berg's friction against his own two branches."""

import numpy as np
import pytest

from thrustd.model.effects.hysteresis_berg import EFFECT

F_MAX, X2 = 110.0, 0.02


def berg(x: np.ndarray) -> np.ndarray:
    """The force in his notation: x_s, F_s where the motion last turned, a = F_s / F_max."""
    x_s = f_s = force = 0.0
    up, out = None, []
    for old, new in zip(np.concatenate(([0.0], x[:-1])), x, strict=True):
        if new != old and bool(new > old) != up:
            x_s, f_s, up = old, force, bool(new > old)
        a = f_s / F_MAX
        if up:
            force = f_s + (new - x_s) * (F_MAX - f_s) / (X2 * (1 - a) + (new - x_s))
        elif up is False:
            force = f_s + (new - x_s) * (F_MAX + f_s) / (X2 * (1 + a) - (new - x_s))
        out.append(force)
    return np.array(out)


def test_every_branch_is_bergs_whatever_the_steps():
    rng = np.random.default_rng(3)
    x = np.cumsum(rng.normal(0.0, 0.01, 400))
    x[0] = 0.0
    stage = EFFECT.stage({"friction_n": F_MAX, "yield_mm": X2, "deadband_mm": 0.0}, 0.05)
    state = stage.start(x[:1], 1000.0)
    found = np.array([stage.step(state, stage.c, x[k : k + 1], 1000.0) for k in range(len(x))])
    assert found - 1000.0 == pytest.approx(berg(x), abs=1e-6 * F_MAX)
    assert np.abs(berg(x)).max() > 0.8 * F_MAX
