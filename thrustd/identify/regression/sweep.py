"""One pass over the records at one point: residuals, and the normal equations of the regression.

Records pass in blocks with the memory carried along; what grows with the length of a record is a few columns, those of
its physical effects.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from thrustd.core.columns import Floats
from thrustd.identify.regression.free_run import gain_of
from thrustd.identify.regression.noise import Whitener
from thrustd.identify.regression.record import Indices, Record
from thrustd.identify.regression.rows import BLOCK, fading, keeps, kept_rows, run_rows
from thrustd.identify.regression.shape import Point, Shape, core_of
from thrustd.identify.regression.terms import NUDGE, Seen, added, branched_by, deformed, inside, split, turning
from thrustd.identify.regression.touched import TOUCHES_CORE, touched
from thrustd.model.stage import jit


@dataclass(frozen=True, slots=True)
class Normal:
    """Normal equations J'J (n, n), J'r (n,) over the samples that count, made white, and every residual."""

    matrix: Floats
    right: Floats
    residuals: list[Floats]  # per record (n,), NaN where the output is not known
    white: list[Floats]  # the same made white (`noise`)

    @property
    def squares(self) -> float:
        return float(sum(np.nansum(r * r) for r in self.white))


def normal_equations(shape: Shape, point: Point, records: Sequence[Record]) -> Normal:
    matrix, right, residuals, white = np.zeros((shape.n, shape.n)), np.zeros(shape.n), [], []
    for record in records:
        residual, own = np.full(len(record), np.nan), np.full(len(record), np.nan)
        along = whitening(record)
        for known, rows, missed in columns(shape, point, record):
            residual[known] = np.where(np.isnan(missed), np.inf, missed)  # a formula is none here: no place to be
            rows, missed = along(known, rows, missed)
            own[known] = np.where(np.isnan(missed), np.inf, missed)
            matrix += squared(rows, shape.parts()["h"]) if record.lasting is None else rows.T @ rows
            right += rows.T @ missed
        residuals.append(residual)
        white.append(own)
    return Normal(matrix, right, residuals, white)


def whitening(record: Record) -> Callable[[Indices, Floats, Floats], tuple[Floats, Floats]]:
    """Makes derivatives (m, n) and what is missed (m,) of the blocks of `columns` white, in place, in order."""
    if record.lasting is None:
        return lambda places, rows, missed: (rows, missed)
    of_rows, of_missed = (Whitener(record.lasting, record.dt_s) for _ in range(2))

    def along(places: Indices, rows: Floats, missed: Floats) -> tuple[Floats, Floats]:
        of_rows.whiten(rows, places)
        of_missed.whiten(missed[:, None], places)
        return rows, missed

    return along


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
    where, table, at = shape.parts(), np.empty((BLOCK, shape.n)), 0
    whole = _with_terms(shape, point, record, seen) if shape.terms else None
    made = kept_rows if keeps(shape, core, record, seen) else run_rows
    n_lags, first = len(core.real.gain), shape.f_grid.n + len(shape.taus_s)
    own, branched = shape.own_columns(n_lags), branched_by(shape.terms, point.terms)
    for places, derivatives, out, slopes, rubbed in made(shape, point, core, record, seen):
        rows, part = table[: len(places)], slice(at, at + len(places))
        at += len(places)
        if shape.grows:
            far = np.abs(seen.d[places]) / shape.radii[-1]
            rows[:, where["growth"].start] = far * (rubbed @ point.stops)
            rubbed = rubbed * (1.0 + point.growth[0] * far)[:, None]
        rows[:, : shape.n_core] = derivatives if own.all() else derivatives[:, own]
        rows[:, where["offset"]] = 1.0
        rows[:, where["stops"]] = rubbed
        output = out + point.offset
        if whole is not None:
            output = output + whole.inside[part]
            rows[:, where["terms"]] = whole.columns[part]
            if len(branched):
                through = derivatives[:, first : shape.f_grid.n + n_lags] @ branched
                rows[:, where["terms"]] += whole.gain[part, None] * through
            if whole.turns:
                rows[:, where["terms"]] += whole.turning[part] * output[:, None]
                rows[:, : where["offset"].stop] *= whole.gain[part, None]
                output = whole.gain[part] * output
            output = output + whole.force[part]
        output += rubbed @ point.stops
        if shape.begun:
            rows[:, where["begin"]] = fading(shape, point, core, record, places, slopes)
        yield places, rows, record.y[places] - output


@dataclass(frozen=True, slots=True)
class _Whole:
    """What the effects make of the known samples, in units of the output."""

    force: Floats  # (k,) that they add
    inside: Floats  # (k,) that they add to the core, before gains
    gain: Floats  # (k,) by which they multiply the core
    columns: Floats  # (k, n_terms)
    turning: Floats  # (k, n_terms) to be multiplied by the core
    turns: bool  # any gain is not 1 for good


def _with_terms(shape: Shape, point: Point, record: Record, seen: Seen) -> _Whole:
    known, parts = record.known, list(zip(shape.terms, split(shape.terms, point.terms), strict=True))
    n, size, at = len(known), (len(known), len(point.terms)), 0
    gain, turns = gain_of(parts, seen, known), any(term.effect.site == "gain" for term in shape.terms)
    found = _Whole(np.zeros(n), np.zeros(n), gain, np.zeros(size), np.zeros(size), turns)
    for term, own in parts:
        part = slice(at, at + len(own))
        at = part.stop
        if term.effect.site == "force":
            force, found.columns[:, part] = added(term, own, seen, known)
            found.force[:] += force
        elif inside(term):
            force, columns_of = added(term, own, seen, known)
            found.columns[:, part] = found.gain[:, None] * columns_of
            found.inside[:] += force
        elif term.effect.site == "gain":
            others = gain_of([(one, numbers) for one, numbers in parts if one is not term], seen, known)
            found.turning[:, part] = others[:, None] * turning(term, own, NUDGE, seen, known)
    found.force[:] /= shape.output_scale
    found.inside[:] /= shape.output_scale
    found.columns[:] /= shape.output_scale
    if any(term.effect.site in TOUCHES_CORE for term in shape.terms):
        touched(shape, point, record, seen, gain, found.columns)
    return found
