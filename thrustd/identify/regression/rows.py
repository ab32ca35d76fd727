"""Rows of core and friction at the samples that count: run through the record, or put together from what it keeps.

Where neither deformation nor spring are touched, the core is linear in columns that no pass changes: every basis
function of f behind every lag, its own or of an effect. A record of which few samples count keeps them, and no pass
runs through it again.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thrustd.core.columns import Floats
from thrustd.identify.regression.kernel import Core, Lags, Memory, Written, at_rest, run_with_columns
from thrustd.identify.regression.record import Indices, Record
from thrustd.identify.regression.shape import Point, Shape
from thrustd.identify.regression.stops import at_rest as stops_at_rest
from thrustd.identify.regression.stops import run_stops
from thrustd.identify.regression.terms import Seen, sprung, sprung_before

BLOCK = 8192
MOST_KEPT = 15_000_000  # numbers of a record: more are made anew
Rows = Iterator[tuple[Indices, Floats, Floats, Floats, Floats]]


def run_rows(shape: Shape, point: Point, core: Core, record: Record, seen: Seen) -> Rows:
    """In blocks of known samples: places, derivatives and output of the core, slope of its output curve, stops.

    Derivatives as the kernel has them: with those for the gains of branches that effects add.
    """
    spring = sprung(shape.terms, point.terms, seen)
    memory, stops = begun_at(shape, point, core, record, seen), stops_at_rest(shape.radii, record.before)
    width = len(shape.own_columns(len(core.real.gain)))
    narrow, rub = np.zeros((BLOCK, width)), np.empty((BLOCK, len(shape.radii)))
    for part in blocks(len(record)):
        m = part.stop - part.start
        counted, out, slopes = np.isfinite(record.y[part]), np.empty(m), np.zeros(m)
        run_with_columns(core, memory, seen.d[part], spring[part], counted, Written(out, slopes, narrow[:m]))
        run_stops(shape.radii, stops, seen.d[part], rub[:m])
        known = np.flatnonzero(counted)
        yield part.start + known, narrow[known], out[known], slopes[known], rub[known]


def keeps(shape: Shape, core: Core, record: Record, seen: Seen) -> bool:
    """Whether the core is linear in what never changes: every basis function behind every lag."""
    moved = shape.move or seen.turned or any(term.effect.site == "spring" for term in shape.terms)
    bent = shape.h_grid is not None or len(shape.poles) > 0
    if record.kept is None or record.place is not None or moved or bent:
        return False
    return len(record.known) * (1 + len(core.real.gain)) * shape.f_grid.n < MOST_KEPT


def kept_rows(shape: Shape, point: Point, core: Core, record: Record, seen: Seen) -> Rows:
    """As `run_rows`, of columns that the record keeps."""
    assert record.kept is not None
    key = "core", record.before, shape.f_grid, shape.zero, core.real.taps.tobytes(), shape.radii.tobytes()
    if key not in record.kept:
        record.kept[key] = _banks(core, record, shape.radii)
    banks, stops = record.kept[key]
    weights, known = np.concatenate(([1.0], core.real.gain)), record.known
    through = (banks.reshape(-1, len(point.f)) @ point.f).reshape(-1, len(known))  # w, and what every lag has let go
    f = (weights @ banks.reshape(len(weights), -1)).reshape(len(known), -1)
    derivatives, out, slopes = np.column_stack((f, through[1:].T)), weights @ through, np.ones(len(known))
    for part in blocks(len(known)):
        yield known[part], derivatives[part], out[part], slopes[part], stops[part]


def _banks(core: Core, record: Record, radii: Floats) -> tuple[Floats, Floats]:
    """At the known samples: basis of f, and less itself behind every lag (1 + m, k, n_f); stops (k, n_stops)."""
    m, n_f, known = len(core.real.gain), len(core.f), record.known
    banks, stops, at = np.empty((1 + m, len(known), n_f)), np.empty((len(known), len(radii))), 0
    lags = [
        core._replace(real=Lags(np.ones(1), core.real.taps[i : i + 1], core.real.move[i : i + 1])) for i in range(m)
    ]
    cores = [core._replace(real=Lags(np.ones(0), core.real.taps[:0], core.real.move[:0])), *lags]
    memories = [at_rest(one, record.before) for one in cores]
    state, rub, table = stops_at_rest(radii, record.before), np.empty((BLOCK, len(radii))), np.zeros((BLOCK, n_f + 1))
    for part in blocks(len(record)):
        size, counted = part.stop - part.start, np.isfinite(record.y[part])
        where = slice(at, at + int(counted.sum()))
        at, out, slopes = where.stop, np.empty(size), np.empty(size)
        for i, (one, memory) in enumerate(zip(cores, memories, strict=True)):
            written = Written(out, slopes, table[:size, : n_f + min(i, 1)])
            run_with_columns(one, memory, record.d[part], out[:0], counted, written)
            banks[i, where] = table[:size, :n_f][counted]
        run_stops(radii, state, record.d[part], rub[:size])
        stops[where] = rub[:size][counted]
    banks[1:] -= banks[0]
    return banks, stops


def begun_at(shape: Shape, point: Point, core: Core, record: Record, seen: Seen) -> Memory:
    """Settled at the level before, or off it by the numbers that the point has for this record."""
    memory = at_rest(core, record.before, sprung_before(shape.terms, point.terms, seen))
    if record.place is not None and len(point.begin):
        m, p = len(point.gain), len(point.pair_gain)
        off = point.begin.reshape(-1, m + 2 * p)[record.place]
        memory.real.s[:m] += off[:m]
        memory.pairs.s[:] += off[m : m + p] + 1j * off[m + p :]
    return memory


def fading(shape: Shape, point: Point, core: Core, record: Record, places: Indices, slopes: Floats) -> Floats:
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


def blocks(n: int) -> Iterator[slice]:
    for begin in range(0, n, BLOCK):
        yield slice(begin, min(begin + BLOCK, n))
