"""The core of the model over a block of samples, with its exact gradient in the same recursion.

    w = s f(d),  x = w + sum_i Re[g_i (w - L_i w)],  y = x + h(x)

s: what effects make of the spring, sample by sample; L_i: first-order lags of unit gain at rest, real ones and complex
ones, a pair of poles each; f and h: splines (`curve`). Beside the signals every basis function of f passes through
every lag: columns for f are exact, those for gains and poles come from the lags themselves. Coefficients of the lags:
`thrustd.model.linear.discretise_mode`.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from thrustd.core.columns import Flags
from thrustd.identify.regression.curve import bspline
from thrustd.model.stage import Floats, jit

Numbers = NDArray[Any]  # float64 of real lags, complex128 of pairs
Integers = NDArray[np.int64]

PIECE = 512  # samples that pass through one lag after the other: few enough to stay in the processor's cache
FADED = 1e-100  # a factor kept apart goes back into what it multiplies before it is too small to divide by


class Lags(NamedTuple):
    """n first-order lags of one kind, real or complex: s <- a s + b0 w_before + b1 w."""

    gain: Numbers  # (n,)
    taps: Numbers  # (n, 3) a, b0, b1
    move: Numbers  # (n, 1 or 2, 3) their derivatives: by log tau, or by the logarithms of decay and frequency


class Core(NamedTuple):
    """Numbers of the model for one sweep."""

    f: Floats  # (n_f,)
    f_zero: Floats  # (n_f,) basis where f is zero: it is taken off
    f_place: Floats  # (2,) low end of the grid, step
    real: Lags
    pairs: Lags
    h: Floats  # (n_h,), empty: x is y
    h_place: Floats  # (2,)
    move: bool  # columns for the poles are wanted


class Lagged(NamedTuple):
    """What n lags of one kind remember."""

    s: Numbers  # (n,)
    move: Numbers  # (n, 1 or 2)
    basis: Numbers  # (n, n_f) of the basis alone, `f_zero` left out
    spring: Numbers  # (n,) of the spring


class Memory(NamedTuple):
    """What the core remembers from sample to sample; changed in place."""

    w: Floats  # (1,)
    touched: Floats  # (5,) of the sample before: first basis function that is not zero, values of it and three more
    spring: Floats  # (1,) s of the sample before
    real: Lagged
    pairs: Lagged


def at_rest(core: Core, d: float, spring: float = 1.0) -> Memory:
    """Settled for ever at the input d, with a spring of this relative stiffness."""
    basis, four = np.zeros(len(core.f)), np.empty(8)
    first = bspline(d, core.f_place[0], core.f_place[1], len(core.f), four)
    basis[first : first + 4] += spring * four[:4]
    w = float((basis - spring * core.f_zero) @ core.f)
    touched = np.concatenate(([first], spring * four[:4]))
    return Memory(np.array([w]), touched, np.array([spring]), *(_settled(lags, w, basis, spring) for lags in core[3:5]))


def _settled(lags: Lags, w: float, basis: Floats, spring: float) -> Lagged:
    n, kind = len(lags.gain), lags.taps.dtype
    still = np.tile(basis, (n, 1)).astype(kind)
    return Lagged(np.full(n, w, kind), np.zeros(lags.move.shape[:2], kind), still, np.full(n, spring, kind))


@jit
def run(core: Core, memory: Memory, d: Floats, spring: Floats, y: Floats) -> None:
    """Output (n,) for the input d (n,) and the spring's relative stiffness (n,), or () where that is 1."""
    four = np.empty(8)
    n_f, n_h = core.f.size, core.h.size
    zero = 0.0
    for j in range(n_f):
        zero += core.f_zero[j] * core.f[j]
    for k in range(d.size):
        first = bspline(d[k], core.f_place[0], core.f_place[1], n_f, four)
        w = -zero
        for q in range(4):
            w += four[q] * core.f[first + q]
        if spring.size > 0:
            w *= spring[k]
        before, x = memory.w[0], w
        for i in range(core.real.gain.size):
            taps = core.real.taps
            s = taps[i, 0] * memory.real.s[i] + taps[i, 1] * before + taps[i, 2] * w
            memory.real.s[i] = s
            x += core.real.gain[i] * (w - s)
        for i in range(core.pairs.gain.size):
            swings = core.pairs.taps
            z = swings[i, 0] * memory.pairs.s[i] + swings[i, 1] * before + swings[i, 2] * w
            memory.pairs.s[i] = z
            x += (core.pairs.gain[i] * (w - z)).real
        memory.w[0] = w
        if n_h > 0:
            first = bspline(x, core.h_place[0], core.h_place[1], n_h, four)
            total = x
            for q in range(4):
                total += four[q] * core.h[first + q]
            x = total
        y[k] = x


