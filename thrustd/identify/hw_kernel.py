"""The HW-PWL recursion with its exact gradient, one sample after the other (numba).

    w = f(u),   s_i' = p_i (s_i - w) discretised exactly for ramps,   x = c w + sum Re g_i (s_i - w),   y = h(x)

f and h are piecewise linear through free knots. A mode s[k] = a s[k-1] + b0 w[k-1] + b1 w[k] is run as

    r[k] = a r[k-1] + beta w[k-1],   s[k] = r[k] + b1 w[k],   beta = a b1 + b0,

so that the past enters through one number. With respect to everything but f's knots the gradient is a handful of
recursions. For f's knots the two hat halves of every segment pass through every mode; as only the current segment's
halves are not zero, all others just decay, and that decay is applied when a row of the Jacobian is written and not at
every sample. Rows are written at chosen samples only, so a pass over millions of samples costs little more than a
simulation.

Everything is in normalised units. Columns: two hat halves per segment of f, poles, gains, c, initial states (dense),
then two hat halves per segment of h (only one pair is not zero, which the sums use). A real mode has one column among
poles, gains and initial states, a complex pair two. `hw_theta.column_map` turns them into those of the knots.
"""

import numpy as np

from thrustd.model.stage import Floats, jit

# rows of the mode table m (7, 2, n_modes): real parts in [:, 0], imaginary ones in [:, 1], real modes first
A, BETA, B1, DA, DBETA, DB1, G = range(7)
R, DR, DECAY = range(3)  # rows of the state s (3, 2, n_modes)
W, SEGMENT, LEFT, RIGHT, LAG = range(5)  # carry (5,): previous w, its segment and hat halves, samples since catching up
TINY = 1e-30  # what has decayed below is zero: numbers at the end of the exponent range cost a hundred times more


@jit
def segment_at(knots: Floats, j: int, v: float) -> int:
    """Index of the segment that holds v, searched from a neighbour j; ends extend outwards."""
    last = knots.shape[0] - 2
    while j < last and v >= knots[j + 1]:
        j += 1
    while j > 0 and v < knots[j]:
        j -= 1
    return j


@jit
def _slopes(x: Floats, y: Floats) -> Floats:
    return (y[1:] - y[:-1]) / (x[1:] - x[:-1])


@jit
def simulate_block(
    u: Floats, fx: Floats, fy: Floats, m: Floats, n_real: int, c: float, hx: Floats, hy: Floats, s: Floats, out: Floats
) -> None:
    """Plain simulation u (n,) -> out (n,); s (3, 2, n_modes) holds r at the first sample and is advanced."""
    n_modes = m.shape[2]
    i, j = 0, 0
    f_slopes, h_slopes = _slopes(fx, fy), _slopes(hx, hy)
    passed = c
    for q in range(n_modes):
        passed += m[G, 0, q] * (m[B1, 0, q] - 1.0) - m[G, 1, q] * m[B1, 1, q]
    for k in range(u.shape[0]):
        i = segment_at(fx, i, u[k])
        w = fy[i] + f_slopes[i] * (u[k] - fx[i])
        x = passed * w
        for q in range(n_real):
            v = s[R, 0, q]
            x += m[G, 0, q] * v
            s[R, 0, q] = m[A, 0, q] * v + m[BETA, 0, q] * w
        for q in range(n_real, n_modes):
            re, im = s[R, 0, q], s[R, 1, q]
            x += m[G, 0, q] * re - m[G, 1, q] * im
            s[R, 0, q] = m[A, 0, q] * re - m[A, 1, q] * im + m[BETA, 0, q] * w
            s[R, 1, q] = m[A, 0, q] * im + m[A, 1, q] * re + m[BETA, 1, q] * w
        j = segment_at(hx, j, x)
        out[k] = hy[j] + h_slopes[j] * (x - hx[j])


@jit
def _advance(m: Floats, s: Floats, n_real: int, w0: float) -> None:
    """One sample: r and its derivative with respect to the pole."""
    for q in range(n_real):
        a, r = m[A, 0, q], s[R, 0, q]
        s[DR, 0, q] = a * s[DR, 0, q] + m[DA, 0, q] * r + m[DBETA, 0, q] * w0
        s[R, 0, q] = a * r + m[BETA, 0, q] * w0
    for q in range(n_real, m.shape[2]):
        a = complex(m[A, 0, q], m[A, 1, q])
        r = complex(s[R, 0, q], s[R, 1, q])
        dr = a * complex(s[DR, 0, q], s[DR, 1, q]) + complex(m[DA, 0, q], m[DA, 1, q]) * r
        dr += complex(m[DBETA, 0, q], m[DBETA, 1, q]) * w0
        r = a * r + complex(m[BETA, 0, q], m[BETA, 1, q]) * w0
        s[R, 0, q], s[R, 1, q] = r.real, r.imag
        s[DR, 0, q], s[DR, 1, q] = dr.real, dr.imag


