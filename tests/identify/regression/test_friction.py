"""Which law the own friction of a mount obeys, and what a model of it is worth on another record."""

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from tests.model.effects.test_hysteresis_backlash import damper
from thrustd.core.measures import rms
from thrustd.identify.regression.friction import law_of
from thrustd.identify.regression.regress import regress
from thrustd.identify.segments import Segment
from thrustd.identify.structures.mount import fitted_from
from thrustd.model.compile import compile_model
from thrustd.model.effects.hysteresis_backlash import EFFECT as BACKLASH

DT_S, NOISE_N, READS_MM = 0.01, 8.0, 0.005


def moved(seed: int, n: int = 6000) -> np.ndarray:
    """Random motion below 1.5 Hz, sigma 10 mm."""
    low = butter(2, 1.5, fs=1 / DT_S, output="sos")
    x = sosfiltfilt(low, np.random.default_rng(seed).normal(size=n))
    return 10.0 * (x - x[0]) / np.std(x)


@pytest.mark.parametrize(("yield_mm", "play_mm"), [(2.0, 1.5), (8.0, 3.0)])
def test_a_friction_damper_with_loose_joints_is_found_to_its_noise(yield_mm, play_mm):
    rng = np.random.default_rng(5)
    x, other = moved(1), moved(2)
    force, expected = damper(x, 800.0, yield_mm, play_mm), damper(other, 800.0, yield_mm, play_mm)
    segment = Segment("bench", 0.0, DT_S, {"deformation_mm": x + READS_MM * rng.normal(size=len(x))},
                      force + NOISE_N * rng.normal(size=len(x)))  # fmt: skip
    found = regress([segment])
    model = compile_model(fitted_from(found, [segment]).spec, 1 / DT_S)
    [law] = [effect for effect in model.spec.effects if effect.name == BACKLASH.name]
    missed = model.simulate(model.inputs({"deformation_mm": other})) - expected
    assert law_of(found.shape) is BACKLASH
    assert law.parameters["friction_n"] == pytest.approx(800.0, rel=0.02)
    assert law.parameters["play_mm"] == pytest.approx(play_mm, rel=0.02)
    assert rms(missed) < 0.2 * NOISE_N


def test_friction_that_stands_while_a_loose_joint_crosses_its_gap_is_found():
    """Dahl's friction of what follows the reading with a play of 1.4 mm: a gap far above the reading's noise."""

    def force_of(x: np.ndarray) -> np.ndarray:
        follows, z, out = 0.0, 0.0, []
        for at in x:
            before, follows = follows, min(max(follows, at - 1.4), at + 1.4)
            away = follows - before
            sign = np.sign(away)
            z = sign - (sign - z) * np.exp(-abs(away) / 0.25) if away else z
            out.append(800.0 * z)
        return np.array(out)

    rng = np.random.default_rng(5)
    x, other = moved(1), moved(2)
    read = x + READS_MM * rng.normal(size=len(x))
    segment = Segment("bench", 0.0, DT_S, {"deformation_mm": read}, force_of(x) + NOISE_N * rng.normal(size=len(x)))
    found = regress([segment])
    model = compile_model(fitted_from(found, [segment]).spec, 1 / DT_S)
    missed = model.simulate(model.inputs({"deformation_mm": other})) - force_of(other)
    assert rms(missed) < 3.0 * NOISE_N  # 5 um of the reading are 16 N where the friction turns
    assert model.spec.effects[-1].parameters["deadband_mm"] == pytest.approx(1.4, rel=0.05)
