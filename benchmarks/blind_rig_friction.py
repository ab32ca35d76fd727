"""Friction on the mount of blind_rig.py: Bouc-Wen, Preisach, and Coulomb's solved with the motion that it acts on.

    force on the mount = applied - friction_n z,    z = low-passed tanh(low-passed rate / SLIP_MM_S)

z falls where the mount yields more and the mount yields less where z grows: one root per sample, found by bisection.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

DT_S = 0.05
SLIP_MM_S = 5e-4
KEEP_RATE = np.exp(-DT_S / 0.2)
KEEP_HOLD = np.exp(-DT_S / 0.5)  # held through a standstill only briefly
HALVINGS = 30


@njit
def bouc_wen(x, yield_mm, power):
    z, out = 0.0, np.zeros_like(x)
    for k in range(1, x.size):
        dx = x[k] - x[k - 1]
        for _ in range(4):
            rate = 1 - (0.7 * np.sign(z * dx) + 0.3) * np.abs(z) ** power
            z = min(max(z + rate * dx / 4 / yield_mm, -1.0), 1.0)
        out[k] = z
    return out


@njit
def relays(x, alpha, beta, start):
    """Preisach: mean of relays that switch up at alpha and down at beta."""
    state, out = start.copy(), np.empty_like(x)
    for k in range(x.size):
        for i in range(alpha.size):
            if x[k] >= alpha[i]:
                state[i] = 1.0
            elif x[k] <= beta[i]:
                state[i] = -1.0
        out[k] = state.mean()
    return out


@njit
def elastic(force, k, bend):
    """Deformation without delay, mm."""
    z = force / 6500
    return 6500 / k * (z + bend * np.tanh(2 * z) - 0.5 * bend * z**2)


class Law(NamedTuple):
    """Of a mount's own deformation."""

    k: float
    bend: float
    shares: np.ndarray  # (m,) of its retarded parts
    keeps: np.ndarray  # (m,) from sample to sample
    stick_mm: float


@njit
def rubbed(force, softness, friction_n, law):
    """Deformation (n,) of a mount at rest on the first sample."""
    k, bend, shares, keeps, stick_mm = law
    out = np.empty_like(force)
    e = elastic(force[0] * softness[0], k, bend)
    lags, middle, rate, z = np.full(shares.size, e), e, 0.0, 0.0
    last = e * (1 + shares.sum())
    for n in range(force.size):
        low, high = -1.0, 1.0
        for _ in range(HALVINGS):
            tried = (low + high) / 2
            e = elastic((force[n] - friction_n * tried) * softness[n], k, bend)
            x = e - (e - min(max(middle, e - stick_mm), e + stick_mm))
            for i in range(shares.size):
                x += shares[i] * (keeps[i] * lags[i] + (1 - keeps[i]) * e)
            moved = KEEP_RATE * rate + (1 - KEEP_RATE) * (x - last) / DT_S
            if KEEP_HOLD * z + (1 - KEEP_HOLD) * np.tanh(moved / SLIP_MM_S) > tried:
                low = tried
            else:
                high = tried
        middle = min(max(middle, e - stick_mm), e + stick_mm)
        lags = keeps * lags + (1 - keeps) * e
        rate, z, last, out[n] = moved, tried, x, x
    return out
