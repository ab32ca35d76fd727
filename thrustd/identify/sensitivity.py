"""Residuals of a model on records, and their derivatives with respect to any of its parameters.

Derivatives are finite differences taken stage by stage: a parameter leaves everything upstream of its stage as it is,
so only its own stage runs again, on the stored signal that enters it. What that changes is carried through curves and
linear blocks downstream, all columns at once (`tangents`); where stages of other kinds follow, those run again too.
"""

from collections.abc import Sequence

import numpy as np

from thrustd.identify.parameters import ParameterVector, unpack
from thrustd.identify.segments import DEFORMATION, Segment, segments_of
from thrustd.identify.tangents import carries, carry, fed_back, fed_columns, fed_start
from thrustd.model.artifact import ModelSpec
from thrustd.model.compile import model_stages
from thrustd.model.stage import Floats, Stage, entered, free_run
from thrustd.records.recording import Recording

STEP = 1e-6  # of a parameter's scale; curves have kinks, so small, and double precision allows it


def segments_for(spec: ModelSpec, records: Sequence[Recording]) -> list[Segment]:
    """Segments with every channel the model reads."""
    return segments_of(records, [name for stage in model_stages(spec, 1.0) for name in stage.channels])


def residuals(spec: ModelSpec, segment: Segment) -> Floats:
    """Reference minus model (n,), N; the model starts at rest."""
    return segment.force_n - free_run(model_stages(spec, segment.dt_s), segment.inputs, segment.inputs[DEFORMATION])


def jacobian(spec: ModelSpec, segment: Segment, vector: ParameterVector) -> tuple[Floats, Floats]:
    """Residual (n,) and J (n, n_parameters), J = d model / d parameter, at the values of the vector."""
    stages = model_stages(unpack(spec, vector), segment.dt_s)  # logarithms and back, as those with a number moved
    inputs, signals = [segment.inputs], [segment.inputs[DEFORMATION]]  # of every stage
    for stage in stages:
        inputs.append(entered(stage, inputs[-1], signals[-1]))
        signals.append(stage.from_rest(inputs[-1], signals[-1]))
    reach = [all(map(carries, stages[at + 1 :])) for at in range(len(stages))]  # whether changes are carried to the end
    fed_at, fed = _fed(vector, stages, reach)
    steps = np.where(vector.values + STEP * vector.scale > vector.high, -STEP, STEP) * vector.scale
    moved = {i: _moved(spec, segment, vector, i, steps[i], stages) for i in range(len(vector)) if i not in fed}
    table, order = np.empty((len(segment), len(vector))), list[int]()
    for at, stage in enumerate(stages):
        carry(stage, signals[at], table, len(order))
        for i, (first, last, changed) in moved.items():
            if first == last == at and reach[at]:
                table[:, len(order)] = (changed[at].from_rest(inputs[at + 1], signals[at]) - signals[at + 1]) / steps[i]
                order.append(i)
        if at == fed_at:
            x = stage.start(np.empty(0), float(signals[at][0]))
            fed_columns(x, stage.c, fed_start(stage, x, float(signals[at][0])), signals[at], table, len(order))
            order += fed
    for i, (first, last, changed) in moved.items():
        if first != last or not reach[first]:
            table[:, len(order)] = (free_run(changed[first:], inputs[first], signals[first]) - signals[-1]) / steps[i]
            order.append(i)
    columns = table if order == sorted(order) else table[:, np.argsort(order)]
    return segment.force_n - signals[-1], columns


def _moved(
    spec: ModelSpec, segment: Segment, vector: ParameterVector, i: int, step: float, stages: tuple[Stage, ...]
) -> tuple[int, int, tuple[Stage, ...]]:
    """The first and the last stage that differ when one parameter moves, and all stages then."""
    values = vector.values.copy()
    values[i] += step
    changed = model_stages(unpack(spec, vector.at(values)), segment.dt_s)
    pairs = enumerate(zip(stages, changed, strict=True))
    differ = [at for at, (old, new) in pairs if not np.array_equal(old.c, new.c)] or [len(stages) - 1]
    return differ[0], differ[-1], changed


def _fed(vector: ParameterVector, stages: tuple[Stage, ...], reach: Sequence[bool]) -> tuple[int, list[int]]:
    """The stage with feedback and the places of its numbers; none unless all of them are asked for."""
    for at, stage in enumerate(stages):
        places = [i for i, name in enumerate(vector.names) if name.startswith(f"{stage.name}.feedback.")]
        if places and len(places) == fed_back(stage) and reach[at]:
            return at, places
    return -1, []
