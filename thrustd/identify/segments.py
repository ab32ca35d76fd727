"""Recordings -> segments: stretches without a gap on a uniform time axis, which is what every estimator works on.

Gaps split a record, because the state of a model is unknown after one. A few missing values are bridged by straight
lines; a longer hole in an input splits the record. Missing reference force stays NaN and carries no weight.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError
from thrustd.records.recording import Recording

DEFORMATION = "deformation_mm"
FORCE = "force_N"
SHORTEST = 20  # samples; a shorter stretch tells nothing about dynamics
BRIDGE = 5  # missing samples bridged by a straight line
COARSE, FAST, MOST_FINE = 3.0, 0.05, 30  # longest step over the 5 % shortest; samples per sample at most
UNEVEN = 0.02  # a step that differs more than this from the median step asks for resampling
LEAPING = 0.02  # of the means, those over which the input moves most, say least


@dataclass(frozen=True, slots=True)
class Segment:
    """One stretch of one record at a uniform sample period."""

    record: str
    start_s: float
    dt_s: float
    inputs: dict[str, Floats]  # channel -> (n,), finite, deformation_mm among them
    force_n: Floats  # (n,), NaN where there is no reference

    def __len__(self) -> int:
        return len(self.force_n)

    @property
    def time_s(self) -> Floats:
        time_s: Floats = self.start_s + self.dt_s * np.arange(len(self), dtype=np.float64)
        return time_s


def segments_of(records: Sequence[Recording], channels: Iterable[str] = (), force: bool = True) -> list[Segment]:
    """Split records at gaps and holes. `channels`: inputs besides deformation_mm; `force=False` allows none."""
    wanted = list(dict.fromkeys((DEFORMATION, *channels)))
    found = [segment for record in records for segment in _of_record(record, wanted, force)]
    if not found:
        names = ", ".join(record.name for record in records) or "no record"
        raise RecordingError(f"{names}: no stretch of {SHORTEST} samples without a gap; too short to identify from")
    return found


def _of_record(record: Recording, wanted: list[str], force: bool) -> list[Segment]:
    columns = wanted + ([FORCE] if force or FORCE in record else [])
    chosen = record.select(columns)
    steps_s = np.diff(chosen.time_s)
    varied = float(np.quantile(steps_s, 0.9) / np.median(steps_s)) if len(steps_s) else 1.0
    stretches = chosen.segments(
        (BRIDGE + 1.5) * max(1.0, varied)
    )  # a few lost samples are bridged, like missing values
    pieces = [chosen.rows(part) for part in stretches if part.stop - part.start >= SHORTEST]
    return [segment for piece in pieces for segment in _of_piece(_even(piece), wanted)]


def _even(piece: Recording) -> Recording:
    steps_s = np.diff(piece.time_s)
    middle_s = float(np.median(steps_s))
    if float(np.ptp(steps_s)) <= UNEVEN * middle_s:
        return piece
    if float(steps_s.max()) > COARSE * float(np.quantile(steps_s, FAST)):
        return _on_fine_axis(piece, max(float(np.quantile(steps_s, FAST)), piece.duration_s / (MOST_FINE * len(piece))))
    return piece.resample(1.0 / middle_s, np.inf)


def _on_fine_axis(piece: Recording, step_s: float) -> Recording:
    """Steps that vary many-fold: inputs on an axis as fine as the finest of them, the reference only where measured."""
    even = piece.resample(1.0 / step_s, np.inf)
    if FORCE not in piece:
        return even
    nearest = np.unique(np.clip(np.round((piece.time_s - even.time_s[0]) / step_s), 0, len(even) - 1).astype(int))
    measured = np.full(len(even), np.nan)
    measured[nearest] = np.interp(even.time_s[nearest], piece.time_s, piece[FORCE])
    return even.with_channels(**{FORCE: measured})


def _of_piece(piece: Recording, wanted: list[str]) -> list[Segment]:
    dt_s = piece.duration_s / (len(piece) - 1)
    inputs = {name: bridged(piece[name]) for name in wanted}
    force_n = piece[FORCE] if FORCE in piece else np.full(len(piece), np.nan)
    good = np.all([np.isfinite(column) for column in inputs.values()], axis=0)
    edges = np.flatnonzero(np.diff(np.concatenate(([0], good.astype(np.int8), [0]))))
    return [
        Segment(
            piece.name,
            float(piece.time_s[a]),
            dt_s,
            {name: column[a:b] for name, column in inputs.items()},
            force_n[a:b],
        )
        for a, b in zip(edges[::2], edges[1::2], strict=True)
        if b - a >= SHORTEST and np.isfinite(force_n[a:b]).any()
    ]


def bridged(column: Floats) -> Floats:
    """Missing runs of up to `BRIDGE` samples replaced by straight lines; longer ones stay NaN."""
    good = np.isfinite(column)
    if good.all() or not good.any():
        return column
    index = np.arange(len(column))
    filled: Floats = np.interp(index, index[good], column[good])
    edges = np.flatnonzero(np.diff(np.concatenate(([1], good.astype(np.int8), [1]))))
    for a, b in zip(edges[::2], edges[1::2], strict=True):
        if b - a > BRIDGE or a == 0 or b == len(column):
            filled[a:b] = np.nan
    return filled


def head(segment: Segment, samples: int) -> Segment:
    """The first samples of a segment."""
    return _part(segment, 0, samples)


def _part(segment: Segment, begin: int, samples: int) -> Segment:
    inputs = {name: column[begin : begin + samples] for name, column in segment.inputs.items()}
    start_s = segment.start_s + begin * segment.dt_s
    return replace(segment, start_s=start_s, inputs=inputs, force_n=segment.force_n[begin : begin + samples])


def thinned(segments: Sequence[Segment], samples: int) -> list[Segment]:
    """Means of so many consecutive samples that `samples` remain; without output where the input leaps.

    There the curve's mean is not the curve of the mean: a few leaps would outweigh all that is slow.
    """
    width = max(1, sum(map(len, segments)) // samples)
    return [_thin(segment, width) for segment in segments if len(segment) >= 20 * width]


def _thin(segment: Segment, width: int) -> Segment:
    def blocks(column: Floats) -> Floats:
        return column[: len(column) // width * width].reshape(-1, width)

    def means(column: Floats) -> Floats:
        return blocks(column).mean(axis=1)

    moved = np.ptp(blocks(segment.inputs[DEFORMATION]), axis=1)
    force_n = np.where(moved > np.quantile(moved, 1.0 - LEAPING), np.nan, means(segment.force_n))
    inputs = {name: means(column) for name, column in segment.inputs.items()}
    start_s = segment.start_s + segment.dt_s * (width - 1) / 2
    return Segment(segment.record, start_s, segment.dt_s * width, inputs, force_n)
