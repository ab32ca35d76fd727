"""A fault of one source in the newest rows of a past: its evidence, and what it changes of the thrust.

    M = 1 + L' G L      G = V' A V of a fault of one newton in each row, L: lower factor of what goes with what
    ln ratio = (|M^-1/2 L' g|^2 - ln det M) / 2      see `evidence`

One factor of M serves a fault of any size at its onset, one that is known there by a reading, and one that is none yet:
a reading adds a multiple of v v' to L' G L and of v to L' g, v: the onset's row of L (Sherman-Morrison).
"""

from math import log
from typing import NamedTuple

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.jit import compiled
from thrustd.sensors.positive import factor

TIED_N = 1.0  # of a fault that has not begun yet, one sigma


class Alone(NamedTuple):
    """Of a fault of one newton in each row alone."""

    f: Floats  # (n, n): V' A V
    g: Floats  # (n,): V' z
    u: Floats  # (n,): V' A c


class Seen(NamedTuple):
    """Of one fault of one newton in the newest m rows."""

    q: Floats  # (m, m): L' G L
    g: Floats  # (m,): L' g
    u: Floats  # (m,): L' V' A c
    pattern: Floats  # (N_SOURCES,)


class Room(NamedTuple):
    """Written over: the factor of M (n, n), and three columns (n,)."""

    work: Floats
    g: Floats
    u: Floats
    v: Floats


class Solved(NamedTuple):
    """Products of M^-1/2 L' g, M^-1/2 L' u and M^-1/2 v; v: what a fault at its onset is of its parts, a row of L."""

    half: float  # of ln det M
    gg: float
    gu: float
    uu: float
    gv: float
    uv: float
    vv: float


@compiled
def room_for(n: int) -> Room:
    return Room(np.empty((n, n)), np.empty(n), np.empty(n), np.empty(n))


@compiled
def grow(shape: Floats, alone: Alone, k: int, across: Floats, seen: Seen) -> None:
    """Of the newest k rows becomes that of k + 1; of q the lower half counts, `across` is written over.

    `shape` (n, n): lower factor of the fault's correlation.
    """
    f, q, g, u, of_g, of_u = alone.f, seen.q, seen.g, seen.u, alone.g[k], alone.u[k]
    g[k] = u[k] = 0.0
    for j in range(k + 1):
        g[j] += shape[k, j] * of_g
        u[j] += shape[k, j] * of_u
        across[j] = 0.5 * f[k, k] * shape[k, j]
        for i in range(j, k):
            across[j] += f[k, i] * shape[i, j]
        q[k, j] = 0.0
    for i in range(k + 1):
        for j in range(i + 1):
            q[i, j] += shape[k, i] * across[j] + across[i] * shape[k, j]


@compiled
def solve(size_n: float, m: int, seen: Seen, shape: Floats, room: Room) -> Solved:
    """Of a fault in the newest m rows, and what a reading of it at its onset, the oldest of them, would need."""
    work, q, gs, us, vs, left, top = room.work, seen.q, room.g, room.u, room.v, seen.g, seen.u
    for i in range(m):
        for j in range(i + 1):
            work[i, j] = size_n * size_n * q[i, j]
        work[i, i] += 1.0
    half = factor(work, m)
    gg = gu = uu = gv = uv = vv = 0.0
    for i in range(m):
        g, u, v = size_n * left[i], size_n * top[i], size_n * shape[m - 1, i]
        for k in range(i):
            g -= work[i, k] * gs[k]
            u -= work[i, k] * us[k]
            v -= work[i, k] * vs[k]
        over = 1.0 / work[i, i]
        g, u, v = g * over, u * over, v * over
        gs[i], us[i], vs[i] = g, u, v
        gg, gu, uu = gg + g * g, gu + g * u, uu + u * u
        gv, uv, vv = gv + g * v, uv + u * v, vv + v * v
    return Solved(half, gg, gu, uu, gv, uv, vv)


@compiled
def answer(s: Solved, more: float, more_g: float) -> tuple[float, float, float]:
    """-> ln of the likelihood ratio, change of T0 and of its variance (Sherman-Morrison).

    A reading at the onset adds `more` v v' to L' G L and `more_g` v to L' g; 0 and 0: there is none.
    """
    gv, wide = s.gv + more_g * s.vv, 1.0 + more * s.vv
    fit = s.gg + more_g * (s.gv + gv) - more * gv * gv / wide
    moved_n = more * s.uv * gv / wide - s.gu - more_g * s.uv
    return 0.5 * (fit - log(wide)) - s.half, moved_n, s.uu - more * s.uv * s.uv / wide


@compiled
def gradual(size_n: float, solved: Solved) -> tuple[float, float, float]:
    """As `answer`, of a fault that is none yet in the oldest of its rows: a reading of 0 +- TIED_N there."""
    ratio, moved_n, more_n2 = answer(solved, 1.0 / TIED_N**2, 0.0)
    return ratio + 0.5 * log(1.0 + (size_n / TIED_N) ** 2), moved_n, more_n2