@jit
def _touch(z: Floats, powers: Floats, lag: int, n_real: int, at: int, left: float, right: float) -> None:
    """Add the hat halves of segment `at` to every mode's store, times beta / a^lag."""
    for q in range(n_real):
        z[0, q, 2 * at] += powers[0, lag, 0, q] * left
        z[0, q, 2 * at + 1] += powers[0, lag, 0, q] * right
    for q in range(n_real, powers.shape[3]):
        z[0, q, 2 * at] += powers[0, lag, 0, q] * left
        z[0, q, 2 * at + 1] += powers[0, lag, 0, q] * right
        z[1, q, 2 * at] += powers[0, lag, 1, q] * left
        z[1, q, 2 * at + 1] += powers[0, lag, 1, q] * right


@jit
def _catch_up(z: Floats, s: Floats, powers: Floats, lag: int, n_real: int) -> None:
    """Apply the pending decay a^lag to the stores and to the memory of the initial state."""
    for q in range(n_real):
        fall = powers[1, lag, 0, q]
        for i in range(z.shape[2]):
            v = fall * z[0, q, i]
            z[0, q, i] = v if abs(v) > TINY else 0.0
        s[DECAY, 0, q] = fall * s[DECAY, 0, q] if abs(s[DECAY, 0, q]) > TINY else 0.0
    for q in range(n_real, powers.shape[3]):
        re, im = powers[1, lag, 0, q], powers[1, lag, 1, q]
        for i in range(z.shape[2]):
            z_re = re * z[0, q, i] - im * z[1, q, i]
            z_im = re * z[1, q, i] + im * z[0, q, i]
            z[0, q, i] = z_re if abs(z_re) > TINY else 0.0
            z[1, q, i] = z_im if abs(z_im) > TINY else 0.0
        s_re = re * s[DECAY, 0, q] - im * s[DECAY, 1, q]
        s_im = re * s[DECAY, 1, q] + im * s[DECAY, 0, q]
        s[DECAY, 0, q] = s_re if abs(s_re) > TINY else 0.0
        s[DECAY, 1, q] = s_im if abs(s_im) > TINY else 0.0


@jit
def _run_to(
    first: int,
    last: int,
    u: Floats,
    fx: Floats,
    widths: Floats,
    fy: Floats,
    m: Floats,
    powers: Floats,
    n_real: int,
    s: Floats,
    z: Floats,
    carry: Floats,
) -> None:
    """Samples first..last of the recursion; powers (2, n_lags, 2, n_modes): beta / a^lag, and a^lag."""
    i, lag, longest = int(carry[SEGMENT]), int(carry[LAG]), powers.shape[1] - 1
    for n in range(first, last + 1):
        if n > 0:
            if lag == longest:
                _catch_up(z, s, powers, lag, n_real)
                lag = 0
            lag += 1
            _advance(m, s, n_real, carry[W])
            _touch(z, powers, lag, n_real, i, carry[LEFT], carry[RIGHT])
        i = segment_at(fx, i, u[n])
        right = (u[n] - fx[i]) * widths[i]
        carry[LEFT], carry[RIGHT] = 1.0 - right, right
        carry[W] = fy[i] * (1.0 - right) + fy[i + 1] * right
        if n == 0:
            _begin(m, s, z, i, carry)
    carry[SEGMENT], carry[LAG] = i, lag


@jit
def _begin(m: Floats, s: Floats, z: Floats, i: int, carry: Floats) -> None:
    """First sample: s holds deviations from rest, where every mode equals its input, so r = (1 - b1) w."""
    for part in range(2):
        for q in range(m.shape[2]):
            rest = 1.0 - part - m[B1, part, q]
            s[R, part, q] += rest * carry[W]
            s[DR, part, q] = -m[DB1, part, q] * carry[W]
            z[part, q, 2 * i] = rest * carry[LEFT]
            z[part, q, 2 * i + 1] = rest * carry[RIGHT]


@jit
def _dense_row(
    line: Floats, m: Floats, s: Floats, z: Floats, n_real: int, passed: float, slope: float, carry: Floats
) -> None:
    """Columns hat halves of f (2 n_segments), poles, gains, c, initial states, all times h's slope."""
    n_modes, n_halves, w = m.shape[2], z.shape[2], carry[W]
    line[:n_halves] = 0.0
    for q in range(n_modes):
        g = m[G, 0, q]
        for i in range(n_halves):
            line[i] += g * z[0, q, i]
    for q in range(n_real, n_modes):
        g = m[G, 1, q]
        for i in range(n_halves):
            line[i] -= g * z[1, q, i]
    line[2 * int(carry[SEGMENT])] += passed * carry[LEFT]
    line[2 * int(carry[SEGMENT]) + 1] += passed * carry[RIGHT]
    _mode_columns(line, n_halves, m, s, n_real, w)
    for i in range(line.shape[0]):
        line[i] *= slope


