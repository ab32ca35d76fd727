"""A posterior as tables: what the artifact says is what the regression said."""

import numpy as np
from scipy.signal import lfilter

from thrustd.identify.regression.regress import regress
from thrustd.identify.regression.table import spec_of
from thrustd.identify.segments import Segment
from thrustd.model.compile import compile_model

DT_S, NOISE_N = 0.05, 2.0


def test_a_curve_in_front_of_a_large_gain_keeps_its_bends():
    """A force that relaxes whole: only the product of curve and gain is told, and the curve may be tiny."""
    rng = np.random.default_rng(2)
    d = lfilter([0.3], [1.0, -0.7], np.repeat(rng.uniform(-1.0, 1.0, 300), 20))
    w, keep = 300.0 * d + 900.0 * d**3, np.exp(-DT_S / 0.4)
    force = w - lfilter([1.0 - keep], [1.0, -keep], w) + rng.normal(0.0, NOISE_N, len(d))
    segment = Segment("damper", 0.0, DT_S, {"deformation_mm": d}, force)
    found = regress([segment], settled=True)
    model = compile_model(spec_of(found, [segment], "damper"), 1.0 / DT_S)
    told = found.shape.output_scale * np.sqrt(found.mean_square)
    missed = force - model.simulate(model.inputs({"deformation_mm": d}))
    assert np.sqrt(np.mean(missed[round(10 * 0.4 / DT_S) :] ** 2)) < 1.05 * told  # a flight does not begin as this did
    assert told < 1.15 * NOISE_N
