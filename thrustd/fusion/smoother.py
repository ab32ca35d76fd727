"""Rauch-Tung-Striebel smoothing of one engine's flight, for after the landing.

    P' = F P F^T + Q,   C = P F^T P'^-1,   x_s = x + C (x_s+ - F x),   P_s = P + C (P_s+ - P') C^T

run backwards over the records of the filter (`ThrustFilter.record()` after every step). What the filter learnt late
(the biases of both routes, above all) corrects what it had said early. Reference: Brown & Hwang, ch. 6.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from thrustd.fusion.dynamics import RATE, THRUST, Matrix
from thrustd.fusion.thrust_filter import StepRecord


class Smoothed(NamedTuple):
    """All (n,), one row per record."""

    t_ns: npt.NDArray[np.int64]
    thrust_n: Matrix
    thrust_std_n: Matrix
    thrust_rate_n_s: Matrix


def smooth(records: Sequence[StepRecord]) -> Smoothed:
    """Smooth a flight; `records` in the order of the steps. An empty flight gives empty rows."""
    if not records:
        return Smoothed(np.zeros(0, dtype=np.int64), *(np.zeros(0) for _ in range(3)))
    x = np.array([record.x for record in records])
    std_n = np.zeros(len(records))
    p_next = records[-1].p
    for k in range(len(records) - 1, -1, -1):
        if k < len(records) - 1:
            x[k], p_next = _backward(records[k], records[k + 1], x[k + 1], p_next)
        std_n[k] = np.sqrt(p_next[THRUST, THRUST])
    t_ns = np.array([record.t_ns for record in records], dtype=np.int64)
    return Smoothed(t_ns, x[:, THRUST], std_n, x[:, RATE])


def _backward(now: StepRecord, later: StepRecord, x_later: Matrix, p_later: Matrix) -> tuple[Matrix, Matrix]:
    p_ahead = later.f @ now.p @ later.f.T + later.q
    # C^T = P'^-1 F P: solving is better conditioned than inverting
    gain = np.linalg.solve(p_ahead, later.f @ now.p).T
    x = now.x + gain @ (x_later - later.f @ now.x)
    p = now.p + gain @ (p_later - p_ahead) @ gain.T
    return x, 0.5 * (p + p.T)
