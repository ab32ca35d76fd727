"""Rauch-Tung-Striebel smoothing of one engine's flight, for after the landing.

    P' = F P F^T + Q,   C = P F^T P'^-1,   x_s = x + C (x_s+ - F x),   P_s = P + C (P_s+ - P') C^T

run backwards over what the filter wrote on its `Tape` step by step, with the very F and Q that it used. What the filter
learnt late (the errors of both routes, above all) corrects what it had said early. Reference: Brown & Hwang, ch. 6.
"""

from array import array
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from thrustd.fusion.dynamics import N_STATE, RATE, THRUST, Matrix

UPPER = np.triu_indices(N_STATE)
N_UPPER = len(UPPER[0])
N_MOTION = N_STATE + 1  # F and Q are diagonal but for thrust and rate
BLOCK = 4096  # steps whose gains are solved at once


class Smoothed(NamedTuple):
    """All (n,), one row per step on the tape."""

    t_ns: npt.NDArray[np.int64]
    thrust_n: Matrix
    thrust_std_n: Matrix
    thrust_rate_n_s: Matrix


class Tape:
    """State, covariance and motion of every step, some 330 bytes each: 150 MB for an hour of two engines at 50 Hz."""

    def __init__(self) -> None:
        self._t_ns = array("q")
        self._rows = array("d")

    def write(self, t_ns: int, x: Matrix, p: Matrix, f: Matrix, q: Matrix) -> None:
        """One step: the state (6, 1) and covariance (6, 6) after it, and how they were predicted, each (6, 6)."""
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

    def steps(self, first: int, last: int) -> tuple[Matrix, Matrix, Matrix, Matrix]:
        """(x (n, 6), P, F, Q (n, 6, 6)) of the steps first .. last - 1."""
        width = N_STATE + N_UPPER + 2 * N_MOTION
        rows = np.array(self._rows[first * width : last * width]).reshape(-1, width)
        x, upper, f, q = np.split(rows, np.cumsum([N_STATE, N_UPPER, N_MOTION]), axis=1)
        p = np.zeros((len(rows), N_STATE, N_STATE))
        p[:, UPPER[0], UPPER[1]] = p[:, UPPER[1], UPPER[0]] = upper
        return x, p, _motion(f, symmetric=False), _motion(q, symmetric=True)


def _motion(rows: Matrix, symmetric: bool) -> Matrix:
    matrix = np.zeros((len(rows), N_STATE, N_STATE))
    matrix[:, range(N_STATE), range(N_STATE)] = rows[:, :N_STATE]
    matrix[:, THRUST, RATE] = rows[:, N_STATE]
    if symmetric:
        matrix[:, RATE, THRUST] = rows[:, N_STATE]
    return matrix


def smooth(tape: Tape) -> Smoothed:
    """Smooth a flight. An empty tape gives empty rows."""
    n = len(tape)
    thrust_n, std_n, rate_n_s = np.zeros(n), np.zeros(n), np.zeros(n)
    later: tuple[Matrix, Matrix] | None = None  # smoothed (x, P) of the first step of the block after
    for first in range((n - 1) // BLOCK * BLOCK if n else -1, -1, -BLOCK):
        last = min(first + BLOCK, n)
        x, p = _smooth_block(tape.steps(first, min(last + 1, n)), last - first, later)
        thrust_n[first:last], rate_n_s[first:last] = x[:, THRUST], x[:, RATE]
        std_n[first:last] = np.sqrt(p[:, THRUST, THRUST])
        later = x[0], p[0]
    return Smoothed(tape.t_ns, thrust_n, std_n, rate_n_s)


def _smooth_block(
    steps: tuple[Matrix, Matrix, Matrix, Matrix], n: int, later: tuple[Matrix, Matrix] | None
) -> tuple[Matrix, Matrix]:
    """Smoothed (x (n, 6), P (n, 6, 6)) of one block; `steps` hold one row more when there is a `later` block."""
    x, p, f, q = steps
    xs, ps = x[:n].copy(), p[:n].copy()
    fp = f[1:] @ p[:-1]
    ahead_p = fp @ f[1:].transpose(0, 2, 1) + q[1:]
    ahead_x = (f[1:] @ x[:-1, :, None])[:, :, 0]
    # C^T = P'^-1 F P: solving is better conditioned than inverting
    gains = np.linalg.solve(ahead_p, fp).transpose(0, 2, 1)
    next_x, next_p = later if later is not None else (xs[-1], ps[-1])
    for k in range(len(gains) - 1, -1, -1):
        c = gains[k]
        next_x = xs[k] = x[k] + c @ (next_x - ahead_x[k])
        next_p = p[k] + c @ (next_p - ahead_p[k]) @ c.T
        next_p = ps[k] = 0.5 * (next_p + next_p.T)
    return xs, ps
