"""Residuals of a model on records, and their derivatives with respect to any of its parameters.

Derivatives are finite differences taken stage by stage: a parameter leaves everything upstream of its stage as it is,
so only its own stage runs again, on the stored signal that enters it. What that changes is carried through curves and
linear blocks downstream, all columns at once (`tangents`); stages of other kinds run again too. Records pass in blocks
with the states carried along, so memory stays flat whatever their length.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from thrustd.identify.parameters import ParameterVector, pack, unpack
from thrustd.identify.segments import Segment, segments_of
from thrustd.identify.tangents import carries, carry, fed_back, fed_columns, fed_start, start_of
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
    stages = model_stages(unpack(spec, vector), segment.dt_s)  # logarithms and back, as those with a number moved
    base = _Chain.at_rest(stages, segment, float(segment.inputs["deformation_mm"][0]))
    fed_at, fed = _fed(vector, base)
    apart, together = _variants(spec, segment, vector, base, fed)
    waves = _waves(base, together, fed_at)
    order = [column for wave in waves for column in (*(v.column for v in wave.own), *(fed if wave.fed else ()))]
    order += [variant.column for variant in apart]
    back = None if order == sorted(order) else np.argsort(order)
    for begin in range(0, len(segment), BLOCK):
        signals = base.run(segment, begin, _deformation(segment, begin))
        table = np.empty((len(signals[0]), len(order)))
        for wave, stage in zip(waves, stages, strict=True):
            wave.run(segment, begin, stage, signals, table)
        for i, (_, step, at, chain) in enumerate(apart, len(order) - len(apart)):
            table[:, i] = (chain.run(segment, begin, signals[at])[-1] - signals[-1]) / step
        columns = table if back is None else table[:, back]
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


class _Variant(NamedTuple):
    """A model with one parameter moved. chain: its stages from the first that differs on, or that one alone."""

    column: int
    step: float
    at: int
    chain: "_Chain"


def _variants(
    spec: ModelSpec, segment: Segment, vector: ParameterVector, base: "_Chain", fed: Sequence[int]
) -> tuple[list[_Variant], list[_Variant]]:
    """Those that run on to the end by themselves, and those whose change is carried on with others."""
    apart: list[_Variant] = []
    together: list[_Variant] = []
    for i, step in enumerate(_steps(vector)):
        if i in fed:
            continue
        changed = model_stages(unpack(spec, _moved(vector, i, step)), segment.dt_s)
        at, *others = _differences(base.stages, changed)
        alone = not others and _carried(base, at)
        chain = _Chain.at_rest(changed[at : at + 1] if alone else changed[at:], segment, base.signals[at])
        (together if alone else apart).append(_Variant(i, step, at, chain))
    return apart, together


def _differences(stages: tuple[Stage, ...], changed: tuple[Stage, ...]) -> list[int]:
    """Which stages' coefficients changed; the last one when none did."""
    pairs = enumerate(zip(stages, changed, strict=True))
    return [i for i, (old, new) in pairs if not np.array_equal(old.c, new.c)] or [len(stages) - 1]


def _carried(base: "_Chain", at: int) -> bool:
    return all(map(carries, base.stages[at + 1 :]))


def _fed(vector: ParameterVector, base: "_Chain") -> tuple[int, list[int]]:
    """The stage with feedback and the places of its numbers; none unless all of them are asked for."""
    for at, stage in enumerate(base.stages):
        places = [i for i, name in enumerate(vector.names) if name.startswith(f"{stage.name}.feedback.")]
        if places and len(places) == fed_back(stage) and _carried(base, at):
            return at, places
    return -1, []


@dataclass(frozen=True, slots=True)
class _Wave:
    """Changes that pass one stage: those from further up, those of its own numbers, those of what it feeds back."""

    at: int
    passing: Floats  # state of the changes from further up (n_state, n)
    own: list[_Variant]
    fed: tuple[Floats, Floats] | None  # state of the stage and of its changes

    def run(self, segment: Segment, begin: int, stage: Stage, signals: list[Floats], table: Floats) -> None:
        v, count = signals[self.at], self.passing.shape[1]
        carry(stage, self.passing, v, table, count)
        for i, variant in enumerate(self.own, count):
            table[:, i] = (variant.chain.run(segment, begin, v)[-1] - signals[self.at + 1]) / variant.step
        if self.fed is not None:
            fed_columns(self.fed[0], stage.c, self.fed[1], v, table, count + len(self.own))


def _waves(base: "_Chain", together: list[_Variant], fed_at: int) -> list[_Wave]:
    """One for every stage; their states are those of a start at rest."""
    waves, entering = [], np.empty(0)
    for at, stage in enumerate(base.stages):
        passing, leaving, fed = np.empty((0, 0)), entering, None
        if len(entering):
            passing, leaving = start_of(stage, base.signals[at], entering)
        own = [variant for variant in together if variant.at == at]
        born = [(variant.chain.signals[-1] - base.signals[at + 1]) / variant.step for variant in own]
        entering = np.concatenate((leaving, born))
        if at == fed_at:
            moved, first = fed_start(stage, base.states[at], base.signals[at])
            fed, entering = (base.states[at].copy(), moved), np.concatenate((entering, first))
        waves.append(_Wave(at, passing, own, fed))
    return waves


@dataclass(frozen=True, slots=True)
class _Chain:
    """Consecutive stages with their states."""

    stages: tuple[Stage, ...]
    states: tuple[Floats, ...]
    signals: tuple[float, ...]  # the first sample of the signal that enters each stage, and of what leaves the last

    @staticmethod
    def at_rest(stages: tuple[Stage, ...], segment: Segment, v: float) -> "_Chain":
        states, signals = [], [v]
        for stage in stages:
            u = _channels(stage, segment, 0, 1)
            x = stage.start(u[0], v)
            states.append(x)
            v = float(stage.run(x.copy(), u, np.array([v]))[0])
            signals.append(v)
        return _Chain(stages, tuple(states), tuple(signals))

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
