"""One pass over the records at one point: residuals, and the normal equations of the regression.

Records pass in blocks with the memory carried along; what grows with the length of a record is a few columns, those of
its physical effects.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thrustd.core.columns import Floats
from thrustd.identify.regression.kernel import run
from thrustd.identify.regression.record import Indices, Record
from thrustd.identify.regression.rows import BLOCK, begun_at, blocks, fading, keeps, kept_rows, run_rows
from thrustd.identify.regression.shape import Point, Shape, core_of
from thrustd.identify.regression.stops import at_rest as stops_at_rest
from thrustd.identify.regression.stops import run_stops
from thrustd.identify.regression.terms import (
    NUDGE,
    Places,
    Seen,
    Term,
    added,
    branched_by,
    deformed,
    inside,
    pushed,
    split,
    sprung,
    turned,
    turning,
)
from thrustd.model.stage import jit

TOUCHES_CORE = "deformation", "spring"
ALL = slice(None)


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
    sites = [term.effect.site for term in shape.terms for _ in term.free]
    touching = [i for i, site in enumerate(sites) if site in TOUCHES_CORE]
    core, beside = simulated(shape, point, record, known) if touching else (found.force, found.force)
    for i in touching:
        moved = replace(point, terms=point.terms + NUDGE * np.eye(len(sites))[i])
        if sites[i] == "spring":
            by = found.gain * _core_run(shape, moved, record, seen)[known] - core
        else:
            by = simulate(shape, moved, record, known) - core - beside
        found.columns[:, i] = by / NUDGE
    return found


def gain_of(parts: Sequence[tuple[Term, Floats]], seen: Seen, places: Places) -> Floats:
    """By which effects multiply the force of the core (k,)."""
    gain = np.ones(seen.d[places].size)
    for term, own in parts:
        if term.effect.site == "gain":
            gain *= turned(term, own, seen, places)
    return gain


def _core_run(shape: Shape, point: Point, record: Record, seen: Seen) -> Floats:
    """Output of curves, relaxation, offset and what effects add there (n,)."""
    core, out = core_of(shape, point, record.dt_s), np.empty(len(record))
    spring = sprung(shape.terms, point.terms, seen)
    run(core, begun_at(shape, point, core, record, seen), seen.d, spring, out)
    out += point.offset
    for term, own in zip(shape.terms, split(shape.terms, point.terms), strict=True):
        if inside(term):
            out += pushed(term, own, seen, ALL) / shape.output_scale
    return out


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


def simulate(shape: Shape, point: Point, record: Record, places: Places = ALL) -> Floats:
    """Free run in units of the shape's scale, at these samples (k,)."""
    turned_core, beside = simulated(shape, point, record, places)
    return turned_core + beside


def simulated(shape: Shape, point: Point, record: Record, places: Places = ALL) -> tuple[Floats, Floats]:
    """The core's part, with the gains applied, and friction with every effect that adds: (k,) each."""
    seen = deformed(shape.terms, point.terms, record.seen)
    parts = list(zip(shape.terms, split(shape.terms, point.terms), strict=True))
    beside = _friction(shape, point, record, seen)[places]
    for term, own in parts:
        if term.effect.site == "force":
            beside = beside + pushed(term, own, seen, places) / shape.output_scale
    return gain_of(parts, seen, places) * _core_run(shape, point, record, seen)[places], beside
