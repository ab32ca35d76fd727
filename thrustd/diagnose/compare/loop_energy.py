"""Energy that a mount takes from a motion: before anything else, whether its record can be that of a passive body.

    E = integral of (F - g(x)) dx,    g: the elastic curve, smooth, fitted to the record; its own integral depends on
                                      where a motion begins and ends alone

Damping, friction and creep take energy from every cycle. Negative E means a turned sign of force or deformation (or a
force that is recorded too late): no effect that rubber has explains it, and a delay would be named instead. The record
is cut into blocks of equal way; negative counts only beyond the scatter of their mean (Student's t).

Where the input is a speed (a damper's record), its integral over time is the way.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline
from scipy.special import stdtrit

from thrustd.core.columns import Floats
from thrustd.core.measures import SIGMAS_95
from thrustd.diagnose.compare.motion import motion_of
from thrustd.identify.segments import DEFORMATION, Segment, segments_of
from thrustd.records.recording import Recording
from thrustd.records.roles import roles_of

BLOCKS = 20  # of equal way
LEAST_BLOCKS = 5
DOUBT = 1e-3  # that a healthy record is suspected
SPANS = 8  # of the elastic curve
SPEED = "/s"  # of a unit: the input is a speed
ELECTRICAL = "V", "mV", "kV", "A", "mA"  # the input drives an actuator: times what it gives it is no work


@dataclass(frozen=True, slots=True)
class LoopEnergy:
    """taken: work of the loops, force times deformation; mean_n: the same per way, force along the motion."""

    taken: float
    mean_n: float
    std_n: float
    way: float
    delivers: bool

    def sentence(self, records: Sequence[Recording]) -> str:
        """What is wrong, by the names of the file; empty when nothing is."""
        if not self.delivers:
            return ""
        roles = roles_of(records)
        unit = f" {roles.output_unit}" if roles.output_unit else ""
        delivered = f"{self.mean_n:.2g} +- {SIGMAS_95 * self.std_n:.1g}{unit} along its motion, 95 %"
        names = ", ".join(record.name for record in records)
        exchanged = "" if roles.own else f"; or does {roles.input} drive and {roles.output} move: exchange the two?"
        return (
            f"{names}: this mount would deliver energy ({delivered}):"
            f" sign of {roles.output} or of {roles.input}? (or a force that is recorded late){exchanged}"
        )


def loop_energy(records: Recording | Sequence[Recording]) -> LoopEnergy:
    """Of recordings with `deformation_mm` and `force_N` under these names; RecordingError when there is no stretch."""
    records = [records] if isinstance(records, Recording) else list(records)
    segments = segments_of(records)
    unit = roles_of(records).input_unit
    parts = [_ways(segment, unit.endswith(SPEED)) for segment in segments]
    place, force, step, way = (np.concatenate(column) for column in zip(*parts, strict=True))
    total = float(way.sum())
    if len(place) < LEAST_BLOCKS * SPANS or total <= 0 or np.ptp(place) <= 0 or unit in ELECTRICAL:
        return LoopEnergy(0.0, 0.0, 0.0, total, False)
    left = force - _elastic(place, force)
    block = np.minimum((BLOCKS * np.cumsum(way) / total).astype(int), BLOCKS - 1)
    energy, ways = np.bincount(block, left * step, BLOCKS), np.bincount(block, way, BLOCKS)
    visited = ways > 0
    energy, ways = energy[visited], ways[visited]
    mean, count = float(energy.sum() / total), len(ways)
    if count < LEAST_BLOCKS:
        return LoopEnergy(float(energy.sum()), mean, np.inf, total, False)
    std = float(np.linalg.norm(energy - mean * ways) / total * np.sqrt(count / (count - 1)))
    delivers = mean < -std * float(stdtrit(count - 1, 1 - DOUBT))
    return LoopEnergy(float(energy.sum()), mean, std, total, delivers)


def _ways(segment: Segment, speed: bool) -> tuple[Floats, Floats, Floats, Floats]:
    """Between samples with a reference: place, force, signed step, and the way that is none of noise."""
    x = segment.inputs[DEFORMATION]
    if speed:
        x = np.concatenate(([0.0], np.cumsum(0.5 * (x[1:] + x[:-1])) * segment.dt_s))
    good = np.isfinite(segment.force_n[1:]) & np.isfinite(segment.force_n[:-1])
    way = np.diff(motion_of(x, segment.dt_s).travel)
    place, force = 0.5 * (x[1:] + x[:-1]), 0.5 * (segment.force_n[1:] + segment.force_n[:-1])
    return place[good], force[good], np.diff(x)[good], way[good]


def _elastic(place: Floats, force: Floats) -> Floats:
    """Cubic spline of the place through the middle of the loops (n,)."""
    low, high = float(place.min()), float(place.max())
    inner = np.unique(np.quantile(place, np.linspace(0, 1, SPANS + 1))[1:-1])
    inner = inner[(inner > low) & (inner < high)]
    knots = np.concatenate(([low] * 4, inner, [high] * 4))
    table = BSpline.design_matrix(place, knots, 3)
    gram = (table.T @ table).toarray()
    ridge = 1e-9 * np.trace(gram) / len(gram) * np.eye(len(gram))
    found: Floats = table @ np.linalg.solve(gram + ridge, table.T @ force)
    return found
