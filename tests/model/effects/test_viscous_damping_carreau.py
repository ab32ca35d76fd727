"""A dashpot at small rates, a power of the rate at large ones; its size is the force at the usual rate."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from thrustd.model.effects import shelf

DT_S = 0.001
LAW = {"damping_n": 30.0, "usual_mm_s": 0.1, "exponent": 0.6, "slow_mm_s": 0.001, "filter_s": 0.005}


def at_steady_rate(rate_mm_s: float, law: str = "viscous_damping_carreau", **other: float) -> float:
    d = rate_mm_s * DT_S * np.arange(1000)
    stage = shelf()[law].stage(other if law.endswith("power") else LAW | other, DT_S)
    return float(stage.from_rest({"deformation_mm": d}, np.zeros(len(d)))[-1])


@given(st.floats(0.1, 3.0), st.floats(1e-4, 10.0), st.floats(1e-3, 10.0))
def test_the_size_is_the_force_at_the_usual_rate(exponent: float, slow: float, usual: float) -> None:
    law = {"exponent": exponent, "slow_mm_s": slow, "usual_mm_s": usual}
    assert at_steady_rate(usual, **law) == pytest.approx(30.0, rel=1e-6)
    assert at_steady_rate(-usual, **law) == pytest.approx(-30.0, rel=1e-6)


def test_far_above_the_slow_rate_it_is_a_power_of_the_rate() -> None:
    assert at_steady_rate(1.0) == pytest.approx(30.0 * 10.0**0.6, rel=1e-3)
    power = {"damping_n": 30.0 * 10.0**0.6, "exponent": 0.6, "filter_s": 0.005}
    assert at_steady_rate(3.0) == pytest.approx(at_steady_rate(3.0, "viscous_damping_power", **power), rel=1e-3)


def test_far_below_it_is_a_dashpot() -> None:
    assert at_steady_rate(2e-5) == pytest.approx(2.0 * at_steady_rate(1e-5), rel=1e-3)