@jit
def _mode_columns(line: Floats, at: int, m: Floats, s: Floats, n_real: int, w: float) -> None:
    """Columns of poles, gains, c and initial states, from column `at` on."""
    n_modes = m.shape[2]
    width = 2 * n_modes - n_real
    start = at + 2 * width + 1
    for q in range(n_real):
        line[at + q] = m[G, 0, q] * (s[DR, 0, q] + m[DB1, 0, q] * w)
        line[at + width + q] = s[R, 0, q] + (m[B1, 0, q] - 1.0) * w
        line[start + q] = m[G, 0, q] * s[DECAY, 0, q]
    for q in range(n_real, n_modes):
        i = n_real + 2 * (q - n_real)
        ds = complex(s[DR, 0, q] + m[DB1, 0, q] * w, s[DR, 1, q] + m[DB1, 1, q] * w)
        ds *= complex(m[G, 0, q], m[G, 1, q])
        line[at + i], line[at + i + 1] = ds.real, -ds.imag  # with respect to Re p and Im p
        line[at + width + i] = s[R, 0, q] + (m[B1, 0, q] - 1.0) * w
        line[at + width + i + 1] = -(s[R, 1, q] + m[B1, 1, q] * w)
        line[start + i] = m[G, 0, q] * s[DECAY, 0, q] - m[G, 1, q] * s[DECAY, 1, q]
        line[start + i + 1] = -(m[G, 0, q] * s[DECAY, 1, q] + m[G, 1, q] * s[DECAY, 0, q])
    line[at + 2 * width] = w


@jit
def _add_rows(lines: Floats, hats: Floats, count: int, normal: Floats) -> None:
    """Add the outer products of up to eight rows; hats (8, 4): segment of h, left and right hat, residual.

    normal (n + 1, n): J'J with J'r as its last row, upper triangle of the dense part, then two columns per h segment.
    """
    n, last = lines.shape[1], normal.shape[0] - 1
    for i in range(count, 8):
        lines[i] = 0.0
    for i in range(n):
        a, b, c, d = lines[0, i], lines[1, i], lines[2, i], lines[3, i]
        e, f, g, h = lines[4, i], lines[5, i], lines[6, i], lines[7, i]
        for j in range(i, n):
            left = a * lines[0, j] + b * lines[1, j] + c * lines[2, j] + d * lines[3, j]
            normal[i, j] += left + (e * lines[4, j] + f * lines[5, j] + g * lines[6, j] + h * lines[7, j])
    for k in range(count):
        at, left, right, r = n + 2 * int(hats[k, 0]), hats[k, 1], hats[k, 2], hats[k, 3]
        for j in range(n):
            normal[at, j] += left * lines[k, j]
            normal[at + 1, j] += right * lines[k, j]
            normal[last, j] += r * lines[k, j]
        normal[at, at] += left * left
        normal[at, at + 1] += left * right
        normal[at + 1, at + 1] += right * right
        normal[last, at] += r * left
        normal[last, at + 1] += r * right


@jit
def normal_pass(
    u: Floats,
    y: Floats,
    chosen: Floats,
    fx: Floats,
    fy: Floats,
    m: Floats,
    powers: Floats,
    n_real: int,
    c: float,
    hx: Floats,
    hy: Floats,
    s: Floats,
    normal: Floats,
) -> float:
    """One pass over a segment: fills `normal` (see `_add_rows`) from the chosen samples, returns the sum of squares.

    s (3, 2, n_modes): s[R] holds the deviations from rest, s[DECAY, 0] ones.
    """
    n_modes, n_halves = m.shape[2], 2 * (fx.shape[0] - 1)
    z, carry = np.zeros((2, n_modes, n_halves)), np.zeros(5)
    widths, h_slopes = 1.0 / (fx[1:] - fx[:-1]), _slopes(hx, hy)
    lines, hats = np.zeros((8, n_halves + 3 * (2 * n_modes - n_real) + 1)), np.zeros((8, 4))
    passed, squares, count, j, first = c, 0.0, 0, 0, 0
    for q in range(n_modes):
        passed += m[G, 0, q] * (m[B1, 0, q] - 1.0) - m[G, 1, q] * m[B1, 1, q]
    for k in chosen:
        _run_to(first, k, u, fx, widths, fy, m, powers, n_real, s, z, carry)
        _catch_up(z, s, powers, int(carry[LAG]), n_real)
        carry[LAG], first = 0.0, k + 1
        x = passed * carry[W]
        for q in range(n_modes):
            x += m[G, 0, q] * s[R, 0, q] - m[G, 1, q] * s[R, 1, q]
        j = segment_at(hx, j, x)
        _dense_row(lines[count], m, s, z, n_real, passed, h_slopes[j], carry)
        right = (x - hx[j]) / (hx[j + 1] - hx[j])
        r = y[k] - (hy[j] + h_slopes[j] * (x - hx[j]))
        hats[count, 0], hats[count, 1], hats[count, 2], hats[count, 3] = j, 1.0 - right, right, r
        squares += r * r
        count += 1
        if count == 8:
            _add_rows(lines, hats, count, normal)
            count = 0
    _add_rows(lines, hats, count, normal)
    return squares
