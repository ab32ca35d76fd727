"""One pass over the records at one point: residuals, and the normal equations of the regression.

Records pass in blocks with the memory carried along; what grows with the length of a record is a few columns, those of
its physical effects.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thrustd.core.columns import Floats
from thrustd.identify.regression.kernel import Core, Memory, Written, at_rest, run, run_with_columns
from thrustd.identify.regression.shape import Point, Shape, core_of
from thrustd.identify.regression.stops import at_rest as stops_at_rest
from thrustd.identify.regression.stops import run_stops
from thrustd.identify.regression.terms import NUDGE, Seen, added, deformed, pushed, split, sprung
from thrustd.identify.segments import DEFORMATION
from thrustd.model.stage import jit

Indices = NDArray[np.intp]

BLOCK = 8192
TOUCHES_CORE = "deformation", "spring", "linear"


@dataclass(frozen=True, slots=True)
class Record:
    """One stretch of data; `before`: the input at which everything had settled when it begins."""

    d: Floats  # (n,) input
    y: Floats  # (n,) output in units of the shape's scale, NaN: not known
    dt_s: float
    before: float
    channels: Mapping[str, Floats] = field(default_factory=dict)  # (n,) each, what effects read
    place: int | None = None  # among the records of which a point knows how they begin

    def __len__(self) -> int:
        return len(self.d)

    @property
    def seen(self) -> Seen:
        return Seen(self.d, {**self.channels, DEFORMATION: self.d}, self.dt_s, self.before)


def head_of(record: Record, n: int, before: float) -> Record:
    """Its first n samples, begun at another input."""
    channels = {name: column[:n] for name, column in record.channels.items()}
    return replace(record, d=record.d[:n], y=record.y[:n], before=before, channels=channels)


@dataclass(frozen=True, slots=True)
class Normal:
    """Normal equations J'J (n, n), J'r (n,) over the samples that count, and every residual."""

    matrix: Floats
    right: Floats
    residuals: list[Floats]  # per record (n,), NaN where the output is not known

    @property
    def squares(self) -> float:
        return float(sum(np.nansum(r * r) for r in self.residuals))


def normal_equations(shape: Shape, point: Point, records: Sequence[Record]) -> Normal:
    matrix, right, residuals = np.zeros((shape.n, shape.n)), np.zeros(shape.n), []
    for record in records:
        residual = np.full(len(record), np.nan)
        for known, rows, missed in columns(shape, point, record):
            residual[known] = missed
            matrix += squared(rows, shape.parts()["h"])
            right += rows.T @ missed
        residuals.append(residual)
    return Normal(matrix, right, residuals)


def squared(rows: Floats, h: slice) -> Floats:
    """rows'rows (n, n), where of the columns h of a curve only four in a row are not zero."""
    if h.stop == h.start:
        return rows.T @ rows
    out = np.zeros((rows.shape[1], rows.shape[1]))
    before, behind = rows[:, : h.start], rows[:, h.stop :]
    out[: h.start, : h.start] = before.T @ before
    out[h.stop :, : h.start] = behind.T @ before
    out[h.stop :, h.stop :] = behind.T @ behind
    _add_narrow(rows, h.start, h.stop, out)
    out[: h.start, h.start :] = out[h.start :, : h.start].T
    out[h.stop :, h] = out[h, h.stop :].T
    return out


@jit
def _add_narrow(rows: Floats, begin: int, end: int, out: Floats) -> None:
    """Products of the columns begin..end with all columns, into their lines of `out`."""
    for k in range(rows.shape[0]):
        row, at = rows[k], begin
        while at < end - 4 and row[at] == 0.0:
            at += 1
        for i in range(at, at + 4):
            value, line = row[i], out[i]
            for j in range(row.size):
                line[j] += value * row[j]


