"""Stiffness over temperature: from a straight line to an exponential."""

import numpy as np
import pytest

from thrustd.model.effects import effect_named


@pytest.mark.parametrize("law", ["thermal_stiffness", "thermal_stiffness_late", "thermal_stiffness_spring"])
def test_a_bend_of_one_is_an_exponential_for_40_k(law: str) -> None:
    effect, settled_s = effect_named(law), 20_000
    for kelvin in (-40.0, 0.0, 40.0):
        t_degc = np.concatenate(([20.0], np.full(settled_s, 20.0 + kelvin)))[:, None]
        p = effect.neutral() | {"stiffness_1_k": -0.0035, "reference_degc": 20.0, "bend": 1.0}
        stage = effect.stage(p, 1.0)
        gain = stage.run(stage.start(t_degc[0], 1.0), t_degc, np.ones(len(t_degc)))[-1]
        assert gain == pytest.approx(np.exp(-0.0035 * kelvin), abs=6e-4)  # the third order
        straight = effect.stage(p | {"bend": 0.0}, 1.0)
        assert straight.run(straight.start(t_degc[0], 1.0), t_degc, np.ones(len(t_degc)))[-1] == pytest.approx(
            1.0 - 0.0035 * kelvin
        )
