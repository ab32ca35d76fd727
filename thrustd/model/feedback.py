"""A linear block with a static nonlinearity fed back: hardening springs, sloshing levels, friction that stays smooth.

Every mode (unit DC gain, see `linear`) is driven by the input and by products of all states and the input,

    s_i' = p_i (s_i - v - sum_j E_ij phi_j(z)),    y = direct v + sum Re g_i s_i
    z = (s, v) centred and scaled, drawn back to |W z| = 1 where it is larger

a polynomial nonlinear state space (Paduart et al., Automatica 46(4), 2010) in modal coordinates. W: the ellipsoid that
the data filled. What is fed back stops growing there, so with stable modes no input makes it run away. A box would not
do: its corners are states that no data showed, and a polynomial can hold a mount there.

Discretised as the linear block for input and modes. The products are taken in the middle of a step, where the modes
alone would be (exponential midpoint rule), and held over it: second order in the step, small beside the modes.
"""

import math
from itertools import combinations_with_replacement

import numpy as np

from thrustd.model.linear import discretise_mode
from thrustd.model.stage import Floats, Stage, jit

_SETTLING = 200  # relaxations towards the state at rest


def products(n: int, degree: int) -> list[tuple[int, ...]]:
    """Which of n variables each product multiplies: all of 2 up to `degree` factors, fewer factors first."""
    return [p for d in range(2, degree + 1) for p in combinations_with_replacement(range(n), d)]


@jit
def beyond(z: Floats, at: int, c: Floats) -> float:
    """|W z|, z from place `at` on: more than one outside of what the data showed."""
    n, total = int(c[0]) + 1, 0.0
    for i in range(n):
        row = 0.0
        for k in range(i + 1):
            row += c[3 + 2 * n + i * n + k] * z[at + k]
        total += row * row
    return math.sqrt(total)


@jit
def feedback_step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    """x: previous input, n states, then room for z (n + 1) and its m products; c: see `feedback`."""
    n, m, w0 = int(c[0]), int(c[1]), x[0]
    half = 3 + (n + 1) * (n + 3)  # rows of half a step: a (n), b0, b1
    full = half + n * (n + 2)  # rows of a whole step: a (n), b0, b1, gain
    into = full + n * (n + 3)  # rows of what each product adds
    pairs = into + n * m  # each product is one before it (or a z) times a z
    z, p = 1 + n, 2 + 2 * n
    for i in range(n + 1):
        value = 0.5 * (w0 + v)
        if i < n:
            row = half + i * (n + 2)
            value = c[row + n] * w0 + c[row + n + 1] * value
            for k in range(n):
                value += c[row + k] * x[1 + k]
        x[z + i] = (value - c[3 + i]) / c[4 + n + i]
    far = max(1.0, beyond(x, z, c))
    for i in range(n + 1):
        x[z + i] /= far
    for j in range(m):
        x[p + j] = x[z + int(c[pairs + 2 * j])] * x[z + int(c[pairs + 2 * j + 1])]
    y = c[2] * v
    for i in range(n):
        row = full + i * (n + 3)
        value = c[row + n] * w0 + c[row + n + 1] * v
        for k in range(n):
            value += c[row + k] * x[1 + k]
        for j in range(m):
            value += c[into + i * m + j] * x[p + j]
        x[z + i] = value  # z has done its work
        y += c[row + n + 2] * value
    for i in range(n):
        x[1 + i] = x[z + i]
    x[0] = v
    return y


@jit
def _at_rest(x: Floats, c: Floats, u: Floats, v: float) -> None:
    """The state that a constant input holds, found by going half way towards what it drives the modes to.

    Behind the tables of the step, c holds `_settled`: n rows of what is left to go, and n places without products.
    """
    n = int(c[0])
    left, before = c.size - n * (n + 1), x.size - n
    x[0] = v
    for i in range(n):
        x[1 + i] = c[left + n * n + i] * v
    for _ in range(_SETTLING):
        largest = 0.0
        for i in range(n):
            x[before + i] = x[1 + i]
        feedback_step(x, c, u, v)
        for i in range(n):
            moved = x[1 + i]
            x[1 + i] = x[before + i]
            x[before + i] = moved - x[before + i]
            largest = max(largest, abs(x[before + i]))
        if largest == 0.0:  # nothing moves any more
            return
        for i in range(n):
            for k in range(n):
                x[1 + i] += 0.5 * c[left + i * n + k] * x[before + k]


def _settled(modes: list[tuple[complex, complex]], dt_s: float) -> Floats:
    """Flat (n (n + 1),): all that a mode still goes per step of moving (n, n), where unit input alone takes it (n,)."""
    a, b0, b1 = _matrices(modes, dt_s)
    left = np.linalg.pinv(np.eye(len(a)) - a, rcond=1e-15)  # a mode that never settles stays where it is
    return np.concatenate((left.ravel(), left @ (b0 + b1)))


def feedback(
    name: str,
    direct: float,
    modes: list[tuple[complex, complex]],
    degree: int,
    reach: tuple[Floats, Floats, Floats],
    into: Floats,
    dt_s: float,
) -> Stage:
    """The block at one sample period.

    modes: (pole in 1/s, complex gain), real ones with zero imaginary parts; a complex one is two states. reach: centre
    and scale (n + 1,) of all states and the input, and W (n + 1, n + 1), lower triangle; into (n, m): what each
    product adds to every state's input.
    """
    a, b0, b1 = _matrices(modes, dt_s)
    half = np.column_stack(_matrices(modes, dt_s / 2))
    n, pairs = len(a), _pairs(len(a) + 1, degree)
    gains = [part for pole, gain in modes for part in ((gain.real, -gain.imag) if pole.imag else (gain.real,))]
    held = _held(modes, into, dt_s)
    table = (
        half.ravel(),
        np.column_stack((a, b0, b1, gains)).ravel(),
        held.ravel(),
        pairs.ravel(),
        _settled(modes, dt_s),
    )
    c = np.concatenate(([n, len(pairs), direct], *(part.ravel() for part in reach), *table))
    return Stage(name, feedback_step, c, 2 + 3 * n + len(pairs), initial=_at_rest)


def _pairs(n: int, degree: int) -> Floats:
    """Every product (m, 2) as a place before it, among the n variables and the products so far, times a variable."""
    order = [(i,) for i in range(n)] + products(n, degree)
    place = {factors: i for i, factors in enumerate(order)}
    return np.array([(place[factors[:-1]], factors[-1]) for factors in order[n:]], float)


def _matrices(modes: list[tuple[complex, complex]], dt_s: float) -> tuple[Floats, Floats, Floats]:
    """Real a (n, n), b0 and b1 (n,) of an input that is linear over the step."""
    n = sum(2 if pole.imag else 1 for pole, _ in modes)
    a, b0, b1, at = np.zeros((n, n)), np.zeros(n), np.zeros(n), 0
    for pole, _ in modes:
        z, early, late = (complex(value) for value in discretise_mode(pole, dt_s, "foh"))
        size = 2 if pole.imag else 1
        a[at : at + size, at : at + size] = np.array([[z.real, -z.imag], [z.imag, z.real]])[:size, :size]
        b0[at : at + size], b1[at : at + size] = (early.real, early.imag)[:size], (late.real, late.imag)[:size]
        at += size
    return a, b0, b1


def _held(modes: list[tuple[complex, complex]], into: Floats, dt_s: float) -> Floats:
    """What a product held over the step adds to each state: (1 - a) times its part of the input."""
    a = _matrices(modes, dt_s)[0]
    added: Floats = (np.eye(len(a)) - a) @ into
    return added
