"""The damage below the largest deformation, for any power."""

import numpy as np
import pytest

from thrustd.model.effects import effect_named


@pytest.mark.parametrize("exponent", [0.5, 1.0, 2.0])
def test_the_spring_is_virgin_on_the_way_up_and_softened_below(exponent):
    x = np.concatenate((np.linspace(0.0, 1.0, 50), np.linspace(1.0, 0.2, 50), np.linspace(0.2, 1.2, 50)))
    p = {"softening": 0.1, "m_mm": 0.3, "known_max_mm": 0.0, "exponent": exponent}
    stage = effect_named("mullins_softening_spring").stage(p, 0.05)
    u, v = x[:, None], np.full(len(x), 1.0)
    below = np.maximum.accumulate(x) - x
    kept = 1.0 - 0.1 * (1.0 - np.exp(-((below / 0.3) ** exponent)))
    assert stage.run(stage.start(u[0], v[0]), u, v) == pytest.approx(kept, rel=1e-12)
    assert kept.min() < 0.95
    assert np.all(kept[x >= np.maximum.accumulate(x)] == 1.0)
