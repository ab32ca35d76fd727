"""Nonlinear feedback around a linear block (`thrustd.model.feedback`): hardening springs, tanks, smooth hysteresis.

Starts from the best linear models, whose modes get no feedback at first; then everything is estimated together. Orders
and degrees compete on blocks held back, and the best linear models with them. Feedback is held near zero
(`trial.FEEDBACK_STD`), which matters where data are few: a thousand samples follow any polynomial.
"""

from collections.abc import Sequence
from math import comb

import msgspec
import numpy as np

from thrustd.core.columns import Floats
from thrustd.identify.parameters import pack
from thrustd.identify.regression.general import Asked
from thrustd.identify.regression.solve import Progress
from thrustd.identify.segments import DEFORMATION, Segment, head
from thrustd.identify.structures.block_fits import BlockFits
from thrustd.identify.structures.structure import Fitted, Structure, error_from_past, of_spec
from thrustd.identify.structures.trial import Bench
from thrustd.identify.structures.wiener_hammerstein import through
from thrustd.model.artifact import Feedback, LinearBlock, ModelSpec, PiecewiseLinear

CHOSEN = ("linear.*", "output_curve.y.*")
SHAPES = ((2, 3), (3, 2), (3, 3), (4, 2))  # orders and degrees that compete
MARGIN = 1.25  # what is fed back grows so far beyond what the linear model's states do
ROWS_PER_NUMBER = 8
TRIED, FINAL = 16_000, 40_000  # samples
TRIAL, FURTHER, PATIENT = 24, 16, 60  # iterations; the last for short records, which cost little
MOST = 5  # segments
SHORT = 8_000  # samples
NAME = "feedback"


def _fit(segments: Sequence[Segment], fits: BlockFits, progress: Progress | None) -> Fitted:
    few = Bench([head(s, TRIED // min(MOST, len(segments))) for s in segments[:MOST]], CHOSEN)
    rows = sum(map(len, few.segments))
    lines = {n: Asked("line", "line", order=n) for n, _ in SHAPES}
    linear = {n: _plain(fits.of(segments, asked, progress).spec) for n, asked in lines.items()}
    fed = [
        few.tried(_with_feedback(linear[n], degree, few.segments), TRIAL).spec
        for n, degree in SHAPES
        if n * (_count(n, degree) + 2) < rows / ROWS_PER_NUMBER
    ]
    ends = [*linear.values(), *fed]
    best = min(ends, key=few.held_back_error)
    if best.linear.feedback is None:
        return _linear(best, "no feedback shows")
    bench = Bench([head(s, FINAL // min(MOST, len(segments))) for s in segments[:MOST]], CHOSEN)
    further = bench.estimated(best, PATIENT if rows <= SHORT else FURTHER)
    spec = min((best, further), key=bench.error)
    straight = min(linear.values(), key=lambda spec: error_from_past(spec, segments))
    if error_from_past(straight, segments) < error_from_past(spec, segments):  # only part of a long record was seen
        return _linear(straight, "the rest of the data is followed better without feedback")
    return of_spec(msgspec.structs.replace(spec, structure=NAME), _numbers(spec))


def _plain(spec: ModelSpec) -> ModelSpec:
    """The same straight model with its slope behind the linear block, whose states are then those of the input."""
    line, out = spec.input_curve, spec.output_curve
    assert isinstance(line, PiecewiseLinear) and isinstance(out, PiecewiseLinear)
    slope = (line.y[-1] - line.y[0]) / (line.x[-1] - line.x[0])
    block = spec.linear
    steady = block.direct + sum(m.gain for m in block.real_modes) + sum(m.gain_re for m in block.complex_modes)
    level = out.y[0] - out.x[0] + (line.y[0] - slope * line.x[0]) * steady
    ends = [line.x[0], line.x[-1]]
    behind = PiecewiseLinear(ends, [level + slope * x for x in ends])
    return msgspec.structs.replace(spec, input_curve=PiecewiseLinear(ends, ends), output_curve=behind)


def _linear(spec: ModelSpec, why: str) -> Fitted:
    named = msgspec.structs.replace(spec, structure=NAME)
    return of_spec(named, _numbers(named), note=f"{why}: this is a linear model")


def _numbers(spec: ModelSpec) -> int:
    return len(pack(spec, CHOSEN)) - 1


def _count(order: int, degree: int) -> int:
    """Products of 2 up to `degree` of the states and the input."""
    return comb(order + 1 + degree, degree) - order - 2


def _with_feedback(spec: ModelSpec, degree: int, segments: Sequence[Segment]) -> ModelSpec:
    """No feedback yet, within the ellipsoid that the linear model's states fill."""
    reached = np.concatenate([_states(spec.linear, s) for s in segments])
    low, high = reached.min(axis=0), reached.max(axis=0)
    n = reached.shape[1] - 1
    into = [[0.0] * _count(n, degree) for _ in range(n)]
    centre, scale = (low + high) / 2, MARGIN * np.maximum(high - low, 1e-12 * (high - low).max()) / 2
    within = _filled((reached - centre) / scale) / MARGIN
    feedback = Feedback(degree, centre.tolist(), scale.tolist(), within.tolist(), into)
    return msgspec.structs.replace(spec, linear=msgspec.structs.replace(spec.linear, feedback=feedback))


def _filled(z: Floats) -> Floats:
    """W (n, n), lower triangle, of the ellipsoid |W z| <= 1 that has the shape of these and holds them all."""
    moments = z.T @ z / len(z)
    moments += 1e-9 * np.trace(moments) * np.eye(len(moments))  # states that move together fill no volume
    inverse = np.linalg.inv(np.linalg.cholesky(moments))
    return np.asarray(inverse / np.linalg.norm(z @ inverse.T, axis=1).max(), float)


def _states(linear: LinearBlock, segment: Segment) -> Floats:
    """States and input (n_samples, n + 1) of the block without feedback."""
    alone = [LinearBlock(0.0, [msgspec.structs.replace(mode, gain=1.0)]) for mode in linear.real_modes]
    for mode in linear.complex_modes:
        parts = ((1.0, 0.0), (0.0, -1.0))
        alone += [LinearBlock(0.0, [], [msgspec.structs.replace(mode, gain_re=re, gain_im=im)]) for re, im in parts]
    u = segment.inputs[DEFORMATION]
    return np.column_stack([*(through(block, u, segment.dt_s) for block in alone), u])


STRUCTURES = (Structure(NAME, "linear block with polynomial feedback", "beyond", _fit),)
