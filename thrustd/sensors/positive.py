"""Cholesky factor and inverse of a positive matrix, in compiled code that comes to the same bits everywhere.

A large one is worked on along its rows, several numbers at a time; each number's sum keeps its order.
"""

from math import log, sqrt

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.jit import compiled


@compiled
def factor(c: Floats, n: int) -> float:
    """Lower Cholesky factor of the first n, a few, in place; -> half of ln det."""
    half, product = 0.0, 1.0
    for j in range(n):
        left = c[j, j]
        for k in range(j):
            left -= c[j, k] * c[j, k]
        c[j, j] = sqrt(max(left, 1e-12))
        product *= c[j, j]
        if not 1e-100 < product < 1e100:
            half, product = half + log(product), 1.0
        over = 1.0 / c[j, j]
        for i in range(j + 1, n):
            dot = 0.0
            for k in range(j):
                dot += c[i, k] * c[j, k]
            c[i, j] = (c[i, j] - dot) * over
    return half + log(product)


@compiled
def factor_large(c: Floats) -> None:
    """The same of all of a large one, but transposed: into the upper half."""
    n = len(c)
    for j in range(n):
        c[j, j] = sqrt(max(c[j, j], 1e-12))
        dots, over = np.zeros(n - j - 1), 1.0 / c[j, j]
        for k in range(j):
            row, by = c[k, j + 1 :], c[k, j]
            for i in range(len(dots)):
                dots[i] += row[i] * by
        for i in range(j + 1, n):
            c[j, i] = (c[j, i] - dots[i - j - 1]) * over
            c[i, i] -= c[j, i] * c[j, i]


@compiled
def forward(c: Floats, v: Floats) -> None:
    """v <- L^-1 v with the factor L' of a large one."""
    for k in range(len(c)):
        v[k] /= c[k, k]
        for i in range(k + 1, len(c)):
            v[i] -= c[k, i] * v[k]


@compiled
def inverse(c: Floats) -> Floats:
    """Of a large matrix, which is used up."""
    n = len(c)
    factor_large(c)
    low, whole = np.zeros((n, n)), np.zeros((n, n))  # low: inverse of L
    for i in range(n):
        for k in range(i):
            dots, row, by = low[i, : k + 1], low[k, : k + 1], c[k, i]
            for j in range(len(dots)):
                dots[j] += row[j] * by
        for j in range(i):
            low[i, j] = -low[i, j] / c[i, i]
        low[i, i] = 1.0 / c[i, i]
    for i in range(n):
        for k in range(i, n):
            dots, row, by = whole[i, : i + 1], low[k, : i + 1], low[k, i]
            for j in range(len(dots)):
                dots[j] += row[j] * by
        for j in range(i):
            whole[j, i] = whole[i, j]
    return whole
