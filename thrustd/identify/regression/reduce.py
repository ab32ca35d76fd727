"""Fewer modes for the same relaxation: what was spread over a dense set of time constants, told by a few that move.

S(t) = sum_i g_i exp(-t / tau_i)     is followed on a log-spaced axis by k exponentials, tau by variable projection
(Golub & Pereyra, SIAM J. Numer. Anal. 10 (1973) 413)
"""

from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from thrustd.core.columns import Floats
from thrustd.identify.regression.shape import Point, Shape

TIMES = 120


def reduced(shape: Shape, point: Point, order: int, pairs: int) -> tuple[Shape, Point]:
    """At most `order` poles in all, so many pairs of them, the strongest, and real modes."""
    kept = np.sort(np.argsort(-np.abs(point.pair_gain).sum(axis=1))[:pairs])
    tau_s, gain = fewer(np.exp(point.log_tau), point.gain, order - 2 * len(kept))
    poles = point.log_pole[kept]
    new = replace(shape, taus_s=tau_s, poles=poles, move=True)
    begin = np.zeros(new.sizes["begin"])
    less = replace(point, gain=gain, log_tau=np.log(tau_s), log_pole=poles.copy(), begin=begin)
    return new, replace(less, pair_gain=point.pair_gain[kept])


def fewer(tau_s: Floats, gain: Floats, count: int) -> tuple[Floats, Floats]:
    """Time constants and gains (count,) whose relaxation is nearest to the given one; all where they are few."""
    if len(tau_s) <= count:
        return tau_s, gain
    if count == 0:
        return np.zeros(0), np.zeros(0)
    times = np.geomspace(0.1 * tau_s.min(), 10 * tau_s.max(), TIMES)
    wanted = np.exp(-times[:, None] / tau_s) @ gain

    def solved(logs: Floats) -> tuple[Floats, Floats]:
        table = np.exp(-times[:, None] / np.exp(logs))
        matrix = table.T @ table + 1e-9 * len(times) * np.eye(len(logs))
        weights: Floats = np.linalg.solve(matrix, table.T @ wanted).astype(np.float64)
        return weights, table @ weights - wanted

    share = np.cumsum(np.abs(gain)) + 1e-6 * np.arange(len(gain))
    starts = np.interp((np.arange(count) + 0.5) / count * share[-1], share, np.log(tau_s))
    starts = starts + 1e-2 * np.arange(count)
    bounds = (np.log(tau_s.min()) - 1.0, np.log(tau_s.max()) + 1.0)
    logs = np.sort(least_squares(lambda x: solved(x)[1], np.clip(starts, *bounds), bounds=bounds, max_nfev=100).x)
    weights: Floats = solved(logs)[0]
    return np.exp(logs).astype(np.float64), weights
