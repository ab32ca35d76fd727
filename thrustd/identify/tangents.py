"""How a small change travels on through a chain: all columns of a Jacobian at once, exactly.

A change that enters a static curve leaves it times the slope there; one that enters a linear block is filtered by it.
What is fed back inside a linear block (`thrustd.model.feedback`) changes its states by their own recursion,

    ds' = (A + H dphi/ds) ds + (1 - A) phi_j     for what product j adds to a state's input, H = (1 - A) E

which costs a handful of multiplications a column, where a finite difference costs a whole run of the block.
"""

import numpy as np

from thrustd.model.feedback import beyond, feedback_step
from thrustd.model.linear import sections_step
from thrustd.model.stage import Floats, Stage, jit

NUDGE = 1e-7  # of the signal's range: difference that gives a curve's slope
TINY = 1e-200  # what has decayed below is zero: numbers at the end of the exponent range cost a hundred times more


def carries(stage: Stage) -> bool:
    """Whether `carry` knows this kind of stage."""
    return not stage.channels and (stage.n_state == 0 or stage.step is sections_step)


def carry(stage: Stage, v: Floats, columns: Floats, count: int) -> None:
    """The first `count` columns (n_samples, n), which enter the stage beside v (n_samples,), become what leaves it.

    The stage and its changes are at rest on the first sample.
    """
    if count == 0:
        return
    if stage.n_state == 0:
        columns[:, :count] *= _slopes(stage, v)[:, None]
        return
    states = [stage.start(np.empty(0), value) for value in (0.0, 1.0)]
    _filter(np.outer(states[1] - states[0], columns[0, :count]), stage.c, columns, count)


def _slopes(stage: Stage, v: Floats) -> Floats:
    nudge = NUDGE * max(float(np.ptp(v)), float(np.abs(v).max()), 1e-300)
    x, u = np.empty(0), np.empty((len(v), 0))
    return (stage.run(x, u, v + nudge) - stage.run(x, u, v)) / nudge


@jit
def _filter(x: Floats, c: Floats, columns: Floats, count: int) -> None:
    """`sections_step` for many signals at once; x (1 + 2 sections, n)."""
    y = np.empty(count)
    for k in range(columns.shape[0]):
        for p in range(count):
            y[p] = c[0] * columns[k, p]
        for i in range((c.shape[0] - 1) // 10):
            j = 1 + 10 * i
            for p in range(count):
                s, r, w0, v = x[1 + 2 * i, p], x[2 + 2 * i, p], x[0, p], columns[k, p]
                s_next = c[j] * s + c[j + 1] * r + c[j + 4] * w0 + c[j + 6] * v
                r_next = c[j + 2] * s + c[j + 3] * r + c[j + 5] * w0 + c[j + 7] * v
                x[1 + 2 * i, p] = s_next if abs(s_next) > TINY else 0.0
                x[2 + 2 * i, p] = r_next if abs(r_next) > TINY else 0.0
                y[p] += c[j + 8] * s_next + c[j + 9] * r_next
        for p in range(count):
            x[0, p] = columns[k, p]
            columns[k, p] = y[p]


def fed_back(stage: Stage) -> int:
    """How many numbers say what is fed back in this stage."""
    return int(stage.c[0] * stage.c[1]) if stage.step is feedback_step else 0


def fed_start(stage: Stage, x: Floats, v: float) -> Floats:
    """Changes of the states at rest x with these numbers (n, n_numbers)."""
    n, m = int(stage.c[0]), int(stage.c[1])
    rest, added = np.zeros((n, n)), np.zeros((n, n * m))
    _linearised(x, stage.c, v, np.empty(n + 1 + m), np.zeros((n + 1 + m, n)), rest, added)
    return np.asarray(np.linalg.lstsq(np.eye(n) - rest, added, rcond=1e-12)[0], float)


@jit
def fed_columns(x: Floats, c: Floats, s: Floats, v: Floats, columns: Floats, first: int) -> None:
    """Columns `first` onwards: what each number of the feedback does to the output; x and s (n, n_numbers) advance."""
    n, m = int(c[0]), int(c[1])
    full = 3 + (n + 1) * (n + 3) + n * (n + 2)
    q, dq, a = np.empty(n + 1 + m), np.zeros((n + 1 + m, n)), np.empty((n, n))
    added, moved = np.empty((n, n * m)), np.empty((n, n * m))
    for k in range(v.shape[0]):
        _linearised(x, c, v[k], q, dq, a, added)
        feedback_step(x, c, q, v[k])
        for i in range(n):
            for p in range(n * m):
                moved[i, p] = added[i, p]
            for j in range(n):
                factor = a[i, j]
                for p in range(n * m):
                    moved[i, p] += factor * s[j, p]
        columns[k, first : first + n * m] = 0.0
        for i in range(n):
            gain = c[full + i * (n + 3) + n + 2]
            for p in range(n * m):
                s[i, p] = moved[i, p] if abs(moved[i, p]) > TINY else 0.0
                columns[k, first + p] += gain * moved[i, p]


@jit
def _drawn_back(q: Floats, dq: Floats, c: Floats) -> None:
    """Variables beyond the data on their edge, z / |W z|, and how these answer the states."""
    n = dq.shape[1] + 1
    far = beyond(q, 0, c)
    if far <= 1.0:
        return
    for k in range(n - 1):
        turned = 0.0  # d|W z|
        for i in range(n):
            row, moved = 0.0, 0.0
            for j in range(i + 1):
                row += c[3 + 2 * n + i * n + j] * q[j]
                moved += c[3 + 2 * n + i * n + j] * dq[j, k]
            turned += row * moved / far
        for i in range(n):
            dq[i, k] = (dq[i, k] - q[i] * turned / far) / far
    q[:n] /= far


@jit
def _linearised(x: Floats, c: Floats, v: float, q: Floats, dq: Floats, a: Floats, added: Floats) -> None:
    """One step about x: how states answer states, a (n, n), and each number of the feedback, added (n, n m).

    q: variables and products as in `feedback_step`; dq (n + 1 + m, n): how they answer the states.
    """
    n, m = int(c[0]), int(c[1])
    half = 3 + (n + 1) * (n + 3)
    full = half + n * (n + 2)
    into = full + n * (n + 3)
    pairs = into + n * m
    for i in range(n + 1):
        value = 0.5 * (x[0] + v)
        if i < n:
            row = half + i * (n + 2)
            value = c[row + n] * x[0] + c[row + n + 1] * value
            for k in range(n):
                value += c[row + k] * x[1 + k]
        q[i] = (value - c[3 + i]) / c[4 + n + i]
        for k in range(n):
            dq[i, k] = c[half + i * (n + 2) + k] / c[4 + n + i] if i < n else 0.0
    _drawn_back(q, dq, c)
    for j in range(m):
        e, f = int(c[pairs + 2 * j]), int(c[pairs + 2 * j + 1])
        q[n + 1 + j] = q[e] * q[f]
        for k in range(n):
            dq[n + 1 + j, k] = dq[e, k] * q[f] + q[e] * dq[f, k]
    for i in range(n):
        for k in range(n):
            stays = c[full + i * (n + 3) + k]
            a[i, k] = stays
            for j in range(m):
                a[i, k] += c[into + i * m + j] * dq[n + 1 + j, k]
                added[i, k * m + j] = ((1.0 if i == k else 0.0) - stays) * q[n + 1 + j]
