"""Data in the normalised units in which HW-PWL models are searched for, so that any scale and unit will do."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from thrustd.core.errors import RecordingError
from thrustd.identify.hw_problem import Signal, choose_samples
from thrustd.identify.segments import DEFORMATION, Segment


@dataclass(frozen=True, slots=True)
class Units:
    """u = (deformation - u_zero) / u_span, y = (force - y_zero) / y_span."""

    u_zero: float
    u_span: float
    y_zero: float
    y_span: float


def units_of(segments: Sequence[Segment]) -> Units:
    """Range of the input, mean and spread of the output; RecordingError when either is constant."""
    u_low = min(float(segment.inputs[DEFORMATION].min()) for segment in segments)
    u_high = max(float(segment.inputs[DEFORMATION].max()) for segment in segments)
    force_n = [segment.force_n[np.isfinite(segment.force_n)] for segment in segments]
    total = sum(map(len, force_n))
    mean = sum(float(part.sum()) for part in force_n) / total
    std = float(np.sqrt(sum(float(((part - mean) ** 2).sum()) for part in force_n) / total))
    name = segments[0].record
    if not u_high > u_low:
        raise RecordingError(f"{name}: {DEFORMATION} is {u_low:g} all the time; a constant input identifies nothing")
    if not std > 0:
        raise RecordingError(f"{name}: force_N is {mean:g} all the time; expected a force that moves")
    return Units(u_low, u_high - u_low, mean, std)


def signals_in(segments: Sequence[Segment], units: Units, rows: int) -> list[Signal]:
    """All segments, with so many samples in all that count."""
    total = sum(map(len, segments))
    return [signal_in(segment, units, max(1, total // rows)) for segment in segments]


def signal_in(segment: Segment, units: Units, stride: int) -> Signal:
    """One segment, of which one sample in `stride` counts."""
    u = (segment.inputs[DEFORMATION] - units.u_zero) / units.u_span
    y = (segment.force_n - units.y_zero) / units.y_span
    return Signal(u, y, segment.dt_s, choose_samples(y, stride))
