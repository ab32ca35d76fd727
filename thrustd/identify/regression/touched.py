"""What effects in front of the relaxation do to the output: each of their numbers moved, many in one pass.

    dw_i = s_i f(d_i) - s f(d),    dx_i = dw_i through the lags,    dy_i = dx_i + h(x + dx_i) - h(x)

Relaxation is linear, so that differences alone go through it, side by side. Effects that read the deformation beside
the core are run again where it is another, and no others.
"""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from thrustd.core.columns import Flags, Floats
from thrustd.identify.regression.curve import bspline
from thrustd.identify.regression.free_run import core_run, friction, gain_of
from thrustd.identify.regression.kernel import Core, Memory, Numbers
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.rows import begun_at
from thrustd.identify.regression.shape import Point, Shape, core_of
from thrustd.identify.regression.terms import NUDGE, Seen, Term, inside, pushed, shares, split, sprung, through
from thrustd.model.stage import DEFORMATION, jit

TOUCHES_CORE = "deformation", "spring"
TOGETHER = 8  # numbers that pass side by side
PIECE = 128  # samples that pass through one lag after the other: few enough to stay in the processor's cache
TINY = 1e-200  # what has decayed below is zero: numbers at the end of the exponent range cost a hundred times more
ALL = slice(None)
Parts = Sequence[tuple[Term, Floats]]


class Moved(NamedTuple):
    """One number moved by a small step (`Term.steps`)."""

    number: int  # among those of the terms
    step: float
    seen: Seen
    spring: Floats  # (n,), or () where that is 1
    bends: bool  # the deformation


def touched(shape: Shape, point: Point, record: Record, seen: Seen, gain: Floats, out: Floats) -> None:
    """Derivatives of the output by all numbers of effects that touch the core, into their columns of `out` (k, n)."""
    core, spring = core_of(shape, point, record.dt_s), sprung(shape.terms, point.terms, seen)
    still, counted = begun_at(shape, point, core, record, seen), np.isfinite(record.y)
    beside = _Beside(shape, point, record, seen)
    moves = _moves(shape.terms, point.terms, record.seen, seen, spring)
    for bends, alike in itertools.groupby(moves, lambda one: one.bends):
        while group := list(itertools.islice(alike, TOGETHER)):
            units = [one.step * (np.arange(len(point.terms)) == one.number) for one in group]
            points = [replace(point, terms=point.terms + unit) for unit in units]
            begun = [begun_at(shape, moved, core, record, seen).w[0] - still.w[0] for moved in points]
            by, none = np.empty((len(gain), len(group))), np.empty((0, len(group)))
            same = all(one.spring is spring for one in group)
            d = np.column_stack([one.seen.d for one in group]) if bends else none
            springs = none if same else np.column_stack([one.spring for one in group])
            run_apart(core, still, Inputs(seen.d, spring, d, springs, np.array(begun)), counted, by)
            for one, more in zip(group, by.T, strict=True):
                out[:, one.number] = (beside.moved(one.seen, gain, more) if bends else gain * more) / one.step


def _moves(terms: Sequence[Term], numbers: Floats, read: Seen, seen: Seen, spring: Floats) -> Iterator[Moved]:
    """Deformation and spring with one number after the other moved; `read`: what the transducer says."""
    parts = list(zip(terms, split(terms, numbers), strict=True))
    at = dict(zip(map(id, terms), itertools.accumulate((len(t.free) for t in terms), initial=0), strict=False))
    resprung = any(term.effect.site == "spring" and DEFORMATION in term.effect.channels for term in terms)
    for term, i, step, d in _each([one for one in parts if one[0].effect.site == "deformation"], read, read.d):
        bent = read.at(d)
        yield Moved(at[id(term)] + i, step, bent, sprung(terms, numbers, bent) if resprung else spring, True)
    for term, i, step, s in _each([one for one in parts if one[0].effect.site == "spring"], seen, np.ones(len(seen.d))):
        yield Moved(at[id(term)] + i, step, seen, s, False)


def _each(parts: Parts, seen: Seen, v: Floats) -> Iterator[tuple[Term, int, float, Floats]]:
    """What these effects one after the other make of v (n,) with each number moved; those before are not run again."""
    for place, (term, own) in enumerate(parts):
        plain = through(term, own, seen, v)
        known = all(term.straight) and term.effect.elements is not None
        table = shares(term, term.values(own), seen, ALL) if known else np.empty((0, 0))
        for i, step in enumerate(term.steps(own, NUDGE)):
            unit = step * (np.arange(len(own)) == i)
            moved = plain + step * table[:, i] if known else through(term, own + unit, seen, v)
            for later, numbers in parts[place + 1 :]:
                moved = through(later, numbers, seen, moved)
            yield term, i, float(step), moved
        v = plain


