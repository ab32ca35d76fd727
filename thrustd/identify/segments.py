"""Recordings -> segments: stretches on a uniform time axis, which is what every estimator works on.

A gap in a record does not end what the mount remembers. Inputs are bridged by straight lines, and the force carries no
weight in a gap of more than a few samples nor for as long after it: what the line got wrong has faded by then, what is
slower saw little of it. A gap longer than everything that was measured splits the record, because the state after it is
unknown; so does an input that is missing for so long. Missing reference force stays NaN and carries no weight.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thrustd.core.columns import Flags, Floats
from thrustd.core.errors import RecordingError
from thrustd.records.recording import Recording

DEFORMATION = "deformation_mm"
FORCE = "force_N"
SHORTEST = 20  # samples; a shorter stretch tells nothing about dynamics
BRIDGE = 5  # missing samples bridged by a straight line
COARSE, FAST, MOST_FINE = 3.0, 0.05, 30  # longest step over the 5 % shortest; samples per sample at most
OFTEN = 0.1  # of the time in such steps: the record is written as it moves, not at a rate
UNEVEN = 0.02  # a step that differs more than this from the median step asks for resampling
NO_CLOCK = 0.29  # of a step: so far are stamps from any ticks (one over the root of 12)
LEAPING = 0.02  # of the means, those over which the input moves most, say least


@dataclass(frozen=True, slots=True)
class Segment:
    """One stretch of one record at a uniform sample period."""

    record: str
    start_s: float
    dt_s: float
    inputs: dict[str, Floats]  # channel -> (n,), finite, deformation_mm among them
    force_n: Floats  # (n,), NaN where there is no reference
    step_share: float = 1.0  # of its noise, see `Grid`

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
    pieces = [chosen.rows(part) for part in chosen.segments(len(chosen)) if part.stop - part.start >= SHORTEST]
    return [segment for piece in pieces for segment in _of_piece(_even(piece), wanted)]


def _even(piece: Recording) -> Recording:
    steps_s = np.diff(piece.time_s)
    middle_s, fine_s = float(np.median(steps_s)), float(np.quantile(steps_s, FAST))
    if float(np.ptp(steps_s)) <= UNEVEN * middle_s:
        return piece
    if float(steps_s[steps_s > COARSE * fine_s].sum()) > OFTEN * piece.duration_s:
        return _on_fine_axis(piece, max(fine_s, piece.duration_s / (MOST_FINE * len(piece))))
    step_s, begin_s = _clock(piece.time_s, middle_s)
    even = piece.resample(1.0 / step_s, np.inf, begin_s)
    if FORCE not in piece:
        return even
    usual_s = (BRIDGE + 1.5) * max(middle_s, float(np.quantile(steps_s, 0.9)))
    return even.with_channels(**{FORCE: np.where(_unsure(piece.time_s, even.time_s, usual_s), np.nan, even[FORCE])})


def _clock(time_s: Floats, middle_s: float) -> tuple[float, float]:
    """Period and first tick of the clock behind stamps that tremble and rows that are missing.

    On its ticks a straight line between two rows is nearly one of them. Off them it is a mean of two, with less noise
    than either. No row is counted from the one before, whose stamp trembles, too: a stretch twice as long begins with
    the clock of the one before it. How far stamps are from ticks is told on the circle (Mardia & Jupp, Directional
    Statistics, 2000): those of no clock are everywhere on it.
    """
    step_s, begin_s, rows, trembles = middle_s, float(time_s[0]), SHORTEST, 0.0
    while rows < 2 * len(time_s):
        part = time_s[:rows]
        turn = np.exp(2j * np.pi * (part - begin_s) / step_s).mean()
        trembles = float(np.sqrt(-2.0 * np.log(np.abs(turn)))) / (2.0 * np.pi)
        begin_s += float(np.angle(turn)) / (2.0 * np.pi) * step_s
        step_s, begin_s = map(float, np.polyfit(np.round((part - begin_s) / step_s), part, 1))
        rows *= 2
    return (step_s, begin_s) if trembles < NO_CLOCK else (middle_s, float(time_s[0]))


def _unsure(time_s: Floats, at_s: Floats, usual_s: float) -> Flags:
    """Moments (n,) inside a step of time longer than usual, or after it for as long."""
    after = np.flatnonzero(np.diff(time_s) > usual_s) + 1
    begin_s, end_s = time_s[after - 1], 2.0 * time_s[after] - time_s[after - 1]
    inside = np.searchsorted(begin_s, at_s, side="left") - 1  # the last gap that began before
    last_s = np.maximum.accumulate(end_s) if len(end_s) else end_s
    unsure: Flags = (inside >= 0) & (at_s < np.append(last_s, -np.inf)[inside])
    return unsure


def _on_fine_axis(piece: Recording, step_s: float) -> Recording:
    """Steps that vary many-fold: inputs on an axis as fine as the finest of them, the reference only where measured."""
    even = replace(piece.resample(1.0 / step_s, np.inf), step_share=piece.step_share)
    if FORCE not in piece:
        return even
    nearest = np.unique(np.clip(np.round((piece.time_s - even.time_s[0]) / step_s), 0, len(even) - 1).astype(int))
    measured = np.full(len(even), np.nan)
    measured[nearest] = np.interp(even.time_s[nearest], piece.time_s, piece[FORCE])
    return even.with_channels(**{FORCE: measured})


def _of_piece(piece: Recording, wanted: list[str]) -> list[Segment]:
    dt_s = piece.duration_s / (len(piece) - 1)
    inputs = {name: bridged(piece[name], len(piece)) for name in wanted}
    force_n = piece[FORCE] if FORCE in piece else np.full(len(piece), np.nan)
    good = np.all([np.isfinite(column) for column in inputs.values()], axis=0)
    known = np.flatnonzero(np.all([np.isfinite(bridged(piece[name])) for name in wanted], axis=0))
    hidden = _unsure(known.astype(float), np.arange(len(piece), dtype=float), 1.0)
    force_n = np.where(hidden, np.nan, force_n) if hidden.any() else force_n
    edges = np.flatnonzero(np.diff(np.concatenate(([0], good.astype(np.int8), [0]))))
    return [
        Segment(
            piece.name,
            float(piece.time_s[a]),
            dt_s,
            {name: column[a:b] for name, column in inputs.items()},
            force_n[a:b],
            piece.step_share,
        )
        for a, b in zip(edges[::2], edges[1::2], strict=True)
        if b - a >= SHORTEST and np.isfinite(force_n[a:b]).any()
    ]


def bridged(column: Floats, most: int = BRIDGE) -> Floats:
    """Missing runs of up to `most` samples (at most as many as are there) as straight lines; longer ones stay NaN."""
    good = np.isfinite(column)
    if good.all() or not good.any():
        return column
    index = np.arange(len(column))
    filled: Floats = np.interp(index, index[good], column[good])
    edges = np.flatnonzero(np.diff(np.concatenate(([1], good.astype(np.int8), [1]))))
    for a, b in zip(edges[::2], edges[1::2], strict=True):
        if b - a > min(most, int(good.sum())) or a == 0 or b == len(column):
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
