"""A joint that closes at a load: what a mount and its joint in series read, the effect turns back into the rubber's."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from thrustd.model.effects.free_play_taken_up import EFFECT

DT_S = 0.05


def _readings(rubber: np.ndarray, p: dict[str, float]) -> np.ndarray:
    """x = r + gap * s of the rubber's own load, sample by sample."""
    lag, share = rubber[0], -np.expm1(-DT_S / p["fades_s"])
    found = []
    for r in rubber:
        lag += share * (r - lag)
        load = r + p["fading"] * (r - lag)
        found.append(r + p["gap_mm"] * np.clip((load - p["taken_up_mm"]) / p["width_mm"] + 0.5, 0.0, 1.0))
    return np.array(found)


@given(
    st.floats(0.0, 0.2), st.floats(-0.3, 1.3), st.floats(0.005, 0.5), st.floats(0.0, 1.0), st.floats(0.1, 1000.0),
    st.integers(0, 2**32 - 1),
)  # fmt: skip
def test_the_rubber_comes_back_from_the_reading(
    gap: float, taken_up: float, width: float, fading: float, fades_s: float, seed: int
) -> None:
    p = {"gap_mm": gap, "taken_up_mm": taken_up, "width_mm": width, "fading": fading, "fades_s": fades_s}
    rng = np.random.default_rng(seed)
    rubber = np.concatenate((np.zeros(5), np.cumsum(rng.normal(0.0, 0.05, 300))))
    readings = _readings(rubber, p)
    stage = EFFECT.stage(p, DT_S)
    found = stage.run(stage.start(np.zeros(0), float(readings[0])), np.empty((len(readings), 0)), readings)
    np.testing.assert_allclose(found, rubber, atol=1e-9)