class _Piece(NamedTuple):
    """Up to PIECE samples on their way; where one more is held, it is that before the first."""

    first: Integers  # (n + 1,) basis function of f that is not zero
    basis: Floats  # (n + 1, 4) it and three more, times the spring
    w: Floats  # (n + 1,)
    spring: Floats  # (n + 1,)
    x: Floats  # (n,)
    held: Floats  # (n,) of what f is at zero, behind the relaxation
    sprung: bool  # the spring is not 1 everywhere


@jit
def _total_gain(core: Core) -> float:
    """What passes by the lags."""
    total = 1.0
    for gain in core.real.gain:
        total += gain
    for pair in core.pairs.gain:
        total += pair.real
    return total


@jit
def _begin(core: Core, memory: Memory, piece: _Piece, d: Floats, spring: Floats) -> None:
    """f(d), and what of it passes by the lags; the last sample into the memory."""
    total_gain, zero, four = _total_gain(core), 0.0, np.empty(8)
    for j in range(core.f.size):
        zero += core.f_zero[j] * core.f[j]
    piece.first[0], piece.w[0], piece.spring[0] = int(memory.touched[0]), memory.w[0], memory.spring[0]
    piece.basis[0] = memory.touched[1:]
    for k in range(d.size):
        first = bspline(d[k], core.f_place[0], core.f_place[1], core.f.size, four)
        now = spring[k] if piece.sprung else 1.0
        w = -zero * now
        for q in range(4):
            piece.basis[k + 1, q] = four[q] * now
            w += piece.basis[k + 1, q] * core.f[first + q]
        piece.first[k + 1], piece.w[k + 1], piece.spring[k + 1] = first, w, now
        piece.x[k] = total_gain * w
        piece.held[k] = total_gain * now if piece.sprung else 1.0
    memory.touched[0], memory.w[0], memory.spring[0] = piece.first[d.size], piece.w[d.size], piece.spring[d.size]
    memory.touched[1:] = piece.basis[d.size]


@jit
def _signals(lags: Lags, lagged: Lagged, i: int, piece: _Piece, moves: bool, counted: Flags, own: Floats) -> None:
    """Through one lag: what it takes off x and `held`; columns of its gain and its poles into `own` (n, ...)."""
    a, b0, b1, gain = lags.taps[i, 0], lags.taps[i, 1], lags.taps[i, 2], lags.gain[i]
    s, width, path = lagged.s[i], lags.move.shape[1], np.empty(counted.size + 1, lags.taps.dtype)
    path[0] = s
    for k in range(counted.size):
        s = a * s + b0 * piece.w[k] + b1 * piece.w[k + 1]
        path[k + 1] = s
        piece.x[k] -= (gain * s).real
        if counted[k]:
            own[k, width * i] = piece.w[k + 1] - s.real
            if width > 1:
                own[k, width * i + 1] = s.imag
    for q in range(width if moves else 0):
        by, moved, at = lags.move[i, q], lagged.move[i, q], width * (lags.gain.size + i) + q
        for k in range(counted.size):
            moved = a * moved + (by[0] * path[k] + by[1] * piece.w[k] + by[2] * piece.w[k + 1])
            if counted[k]:
                own[k, at] = -(gain * moved).real
        lagged.move[i, q] = moved
    lagged.s[i] = s
    if piece.sprung:
        swung = lagged.spring[i]
        for k in range(counted.size):
            swung = a * swung + b0 * piece.spring[k] + b1 * piece.spring[k + 1]
            piece.held[k] -= (gain * swung).real
        lagged.spring[i] = swung


