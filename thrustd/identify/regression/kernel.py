"""The core of the model over a block of samples, with its exact gradient in the same recursion.

    w = s f(d),  x = w + sum_i g_i (w - L_i w) + sum_k Re[G_k conj(w - P_k w)],  y = x + h(x)

s: what effects make of the spring, sample by sample; L_i: first-order lags of unit gain at rest; P_k: complex ones, a
pair of poles each; f and h: splines (`curve`). One loop carries, beside the signals, every basis function of f
through every lag: columns for f are exact, those for gains and poles come from the lags themselves. Coefficients of
the lags: `thrustd.model.linear.discretise_mode`.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from thrustd.identify.regression.curve import bspline
from thrustd.model.stage import Floats, jit

Complexes = NDArray[np.complex128]
Bools = NDArray[np.bool_]

FADED = 1e-100  # a factor kept apart goes back into what it multiplies before it is too small to divide by


class Core(NamedTuple):
    """Numbers of the model for one sweep. m real lags, p pairs; a lag is s <- a s + b0 w_before + b1 w."""

    f: Floats  # (n_f,)
    f_zero: Floats  # (n_f,) basis where f is zero: it is taken off
    f_place: Floats  # (2,) low end of the grid, step
    gain: Floats  # (m,)
    lag: Floats  # (m, 3) a, b0, b1
    lag_move: Floats  # (m, 3) their derivatives by the logarithm of the time constant
    pair_gain: Floats  # (p, 2) real and imaginary part
    pair: Complexes  # (p, 3)
    pair_move: Complexes  # (p, 2, 3) by the logarithms of decay and frequency
    h: Floats  # (n_h,), empty: x is y
    h_place: Floats  # (2,)
    move: bool  # columns for the poles are wanted


class Memory(NamedTuple):
    """What the core remembers from sample to sample; changed in place."""

    w: Floats  # (1,)
    touched: Floats  # (5,) of the sample before: first basis function that is not zero, values of it and three more
    lag: Floats  # (m,)
    lag_move: Floats  # (m,)
    lag_basis: Floats  # (m, n_f) of the basis alone, `f_zero` left out
    pair: Complexes  # (p,)
    pair_move: Complexes  # (p, 2)
    pair_basis: Complexes  # (p, n_f)
    spring: Floats  # (1,) s of the sample before
    lag_spring: Floats  # (m,) s behind every lag
    pair_spring: Complexes  # (p,)


def at_rest(core: Core, d: float, spring: float = 1.0) -> Memory:
    """Settled for ever at the input d, with a spring of this relative stiffness."""
    m, p, n = len(core.gain), len(core.pair), len(core.f)
    basis, four = np.zeros(n), np.empty(8)
    first = bspline(d, core.f_place[0], core.f_place[1], n, four)
    basis[first : first + 4] += spring * four[:4]
    w = float((basis - spring * core.f_zero) @ core.f)
    still = np.tile(basis, (m, 1)), np.tile(basis, (p, 1)).astype(complex)
    lags, pairs = np.full(m, w), np.full(p, w + 0j)
    touched = np.concatenate(([first], spring * four[:4]))
    springs = np.array([spring]), np.full(m, spring), np.full(p, spring + 0j)
    return Memory(
        np.array([w]), touched, lags, np.zeros(m), still[0], pairs, np.zeros((p, 2), complex), still[1], *springs
    )


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
        before = memory.w[0]
        x = w
        for i in range(core.gain.size):
            s = core.lag[i, 0] * memory.lag[i] + core.lag[i, 1] * before + core.lag[i, 2] * w
            memory.lag[i] = s
            x += core.gain[i] * (w - s)
        for i in range(core.pair.shape[0]):
            z = core.pair[i, 0] * memory.pair[i] + core.pair[i, 1] * before + core.pair[i, 2] * w
            memory.pair[i] = z
            x += core.pair_gain[i, 0] * (w - z.real) + core.pair_gain[i, 1] * z.imag
        memory.w[0] = w
        if n_h > 0:
            first = bspline(x, core.h_place[0], core.h_place[1], n_h, four)
            total = x
            for q in range(4):
                total += four[q] * core.h[first + q]
            x = total
        y[k] = x


@jit
def run_with_columns(  # noqa: C901 - one recursion, read from top to bottom as the signal flows
    core: Core, memory: Memory, d: Floats, spring: Floats, counted: Bools, y: Floats, slopes: Floats, columns: Floats
) -> None:
    """As `run`; where `counted` (n,), d y / d (f, gains, log tau, pair gains, log poles, h) into columns (n, n_columns)
    and d y / d x into slopes (n,), elsewhere these stay as they were.

    Without `core.move` the columns for poles are left out. A basis function behind a lag only fades between the samples
    that touch it, so the fading is kept as one factor a lag, and only four of the n_f are changed per sample.
    """
    four, bend, sens = np.empty(8), np.empty(8), np.empty(core.f.size)
    n_f, n_h, m, p = core.f.size, core.h.size, core.gain.size, core.pair.shape[0]
    faded, pair_faded = np.ones(m), np.ones(p, np.complex128)
    total_gain = 1.0
    for i in range(m):
        total_gain += core.gain[i]
    for i in range(p):
        total_gain += core.pair_gain[i, 0]
    zero = 0.0
    for j in range(n_f):
        zero += core.f_zero[j] * core.f[j]
    at_tau = n_f + m
    at_pair = at_tau + (m if core.move else 0)
    at_pole = at_pair + 2 * p
    at_h = at_pole + (2 * p if core.move else 0)
    before_first, before_four = int(memory.touched[0]), memory.touched[1:].copy()
    before_spring, sprung = memory.spring[0], spring.size > 0
    for k in range(d.size):
        first = bspline(d[k], core.f_place[0], core.f_place[1], n_f, four)
        now = spring[k] if sprung else 1.0
        w = -zero * now
        for q in range(4):
            four[q] *= now
            w += four[q] * core.f[first + q]
        before, x, wanted = memory.w[0], total_gain * w, counted[k]
        held = total_gain * now if sprung else 1.0  # of what f is at zero, behind the relaxation
        for i in range(m):
            a, b0, b1, g = core.lag[i, 0], core.lag[i, 1], core.lag[i, 2], core.gain[i]
            old = memory.lag[i]
            s = a * old + b0 * before + b1 * w
            memory.lag[i] = s
            x -= g * s
            if sprung:
                memory.lag_spring[i] = a * memory.lag_spring[i] + b0 * before_spring + b1 * now
                held -= g * memory.lag_spring[i]
            if core.move:
                moved = a * memory.lag_move[i] + core.lag_move[i, 0] * old
                moved += core.lag_move[i, 1] * before + core.lag_move[i, 2] * w
                memory.lag_move[i] = moved
            row, fade = memory.lag_basis[i], faded[i] * a
            if fade < FADED:
                for j in range(n_f):
                    row[j] *= fade
                fade = 1.0
            faded[i] = fade
            for q in range(4):
                row[before_first + q] += b0 / fade * before_four[q]
                row[first + q] += b1 / fade * four[q]
        for i in range(p):
            ca, cb0, cb1 = core.pair[i, 0], core.pair[i, 1], core.pair[i, 2]
            gr, gi = core.pair_gain[i, 0], core.pair_gain[i, 1]
            old_z = memory.pair[i]
            z = ca * old_z + cb0 * before + cb1 * w
            memory.pair[i] = z
            x += gi * z.imag - gr * z.real
            if sprung:
                swung = ca * memory.pair_spring[i] + cb0 * before_spring + cb1 * now
                memory.pair_spring[i] = swung
                held += gi * swung.imag - gr * swung.real
            if core.move:
                for q in range(2):
                    turned = ca * memory.pair_move[i, q] + core.pair_move[i, q, 0] * old_z
                    turned += core.pair_move[i, q, 1] * before + core.pair_move[i, q, 2] * w
                    memory.pair_move[i, q] = turned
            line, turn = memory.pair_basis[i], pair_faded[i] * ca
            if abs(turn) < FADED:
                for j in range(n_f):
                    line[j] *= turn
                turn = 1.0 + 0.0j
            pair_faded[i] = turn
            for q in range(4):
                line[before_first + q] += cb0 / turn * before_four[q]
                line[first + q] += cb1 / turn * four[q]
        before_first, before_spring = first, now
        for q in range(4):
            before_four[q] = four[q]
        memory.w[0] = w
        slope = 1.0
        if n_h > 0:
            at = bspline(x, core.h_place[0], core.h_place[1], n_h, bend)
            total = x
            for q in range(4):
                total += bend[q] * core.h[at + q]
                slope += bend[4 + q] * core.h[at + q] / core.h_place[1]
            if wanted:
                for j in range(n_h):
                    columns[k, at_h + j] = 0.0
                for q in range(4):
                    columns[k, at_h + at + q] = bend[q]
            x = total
        y[k] = x
        if not wanted:
            continue
        slopes[k] = slope
        for j in range(n_f):
            sens[j] = -held * core.f_zero[j]
        for q in range(4):
            sens[first + q] += total_gain * four[q]
        for i in range(m):
            columns[k, n_f + i] = slope * (w - memory.lag[i])
            if core.move:
                columns[k, at_tau + i] = -slope * core.gain[i] * memory.lag_move[i]
            weight = core.gain[i] * faded[i]
            if weight != 0.0:
                row = memory.lag_basis[i]
                for j in range(n_f):
                    sens[j] -= weight * row[j]
        for i in range(p):
            z, gr, gi = memory.pair[i], core.pair_gain[i, 0], core.pair_gain[i, 1]
            columns[k, at_pair + 2 * i] = slope * (w - z.real)
            columns[k, at_pair + 2 * i + 1] = slope * z.imag
            if core.move:
                for q in range(2):
                    turned = memory.pair_move[i, q]
                    columns[k, at_pole + 2 * i + q] = slope * (gi * turned.imag - gr * turned.real)
            heavy = -(gr + 1j * gi) * pair_faded[i]  # Re(heavy line) = gi Im - gr Re of what is behind the pair
            line = memory.pair_basis[i]
            for j in range(n_f):
                sens[j] += (heavy * line[j]).real
        for j in range(n_f):
            columns[k, j] = slope * sens[j]
    for i in range(m):
        for j in range(n_f):
            memory.lag_basis[i, j] *= faded[i]
    for i in range(p):
        for j in range(n_f):
            memory.pair_basis[i, j] *= pair_faded[i]
    memory.spring[0] = before_spring
    memory.touched[0] = before_first
    memory.touched[1:] = before_four