def columns(shape: Shape, point: Point, record: Record) -> Iterator[tuple[Indices, Floats, Floats]]:
    """Blocks of the samples whose output is known: their places (m,), derivatives (m, shape.n), what is missed (m,).

    The table of derivatives is used again for the next block.
    """
    core = core_of(shape, point, record.dt_s)
    seen = deformed(shape.terms, point.terms, record.seen)
    spring, _ = sprung(shape.terms, point.terms, seen)
    whole = _with_terms(shape, point, record, seen) if shape.terms else None
    memory, stops = begun_at(shape, point, core, record, seen), stops_at_rest(shape.radii, record.before)
    where, table = shape.parts(), np.empty((BLOCK, shape.n))
    own = shape.own_columns(len(core.real.gain))
    narrow, rub = np.zeros((BLOCK, len(own))), np.empty((BLOCK, len(shape.radii)))
    for part in blocks(len(record)):
        m = part.stop - part.start
        counted, out, slopes = np.isfinite(record.y[part]), np.empty(m), np.zeros(m)
        run_with_columns(core, memory, seen.d[part], spring[part], counted, Written(out, slopes, narrow[:m]))
        run_stops(shape.radii, stops, seen.d[part], rub[:m])
        known = np.flatnonzero(counted)
        places, rows, rubbed = part.start + known, table[: len(known)], rub[known]
        if shape.grows:
            far = np.abs(seen.d[places]) / shape.radii[-1]
            rows[:, where["growth"].start] = far * (rubbed @ point.stops)
            rubbed = rubbed * (1.0 + point.growth[0] * far)[:, None]
        rows[:, : shape.n_core] = narrow[known] if own.all() else narrow[np.ix_(known, own)]
        rows[:, where["offset"]] = 1.0
        rows[:, where["stops"]] = rubbed
        output = out[known] + point.offset
        if whole is not None:
            rows[:, : where["offset"].stop] *= whole.gain[places, None]
            rows[:, where["terms"]] = whole.columns[places]
            output = whole.output[places]
        else:
            output += rubbed @ point.stops
        if shape.begun:
            rows[:, where["begin"]] = _fading(shape, point, core, record, places, slopes[known])
        yield places, rows, record.y[places] - output


def begun_at(shape: Shape, point: Point, core: Core, record: Record, seen: Seen) -> Memory:
    """Settled at the level before, or off it by the numbers that the point has for this record."""
    _, spring = sprung(shape.terms, point.terms, seen)
    memory = at_rest(core, record.before, spring)
    if record.place is not None and len(point.begin):
        m, p = len(point.gain), len(point.pair_gain)
        off = point.begin.reshape(-1, m + 2 * p)[record.place]
        memory.real.s[:m] += off[:m]
        memory.pairs.s[:] += off[m : m + p] + 1j * off[m + p :]
    return memory


def _fading(shape: Shape, point: Point, core: Core, record: Record, places: Indices, slopes: Floats) -> Floats:
    """d y / d (memory at first, of all records) at these samples (n, begun * (m + 2 p))."""
    each = len(point.gain) + 2 * len(point.pair_gain)
    columns = np.zeros((len(slopes), shape.begun * each))
    if record.place is None or each == 0 or len(places) == 0:
        return columns
    m = len(point.gain)
    pairs = -core.pairs.gain * _powers(core.pairs.taps[:, 0], 1 + places)
    real = -core.real.gain[:m] * _powers(core.real.taps[:m, 0], 1 + places)
    own = np.hstack((real, pairs.real, -pairs.imag))
    columns[:, record.place * each : (record.place + 1) * each] = slopes[:, None] * own
    return columns


def _powers(taps: NDArray[Any], steps: Indices) -> NDArray[Any]:
    """taps ** steps (n, k), steps rising: products of the ones before, which cost a tenth of a power."""
    table = np.tile(taps, (int(steps[-1] - steps[0]) + 1, 1))
    table[0] = taps ** steps[0]
    return np.cumprod(table, axis=0)[steps - steps[0]]