class _Beside:
    """What else of the model reads the deformation, and is another where that is moved."""

    def __init__(self, shape: Shape, point: Point, record: Record, seen: Seen) -> None:
        self._at, self._seen = (shape, point, record), seen
        self._parts = list(zip(shape.terms, split(shape.terms, point.terms), strict=True))
        self._reading = [one for one in self._parts if DEFORMATION in one[0].effect.channels]
        self._gains = any(term.effect.site == "gain" for term, _ in self._reading)
        self._plain: tuple[Floats, Floats, Floats] | None = None

    def moved(self, seen: Seen, gain: Floats, core: Floats) -> Floats:
        """By how much the output (k,) differs, of which `core` is the curves' and the relaxation's part."""
        if self._plain is None:
            shape, point, record = self._at
            whole = core_run(shape, point, record, self._seen)[record.known] if self._gains else np.zeros(0)
            self._plain = (*self._added(self._seen), whole)
        within, beside, whole = self._plain
        now_within, now_beside = self._added(seen)
        core = core + (now_within - within)
        by = gain * core + (now_beside - beside)
        if self._gains:
            by += (gain_of(self._parts, seen, self._at[2].known) - gain) * (whole + core)
        return by

    def _added(self, seen: Seen) -> tuple[Floats, Floats]:
        """Inside the rubber, and beside it with friction: (k,) each."""
        shape, point, record = self._at
        within, beside = np.zeros(len(record.known)), friction(shape, point, record, seen)[record.known]
        for term, own in self._reading:
            if inside(term):
                within += pushed(term, own, seen, record.known) / shape.output_scale
            elif term.effect.site == "force":
                beside += pushed(term, own, seen, record.known) / shape.output_scale
        return within, beside


class Inputs(NamedTuple):
    """Deformation and spring of n samples, and what p numbers make of them."""

    d: Floats  # (n,)
    spring: Floats  # (n,), or () where it is 1
    moved: Floats  # (n, p), or (0, p) where the deformation is the same
    sprung: Floats  # (n, p), or (0, p) where the spring is the same
    begun: Floats  # (p,) by how much the force of the spring differs before the first sample


@jit
def run_apart(core: Core, memory: Memory, inputs: Inputs, counted: Flags, out: Floats) -> None:
    """By how much the outputs (k, p) differ at the samples that are counted; `memory` where they are the same."""
    count, row, n = inputs.begun.size, 0, counted.size
    real = np.empty((core.real.gain.size, count + 1))  # the last: as it is
    swung = np.empty((core.pairs.gain.size, count + 1), np.complex128)
    w, x, four = np.empty((PIECE + 1, count + 1)), np.empty((PIECE, count + 1)), np.empty(8)
    w[0, :count], w[0, count] = inputs.begun, memory.w[0]
    for i in range(real.shape[0]):
        real[i, :count], real[i, count] = inputs.begun, memory.real.s[i]
    for i in range(swung.shape[0]):
        swung[i, :count], swung[i, count] = inputs.begun, memory.pairs.s[i]
    for begin in range(0, n, PIECE):
        m = min(PIECE, n - begin)
        _drawn(core, inputs, begin, m, four, w)
        x[:m] = w[1 : m + 1]
        for i in range(real.shape[0]):
            _through_lag(core.real.taps[i], core.real.gain[i], real[i], m, w, x)
        for i in range(swung.shape[0]):
            _through_pair(core.pairs.taps[i], core.pairs.gain[i], swung[i], m, w, x)
        w[0] = w[m]
        row = _bend(core, x, counted[begin : begin + m], four, row, out)


@jit
def _drawn(core: Core, inputs: Inputs, begin: int, m: int, four: Floats, w: Floats) -> None:
    """Differences of the spring's force from the second row on (m, p + 1), the last column: itself."""
    d, spring, moved, sprung, begun = inputs
    values, low, step = core.f, core.f_place[0], core.f_place[1]
    zero = 0.0
    for j in range(values.size):
        zero += core.f_zero[j] * values[j]
    for k in range(m):
        at = begin + k
        force, stiff = _curve(values, low, step, d[at], four) - zero, 1.0
        if spring.size > 0:
            stiff = spring[at]
        for p in range(begun.size):
            there, now = force, stiff
            if moved.shape[0] > 0 and moved[at, p] != d[at]:
                there = _curve(values, low, step, moved[at, p], four) - zero
            if sprung.shape[0] > 0:
                now = sprung[at, p]
            w[1 + k, p] = now * there - stiff * force
        w[1 + k, begun.size] = stiff * force


@jit
def _through_lag(taps: Floats, gain: float, s: Floats, m: int, w: Floats, x: Floats) -> None:
    a, b0, b1 = taps[0], taps[1], taps[2]
    for k in range(m):
        for p in range(s.size):
            now = a * s[p] + b0 * w[k, p] + b1 * w[k + 1, p]
            x[k, p] += gain * (w[k + 1, p] - now)
            s[p] = now if abs(now) > TINY else 0.0


@jit
def _through_pair(taps: Numbers, gain: complex, s: Numbers, m: int, w: Floats, x: Floats) -> None:
    a, b0, b1 = taps[0], taps[1], taps[2]
    for k in range(m):
        for p in range(s.size):
            now = a * s[p] + b0 * w[k, p] + b1 * w[k + 1, p]
            x[k, p] += (gain * (w[k + 1, p] - now)).real
            s[p] = now if abs(now.real) + abs(now.imag) > TINY else 0.0


@jit
def _bend(core: Core, x: Floats, counted: Flags, four: Floats, row: int, out: Floats) -> int:
    """x + dx + h(x + dx) less x + h(x) where counted; the next row."""
    values, low, step, last = core.h, core.h_place[0], core.h_place[1], out.shape[1]
    for k in range(counted.size):
        if counted[k]:
            for p in range(last):
                out[row, p] = x[k, p]
            if values.size > 0:
                plain = _curve(values, low, step, x[k, last], four)
                for p in range(last):
                    out[row, p] += _curve(values, low, step, x[k, last] + x[k, p], four) - plain
            row += 1
    return row


@jit
def _curve(values: Floats, low: float, step: float, v: float, four: Floats) -> float:
    first, total = bspline(v, low, step, values.size, four), 0.0
    for q in range(4):
        total += four[q] * values[first + q]
    return total
