"""The Kalman filter's two equations as compiled code: filterpy's, line by line, on arrays that stay where they are.

    x = F x,            P = F P F' + Q
    y = z - H x,        S = H P H' + R,        K = P H' / S,        x += K y,        P = (I - K H) P (I - K H)' + K R K'

The last is Joseph's form: P stays symmetric and positive, whatever the gain. filterpy itself takes 60 us of numpy calls
and half a second of a restart for it; `tests/fusion/test_kalman.py` holds the two against each other.
"""

from thrustd.core.columns import Floats
from thrustd.core.jit import compiled


@compiled
def predict(x: Floats, p: Floats, f: Floats, q: Floats, work: Floats) -> None:
    """x (n, 1) and p (n, n) one step on, in place; f, q (n, n); `work` (n, n) is written over."""
    n = len(x)
    for i in range(n):
        work[i, 0] = 0.0
        for k in range(n):
            work[i, 0] += f[i, k] * x[k, 0]
    for i in range(n):
        x[i, 0] = work[i, 0]
    _between(f, p, work)
    for i in range(n):
        for j in range(n):
            p[i, j] += q[i, j]


@compiled
def update(x: Floats, p: Floats, z: float, h: Floats, r: float, gain: Floats, work: Floats) -> None:
    """x (n, 1) and p (n, n) with one scalar measurement z = h x + v, v ~ N(0, r), in place; h (1, n).

    `gain` (n,) is K afterwards, `work` (2, n, n) is written over.
    """
    n, y, s = len(x), z, r
    for i in range(n):
        y -= h[0, i] * x[i, 0]
        gain[i] = 0.0
        for k in range(n):
            gain[i] += p[i, k] * h[0, k]
        s += h[0, i] * gain[i]
    for i in range(n):
        gain[i] /= s
        x[i, 0] += gain[i] * y
    left = work[0]
    for i in range(n):
        for j in range(n):
            left[i, j] = (1.0 if i == j else 0.0) - gain[i] * h[0, j]
    _between(left, p, work[1])
    for i in range(n):
        for j in range(n):
            p[i, j] += gain[i] * r * gain[j]


@compiled
def _between(a: Floats, p: Floats, work: Floats) -> None:
    """p = a p a', in place."""
    n = len(p)
    for i in range(n):
        for j in range(n):
            work[i, j] = 0.0
            for k in range(n):
                work[i, j] += a[i, k] * p[k, j]
    for i in range(n):
        for j in range(n):
            p[i, j] = 0.0
            for k in range(n):
                p[i, j] += work[i, k] * a[j, k]