@dataclass(frozen=True, slots=True)
class _Whole:
    """What the effects make of a record: output, gain by which they multiply the core, columns (n, n_terms)."""

    output: Floats
    gain: Floats
    columns: Floats


def _with_terms(shape: Shape, point: Point, record: Record, seen: Seen) -> _Whole:
    scale, nothing = shape.output_scale, np.zeros(len(record))
    plain, rubbed, rest = _parts(shape, point, record, seen)
    output = pushed(shape.terms, point.terms, seen, plain, rubbed, rest)
    gains = tuple(term for term in shape.terms if term.effect.site == "gain")
    gain = np.ones(len(record))
    if gains:
        parts = zip(shape.terms, split(shape.terms, point.terms), strict=True)
        own = np.concatenate([numbers for term, numbers in parts if term.effect.site == "gain"])
        turned = pushed(gains, own, seen, plain, nothing, rest)
        gain = np.divide(turned, plain, out=gain, where=np.abs(plain) > 1e-9 * scale)
    table, at = np.empty((len(record), len(point.terms))), 0
    for term, own in zip(shape.terms, split(shape.terms, point.terms), strict=True):
        if term.effect.site == "force":
            table[:, at : at + len(own)] = added(term, own, seen) / scale
        at += len(own)
    sites = [term.effect.site for term in shape.terms for _ in term.free]
    for i in [i for i, site in enumerate(sites) if site != "force"]:
        numbers = point.terms.copy()
        numbers[i] += NUDGE
        there, moved, rubs = seen, plain, rubbed
        if sites[i] in TOUCHES_CORE:
            there = deformed(shape.terms, numbers, record.seen)
            moved, rubs, _ = _parts(shape, replace(point, terms=numbers), record, there)
        table[:, i] = (pushed(shape.terms, numbers, there, moved, rubs, rest) - output) / (NUDGE * scale)
    return _Whole(output / scale, gain, table)


def _parts(shape: Shape, point: Point, record: Record, seen: Seen) -> tuple[Floats, Floats, float]:
    """Force of core and of friction (n,), and of the core at rest before the record begins, N."""
    (plain, rest), rubbed = _core_run(shape, point, record, seen), _friction(shape, point, record, seen)
    return plain * shape.output_scale, rubbed * shape.output_scale, rest * shape.output_scale


def _core_run(shape: Shape, point: Point, record: Record, seen: Seen) -> tuple[Floats, float]:
    """Output of curves, relaxation and offset (n,), and the one at rest before the record begins."""
    core = core_of(shape, point, record.dt_s)
    still, out = np.empty(1), np.empty(len(record))
    spring, at_first = sprung(shape.terms, point.terms, seen)
    run(core, at_rest(core, record.before, at_first), np.array([record.before]), np.array([at_first]), still)
    run(core, begun_at(shape, point, core, record, seen), seen.d, spring, out)
    return out + point.offset, float(still[0]) + point.offset


def _friction(shape: Shape, point: Point, record: Record, seen: Seen) -> Floats:
    state, out = stops_at_rest(shape.radii, record.before), np.zeros(len(record))
    if not np.any(point.stops):
        return out
    rub = np.empty((BLOCK, len(shape.radii)))
    for part in blocks(len(record)):
        m = part.stop - part.start
        run_stops(shape.radii, state, seen.d[part], rub[:m])
        out[part] = rub[:m] @ point.stops
    return out * (1.0 + point.growth[0] * np.abs(seen.d) / shape.radii[-1]) if shape.grows else out


def simulate(shape: Shape, point: Point, record: Record) -> Floats:
    """Free run (n,) in units of the shape's scale."""
    seen = deformed(shape.terms, point.terms, record.seen)
    force, rubbed, rest = _parts(shape, point, record, seen)
    out: Floats = pushed(shape.terms, point.terms, seen, force, rubbed, rest) / shape.output_scale
    return out


def blocks(n: int) -> Iterator[slice]:
    for begin in range(0, n, BLOCK):
        yield slice(begin, min(begin + BLOCK, n))
