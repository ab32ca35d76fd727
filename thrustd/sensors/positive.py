"""Cholesky factor and inverse of a positive matrix, in compiled code that comes to the same bits everywhere."""

from math import log, sqrt

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.jit import compiled


@compiled
def factor(c: Floats, n: int) -> float:
    """Lower Cholesky factor of the first n in place; -> half of ln det."""
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
def forward(low: Floats, v: Floats, n: int) -> None:
    """v <- L^-1 v with a lower factor."""
    for i in range(n):
        for k in range(i):
            v[i] -= low[i, k] * v[k]
        v[i] /= low[i, i]


@compiled
def inverse(c: Floats) -> Floats:
    """Of a positive matrix, which is used up."""
    n = len(c)
    factor(c, n)
    low = np.zeros((n, n))  # transposed inverse of the factor: rows are run along
    for j in range(n):
        low[j, j] = 1.0 / c[j, j]
        for i in range(j + 1, n):
            dot = 0.0
            for k in range(j, i):
                dot += c[i, k] * low[j, k]
            low[j, i] = -dot / c[i, i]
    whole = np.empty((n, n))
    for i in range(n):
        for j in range(i + 1):
            dot = 0.0
            for k in range(i, n):
                dot += low[i, k] * low[j, k]
            whole[i, j] = whole[j, i] = dot
    return whole
