"""Smoothing of one engine's flight, for after the landing: Rauch-Tung-Striebel, and what the filter considers stays.

The errors of both sources e = [h, c, d] come back with the thrust: what was learnt of them later, at another
thrust, is no news of now. So thrust and rate m = [T, r] are smoothed given the errors as they were filtered. With
B = P_me P_ee^-1, and A = P_mm - B P_em of the covariance of m left when e is known, and B', A' of the predicted one:

    C = A F^T A'^-1,   m_s = m + C (m_s+ - F m - B' (e+ - F e)),   A_s = A + C (A_s+ - A') C^T

run backwards over what the filter wrote on its `Tape` step by step, with the very F and Q that it used. What is wrong
with e is wrong with m_s by D, that of m by B and that of m_s+ by D+; it hardly changes within the steps smoothed over:

    D = B + C (D+ - F B),   P_s = A_s + D P_ee D^T

Reference: Brown & Hwang, ch. 6; Schmidt 1966 (consider states).
"""

from array import array
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from thrustd.core.columns import Floats
from thrustd.fusion.dynamics import MOUNT, N_STATE, RATE, THRUST

UPPER = np.triu_indices(N_STATE)
N_UPPER = len(UPPER[0])
N_MOTION = N_STATE + 1  # F and Q are diagonal but for thrust and rate
BLOCK = 4096  # steps whose gains are solved at once
MOVING, ERRORS = slice(THRUST, MOUNT), slice(MOUNT, N_STATE)


class Smoothed(NamedTuple):
    """All (n,), one row per step on the tape."""

    t_ns: npt.NDArray[np.int64]
    thrust_n: Floats
    thrust_std_n: Floats
    thrust_rate_n_s: Floats


class Tape:
    """State, covariance and motion of every step, some 260 bytes each: 90 MB for an hour of two engines at 50 Hz."""

    def __init__(self) -> None:
        self._t_ns = array("q")
        self._rows = array("d")

    def write(self, t_ns: int, x: Floats, p: Floats, f: Floats, q: Floats) -> None:
        """One step: the state (5, 1) and covariance (5, 5) after it, and how they were predicted, each (5, 5)."""
        self._t_ns.append(t_ns)
        self._rows.extend(x[:, 0])
        self._rows.extend(p[UPPER])
        for matrix in (f, q):
            self._rows.extend(matrix.diagonal())
            self._rows.append(matrix[THRUST, RATE])

    def __len__(self) -> int:
        return len(self._t_ns)

    @property
    def t_ns(self) -> npt.NDArray[np.int64]:
        return np.array(self._t_ns, dtype=np.int64)

    def steps(self, first: int, last: int) -> tuple[Floats, Floats, Floats, Floats]:
        """(x (n, 5), P, F, Q (n, 5, 5)) of the steps first .. last - 1."""
        width = N_STATE + N_UPPER + 2 * N_MOTION
        rows = np.array(self._rows[first * width : last * width]).reshape(-1, width)
        x, upper, f, q = np.split(rows, np.cumsum([N_STATE, N_UPPER, N_MOTION]), axis=1)
        p = np.zeros((len(rows), N_STATE, N_STATE))
        p[:, UPPER[0], UPPER[1]] = p[:, UPPER[1], UPPER[0]] = upper
        return x, p, _motion(f, symmetric=False), _motion(q, symmetric=True)


def _motion(rows: Floats, symmetric: bool) -> Floats:
    matrix = np.zeros((len(rows), N_STATE, N_STATE))
    matrix[:, range(N_STATE), range(N_STATE)] = rows[:, :N_STATE]
    matrix[:, THRUST, RATE] = rows[:, N_STATE]
    if symmetric:
        matrix[:, RATE, THRUST] = rows[:, N_STATE]
    return matrix


class _Known(NamedTuple):
    """Smoothed, at one step."""

    moving: Floats  # (2,) T, r given the filtered errors
    spread: Floats  # (2, 2) A_s
    by_errors: Floats  # (2, 3) D


def smooth(tape: Tape) -> Smoothed:
    """Smooth a flight. An empty tape gives empty rows."""
    n = len(tape)
    thrust_n, std_n, rate_n_s = np.zeros(n), np.zeros(n), np.zeros(n)
    later: _Known | None = None  # the first step of the block after
    for first in range((n - 1) // BLOCK * BLOCK if n else -1, -1, -BLOCK):
        last = min(first + BLOCK, n)
        moving, std_n[first:last], later = _smooth_block(tape.steps(first, min(last + 1, n)), last - first, later)
        thrust_n[first:last], rate_n_s[first:last] = moving.T
    return Smoothed(tape.t_ns, thrust_n, std_n, rate_n_s)


def _smooth_block(
    steps: tuple[Floats, Floats, Floats, Floats], n: int, later: _Known | None
) -> tuple[Floats, Floats, _Known]:
    """(m_s (n, 2), sigma of T (n,), first step of this block); `steps` hold one row more when there is a `later`."""
    x, p, f, q = steps
    ahead_p = f[1:] @ p[:-1] @ f[1:].transpose(0, 2, 1) + q[1:]
    ahead_x = (f[1:] @ x[:-1, :, None])[:, :, 0]
    (b, a), (ahead_b, ahead_a) = _given_errors(p), _given_errors(ahead_p)
    learnt = (ahead_b @ (x[1:] - ahead_x)[:, ERRORS, None])[:, :, 0]
    # C^T = A'^-1 F A: solving is better conditioned than inverting
    gains = np.linalg.solve(ahead_a, f[1:, MOVING, MOVING] @ a[:-1]).transpose(0, 2, 1)
    forget = b[:-1] - gains @ f[1:, MOVING, MOVING] @ b[:-1]
    ms, spread, by_errors = x[:n, MOVING].copy(), a[:n].copy(), b[:n].copy()
    known = later or _Known(ms[-1], spread[-1], by_errors[-1])
    for k in range(len(gains) - 1, -1, -1):
        c = gains[k]
        ms[k] = x[k, MOVING] + c @ (known.moving - ahead_x[k, MOVING] - learnt[k])
        spread[k] = a[k] + c @ (known.spread - ahead_a[k]) @ c.T
        by_errors[k] = forget[k] + c @ known.by_errors
        known = _Known(ms[k], spread[k], by_errors[k])
    of_errors = by_errors @ p[:n, ERRORS, ERRORS] @ by_errors.transpose(0, 2, 1)
    variance = np.minimum((spread + of_errors)[:, THRUST, THRUST], p[:n, THRUST, THRUST])  # more is known, never less
    std_n: Floats = np.sqrt(variance)
    return ms, std_n, known


def _given_errors(p: Floats) -> tuple[Floats, Floats]:
    """(B (n, 2, 3), A (n, 2, 2)) of covariances (n, 5, 5)."""
    b = np.asarray(np.linalg.solve(p[:, ERRORS, ERRORS], p[:, ERRORS, MOVING]), np.float64).transpose(0, 2, 1)
    return b, p[:, MOVING, MOVING] - b @ p[:, ERRORS, MOVING]
