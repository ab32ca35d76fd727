"""Shapes of the curves: a cubic or a straight line instead of free knots."""

import numpy as np

from thrustd.identify.regression.general import Asked
from thrustd.identify.regression.hypotheses import explained
from thrustd.identify.regression.table import spec_of
from thrustd.identify.segments import segments_of
from thrustd.identify.structures.structure import of_spec
from thrustd.model.artifact import LinearBlock, ModelSpec, PiecewiseLinear, Polynomial, RealMode, ValidRange

from .hw_truth import record

LINEAR = LinearBlock(1.4, [RealMode(0.3, -0.3), RealMode(4.0, -0.1)])


def cubic_hammerstein():
    straight = PiecewiseLinear([0.0, 1.2], [0.0, 6000.0])
    curve = Polynomial(0.6, 0.6, [0.5, 0.6, 0.05, 0.1])
    return ModelSpec("thrustd-model/1", "h", "hammerstein", curve, LINEAR, straight, ValidRange((0, 1.2), (0, 6500)))


def test_a_cubic_hammerstein_system_is_found_exactly():
    data, sigma = record(cubic_hammerstein(), 8000)
    found = explained(segments_of([data]), Asked("cubic", "line", order=2))
    assert np.sqrt(found.mean_square) * found.shape.output_scale < 1.03 * sigma
    spec = spec_of(found, segments_of([data]), "found")
    assert len(spec.linear.real_modes) == 2
    assert len(spec.output_curve.x) == 2
    segment = segments_of([data])[0]
    error = segment.force_n - of_spec(spec, 0).simulate(segment)
    assert np.std(error[2000:]) < 1.05 * sigma
