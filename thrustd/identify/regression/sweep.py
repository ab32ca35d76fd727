"""One pass over the records at one point: residuals, and the normal equations of the regression.

Records pass in blocks with the memory carried along, so that memory stays flat whatever their length.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from thrustd.identify.regression.kernel import Core, Memory, at_rest, run, run_with_columns
from thrustd.identify.regression.shape import Point, Shape, core_of
from thrustd.identify.regression.stops import at_rest as stops_at_rest
from thrustd.identify.regression.stops import run_stops
from thrustd.model.stage import Floats

BLOCK = 8192


@dataclass(frozen=True, slots=True)
class Record:
    """One stretch of data; `before`: the input at which everything had settled when it begins."""

    d: Floats  # (n,) input
    y: Floats  # (n,) output in units of the shape's scale, NaN: not known
    dt_s: float
    before: float
    extras: Floats | None = None  # (n, n_extras)

    def __len__(self) -> int:
        return len(self.d)


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
        core = core_of(shape, point, record.dt_s)
        memory, stops = at_rest(core, record.before), stops_at_rest(shape.radii, record.before)
        residual = np.empty(len(record))
        table = np.empty((BLOCK, shape.n))
        for part in blocks(len(record)):
            rows = table[: part.stop - part.start]
            out = _rows(shape, point, core, memory, stops, record, part, rows)
            missed = record.y[part] - out
            residual[part] = missed
            good = np.isfinite(missed)
            if not good.all():
                rows, missed = rows[good], missed[good]
            matrix += rows.T @ rows
            right += rows.T @ missed
        residuals.append(residual)
    return Normal(matrix, right, residuals)


def _rows(
    shape: Shape, point: Point, core: Core, memory: Memory, stops: Floats, record: Record, part: slice, rows: Floats
) -> Floats:
    """Output (n,) of one block; its derivatives into rows (n, shape.n)."""
    where, out = shape.parts(), np.empty(len(rows))
    core_rows = np.empty((len(rows), shape.n_core))
    run_with_columns(core, memory, record.d[part], out, core_rows)
    rows[:, : shape.n_core] = core_rows
    rows[:, where["offset"]] = 1.0
    rub = np.empty((len(rows), len(shape.radii)))
    run_stops(shape.radii, stops, record.d[part], rub)
    rows[:, where["stops"]] = rub
    out += point.offset + rub @ point.stops
    if record.extras is not None:
        rows[:, where["extras"]] = record.extras[part]
        out += record.extras[part] @ point.extras
    return out


def simulate(shape: Shape, point: Point, record: Record) -> Floats:
    """Free run (n,) in units of the shape's scale."""
    core = core_of(shape, point, record.dt_s)
    memory, stops = at_rest(core, record.before), stops_at_rest(shape.radii, record.before)
    out = np.empty(len(record))
    for part in blocks(len(record)):
        block = np.empty(part.stop - part.start)
        run(core, memory, record.d[part], block)
        rub = np.empty((len(block), len(shape.radii)))
        run_stops(shape.radii, stops, record.d[part], rub)
        block += point.offset + rub @ point.stops
        if record.extras is not None:
            block += record.extras[part] @ point.extras
        out[part] = block
    return out


def blocks(n: int) -> Iterator[slice]:
    for begin in range(0, n, BLOCK):
        yield slice(begin, min(begin + BLOCK, n))
