"""A free run of a model over a stretch of data; a reading that the model knows to be late or early is put back in time.

A record allows to look ahead, a flight does not.
"""

from dataclasses import replace

import msgspec

from thrustd.identify.segments import Segment
from thrustd.model.ahead import ahead
from thrustd.model.artifact import ModelSpec
from thrustd.model.compile import model_stages
from thrustd.model.effects import effect_named
from thrustd.model.stage import Floats, free_run


def lateness(spec: ModelSpec) -> tuple[ModelSpec, float]:
    """The model without what a record can undo by looking ahead, or back, in it, and how far, s."""
    late_s, rest = 0.0, []
    for present in spec.effects:
        effect = effect_named(present.name)
        if late := effect.ahead:
            late_s += present.parameters[late]
            present = msgspec.structs.replace(present, parameters=dict(present.parameters) | {late: 0.0})
        rest += [] if late and effect.does_nothing(present.parameters) else [present]
    return (spec, 0.0) if late_s == 0.0 else (msgspec.structs.replace(spec, effects=rest), late_s)


def put_back(segment: Segment, late_s: float) -> Segment:
    """The segment with its deformation at the time it belongs to."""
    if late_s == 0.0:
        return segment
    reading = ahead(segment.inputs["deformation_mm"], late_s / segment.dt_s)
    return replace(segment, inputs=dict(segment.inputs) | {"deformation_mm": reading})


def simulate(spec: ModelSpec, segment: Segment) -> Floats:
    """Free run over a whole segment from rest (n,), a late reading put back to its time."""
    punctual, late_s = lateness(spec)
    return simulate_in_flight(punctual, put_back(segment, late_s))


def simulate_in_flight(spec: ModelSpec, segment: Segment) -> Floats:
    """The same as every sample comes in (n,): a late reading can only be extrapolated."""
    return free_run(model_stages(spec, segment.dt_s), segment.inputs, segment.inputs["deformation_mm"])
