"""A calibrated mount against a load cell: what its file corrects is not looked for again."""

import msgspec
import numpy as np

from thrustd.cli.files import read_models
from thrustd.core.aircraft import MountPlace
from thrustd.core.calibration import MountCalibration
from thrustd.diagnose.extend.extend import extend
from thrustd.diagnose.search.diagnose import diagnose
from thrustd.diagnose.search.evidence import simulate
from thrustd.diagnose.search.question import Given
from thrustd.diagnose.search.records import stretches
from thrustd.installation.shipped import shipped
from thrustd.model.calibrated import calibrated
from thrustd.twin.bench import step_bench
from thrustd.twin.mount import UPPER

MASS_KG = 171.7
PLACE = MountPlace("left_upper", "left", 0, 0.46, MountCalibration(gain=1.03, gain_std=0.005, expansion_mm_k=0.001))


def test_gain_and_growth_of_the_file_are_no_effects_of_the_mount():
    (whole,) = read_models([shipped("models/left-upper.json", "model")]).values()
    bare = msgspec.structs.replace(whole, effects=[e for e in whole.effects if e.name != "axial_inertia"], witness=None)
    bench, rng = step_bench(0.3, 71, UPPER).resample(5.0), np.random.default_rng(71)
    wave = bench.time_s[:, None] / np.array([31.0, 87.0, 400.0])
    flown = bench.with_channels(
        accel_z_g=np.ones(len(bench)),
        accel_x_g=0.05 * np.sin(wave).sum(axis=1),
        temperature_degC=30.0 + 15.0 * np.sin(bench.time_s / 300.0),
    )
    (segment,) = stretches(whole, [flown])
    force_n = simulate(calibrated(whole, PLACE, "whole"), segment) + 5.0 * rng.standard_normal(len(segment))
    record, given = (
        flown.with_channels(force_N=force_n, deformation_mm_left_upper=flown["deformation_mm"]),
        Given(mount=PLACE),
    )
    report = diagnose(bare, [record], given=given)
    assert report.verdict == ("axial_inertia",)
    (mass,) = extend(bare, [record], ["axial_inertia"], given=given).parameters
    assert abs(mass.value - MASS_KG) < max(mass.half_width, 1.0)
