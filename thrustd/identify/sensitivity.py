"""Residuals of a model on records, and their derivatives with respect to any of its parameters.

Derivatives are finite differences taken stage by stage: a parameter leaves everything upstream of its stage as it is,
so only its own stage and those downstream run again, on the stored signal that enters them. Records pass in blocks with
the states carried along, so memory stays flat whatever their length.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from thrustd.identify.parameters import ParameterVector, pack, unpack
from thrustd.identify.segments import Segment, segments_of
from thrustd.model.artifact import ModelSpec
from thrustd.model.compile import model_stages
from thrustd.model.stage import Floats, Stage
from thrustd.records.recording import Recording

BLOCK = 16384  # samples per block: 60 columns of it are 8 MB
STEP = 1e-6  # of a parameter's scale; curves have kinks, so small, and double precision allows it


def segments_for(spec: ModelSpec, records: Sequence[Recording]) -> list[Segment]:
    """Segments with every channel the model reads."""
    return segments_of(records, [name for stage in model_stages(spec, 1.0) for name in stage.channels])


def simulate_records(spec: ModelSpec, records: Sequence[Recording]) -> list[tuple[Segment, Floats]]:
    """Free run over every segment, started at rest: (segment, force_n - model (n,)), NaN without reference."""
    return [(segment, residuals(spec, segment)) for segment in segments_for(spec, records)]


def residuals(spec: ModelSpec, segment: Segment) -> Floats:
    """Reference minus model (n,), N."""
    chain = _Chain.at_rest(model_stages(spec, segment.dt_s), segment, float(segment.inputs["deformation_mm"][0]))
    parts = [chain.run(segment, begin, _deformation(segment, begin))[-1] for begin in range(0, len(segment), BLOCK)]
    return segment.force_n - np.concatenate(parts)


def jacobian(
    spec: ModelSpec, records: Sequence[Recording], which: Sequence[str]
) -> Iterator[tuple[Segment, int, Floats, Floats]]:
    """Blocks (segment, first row, residual (m,), J (m, n_parameters)), J = d model / d parameter."""
    vector = pack(spec, which)
    for segment in segments_for(spec, records):
        for begin, residual, columns in jacobian_blocks(spec, segment, vector):
            yield segment, begin, residual, columns


def jacobian_blocks(spec: ModelSpec, segment: Segment, vector: ParameterVector) -> Iterator[tuple[int, Floats, Floats]]:
    """Blocks (first row, residual (m,), J (m, n_parameters)) of one segment."""
    stages = model_stages(spec, segment.dt_s)
    first = float(segment.inputs["deformation_mm"][0])
    base = _Chain.at_rest(stages, segment, first)
    entering = base.entering
    variants = []
    for i, step in enumerate(_steps(vector)):
        changed = model_stages(unpack(spec, _moved(vector, i, step)), segment.dt_s)
        at = _first_difference(stages, changed)
        variants.append((at, step, _Chain.at_rest(changed[at:], segment, entering[at])))
    for begin in range(0, len(segment), BLOCK):
        signals = base.run(segment, begin, _deformation(segment, begin))
        columns = np.empty((len(signals[0]), len(vector)), order="F")
        for i, (at, step, chain) in enumerate(variants):
            columns[:, i] = (chain.run(segment, begin, signals[at])[-1] - signals[-1]) / step
        yield begin, segment.force_n[begin : begin + BLOCK] - signals[-1], columns


def _deformation(segment: Segment, begin: int) -> Floats:
    return segment.inputs["deformation_mm"][begin : begin + BLOCK]


def _steps(vector: ParameterVector) -> Floats:
    """Finite-difference steps (n,), away from the upper bound."""
    steps = STEP * vector.scale
    return np.where(vector.values + steps > vector.high, -steps, steps)


def _moved(vector: ParameterVector, i: int, step: float) -> ParameterVector:
    values = vector.values.copy()
    values[i] += step
    return ParameterVector(vector.names, values, vector.low, vector.high, vector.scale)


def _first_difference(stages: tuple[Stage, ...], changed: tuple[Stage, ...]) -> int:
    """Index of the first stage whose coefficients changed; the last one when none did."""
    for i, (old, new) in enumerate(zip(stages, changed, strict=True)):
        if not np.array_equal(old.c, new.c):
            return i
    return len(stages) - 1


@dataclass(frozen=True, slots=True)
class _Chain:
    """Consecutive stages with their states."""

    stages: tuple[Stage, ...]
    states: tuple[Floats, ...]
    entering: tuple[float, ...]  # the first sample of the signal that enters each stage

    @staticmethod
    def at_rest(stages: tuple[Stage, ...], segment: Segment, v: float) -> "_Chain":
        states, entering = [], []
        for stage in stages:
            u = _channels(stage, segment, 0, 1)
            x = stage.start(u[0], v)
            states.append(x)
            entering.append(v)
            v = float(stage.run(x.copy(), u, np.array([v]))[0])
        return _Chain(stages, tuple(states), tuple(entering))

    def run(self, segment: Segment, begin: int, v: Floats) -> list[Floats]:
        """Signals entering each stage, and the last output, of one block; states are advanced."""
        signals = [v]
        for stage, x in zip(self.stages, self.states, strict=True):
            v = stage.run(x, _channels(stage, segment, begin, len(v)), v)
            signals.append(v)
        return signals


def _channels(stage: Stage, segment: Segment, begin: int, count: int) -> Floats:
    if not stage.channels:
        return np.empty((count, 0))
    return np.column_stack([segment.inputs[name][begin : begin + count] for name in stage.channels])