@jit
def _basis(lags: Lags, lagged: Lagged, i: int, faded: Numbers, piece: _Piece, counted: Flags, out: Floats) -> None:
    """Every basis function through one lag: off the columns of f, `out` (n, n_f).

    It only fades between the samples that touch it, so the fading is kept as one factor, and only four are changed;
    what a sample adds at its own time and at the next one is added at once where nothing is read between.
    """
    a, b0, b1, gain = lags.taps[i, 0], lags.taps[i, 1], lags.taps[i, 2], lags.gain[i]
    fade, row, first, basis = faded[i], lagged.basis[i], piece.first, piece.basis
    grown, owed, back = 1.0 / fade, 0.0 * fade, 1.0 / a
    for k in range(counted.size):
        fade *= a
        if abs(fade) < FADED:
            owed *= fade
            for j in range(row.size):
                row[j] *= fade
            fade, grown = 1.0 + 0.0 * fade, 1.0 + 0.0 * fade
        else:
            grown *= back
        _add_four(row, first[k], owed + b0 * grown, basis[k])
        owed = b1 * grown
        weight = gain * fade
        if counted[k] and weight != 0.0:
            _add_four(row, first[k + 1], owed, basis[k + 1])
            owed *= 0.0
            for j in range(row.size):
                out[k, j] -= (weight * row[j]).real
    _add_four(row, first[counted.size], owed, basis[counted.size])
    faded[i] = fade


@jit
def _add_four(row: Numbers, at: int, weight: Any, four: Floats) -> None:
    for q in range(4):
        row[at + q] += weight * four[q]


@jit
def _bend(core: Core, x: Floats, counted: Flags, y: Floats, slopes: Floats, own: Floats) -> None:
    """Where counted y = x + h(x) (n,), its slopes, and columns of h into `own` (n, n_h)."""
    four = np.empty(8)
    for k in np.flatnonzero(counted):
        total, slope = x[k], 1.0
        if core.h.size > 0:
            at = bspline(x[k], core.h_place[0], core.h_place[1], core.h.size, four)
            for q in range(4):
                total += four[q] * core.h[at + q]
                slope += four[4 + q] * core.h[at + q] / core.h_place[1]
            own[k] = 0.0
            own[k, at : at + 4] = four[:4]
        y[k], slopes[k] = total, slope


@jit
def _write(core: Core, memory: Memory, faded: Any, piece: _Piece, counted: Flags, columns: Floats) -> None:
    """Columns of f, gains and poles of one piece, d x by d each."""
    n_f, m, total_gain = core.f.size, core.real.gain.size, _total_gain(core)
    at_pairs = n_f + (2 * m if core.move else m)
    for i in range(m):
        _signals(core.real, memory.real, i, piece, core.move, counted, columns[:, n_f:])
    for i in range(core.pairs.gain.size):
        _signals(core.pairs, memory.pairs, i, piece, core.move, counted, columns[:, at_pairs:])
    for k in range(counted.size):
        if counted[k]:
            for j in range(n_f):
                columns[k, j] = -piece.held[k] * core.f_zero[j]
            for q in range(4):
                columns[k, piece.first[k + 1] + q] += total_gain * piece.basis[k + 1, q]
    for i in range(m):
        _basis(core.real, memory.real, i, faded[0], piece, counted, columns[:, :n_f])
    for i in range(core.pairs.gain.size):
        _basis(core.pairs, memory.pairs, i, faded[1], piece, counted, columns[:, :n_f])


class Written(NamedTuple):
    """What a run with derivatives writes, samples first."""

    y: Floats  # (n,)
    slopes: Floats  # (n,) d y / d x
    columns: Floats  # (n, n_columns) d y / d (f, gains, log tau, pair gains, log poles, h)


@jit
def run_with_columns(core: Core, memory: Memory, d: Floats, spring: Floats, counted: Flags, written: Written) -> None:
    """As `run`, but output and derivatives are written only where `counted` (n,), elsewhere they stay as they were.
    Without `core.move` there are none for poles.
    """
    y, slopes, columns = written
    n, at_h = PIECE, columns.shape[1] - core.h.size
    faded = np.ones_like(core.real.gain), np.ones_like(core.pairs.gain)
    first, basis = np.empty(n + 1, np.int64), np.empty((n + 1, 4))
    for begin in range(0, d.size, n):
        part = slice(begin, min(begin + n, d.size))
        x, held, wanted, rows = np.empty(len(d[part])), np.empty(n), counted[part], columns[part]
        piece = _Piece(first, basis, np.empty(n + 1), np.empty(n + 1), x, held, spring.size > 0)
        _begin(core, memory, piece, d[part], spring[part])
        _write(core, memory, faded, piece, wanted, rows)
        _bend(core, x, wanted, y[part], slopes[part], rows[:, at_h:])
        for k in range(wanted.size):
            for j in range(at_h if wanted[k] else 0):
                rows[k, j] *= slopes[begin + k]
    for i in range(core.real.gain.size):
        memory.real.basis[i] *= faded[0][i]
    for i in range(core.pairs.gain.size):
        memory.pairs.basis[i] *= faded[1][i]
