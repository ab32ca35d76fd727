"""The linear block: an output-error transfer function as parallel second-order sections.

    H(s) = direct + sum_i Re-part of  gain_i / (1 - s / p_i),    p_i = -1/tau_s  or  -decay + j frequency

Every mode is normalised to unit DC gain, so the DC gain of the block is direct + sum gain. Real modes are taken two to
a section, a complex pair is one section: no direct form, which loses digits when time constants span 0.05 s to hours.

Discretisation is exact for an input that is linear between samples ("foh") or constant ("zoh"), per mode with
a = exp(p T) (Franklin, Powell & Workman, Digital Control of Dynamic Systems, 3rd ed., section 6.3):

    foh: s[k] = a s[k-1] + b0 w[k-1] + b1 w[k],  b1 = 1 + (1 - a)/(p T),  b0 = -(1 - a)/(p T) - a
    zoh: s[k] = a s[k-1] + (1 - a) w[k-1]
"""

from functools import lru_cache

import numpy as np

from thrustd.model.stage import Floats, Stage, jit

_PER_SECTION = 10  # coefficients: a (2x2), b0 (2), b1 (2), output (2)


@jit
def sections_step(x: Floats, c: Floats, u: Floats, v: float) -> float:
    """x: previous input, then two states per section; c: direct, then `_PER_SECTION` per section."""
    w0 = x[0]
    y = c[0] * v
    for i in range((c.shape[0] - 1) // 10):
        j = 1 + 10 * i
        s = x[1 + 2 * i]
        r = x[2 + 2 * i]
        s_next = c[j] * s + c[j + 1] * r + c[j + 4] * w0 + c[j + 6] * v
        r_next = c[j + 2] * s + c[j + 3] * r + c[j + 5] * w0 + c[j + 7] * v
        x[1 + 2 * i] = s_next
        x[2 + 2 * i] = r_next
        y += c[j + 8] * s_next + c[j + 9] * r_next
    x[0] = v
    return y


def _at_rest(x: Floats, c: Floats, u: Floats, v: float) -> None:
    """All modes settled at the input v: unit DC gain makes every real state v, every imaginary one 0."""
    x[0] = v
    for i in range((c.size - 1) // _PER_SECTION):
        x[1 + 2 * i] = v
        complex_pair = c[1 + _PER_SECTION * i + 1] != 0.0
        x[2 + 2 * i] = 0.0 if complex_pair else v


@lru_cache(4096)
def discretise_mode(pole: complex, dt_s: float, hold: str) -> tuple[complex, complex, complex]:
    """(a, b0, b1) of one mode with unit DC gain; pole in 1/s, Re(pole) < 0."""
    a = np.exp(pole * dt_s)
    if hold == "zoh":
        return a, 1 - a, 0.0
    ratio = -np.expm1(pole * dt_s) / (pole * dt_s)  # (1 - a) / (p T), close to -1 for slow modes
    return a, -ratio - a, 1 + ratio


def _real_section(a: Floats, b0: Floats, b1: Floats, gains: Floats) -> list[float]:
    return [a[0], 0.0, 0.0, a[1], b0[0], b0[1], b1[0], b1[1], gains[0], gains[1]]


def _complex_section(a: complex, b0: complex, b1: complex, gain: complex) -> list[float]:
    return [a.real, -a.imag, a.imag, a.real, b0.real, b0.imag, b1.real, b1.imag, gain.real, -gain.imag]


def sections(
    name: str,
    direct: float,
    real_modes: list[tuple[float, float]],
    complex_modes: list[tuple[complex, complex]],
    dt_s: float,
    hold: str = "foh",
) -> Stage:
    """Linear block at one sample period.

    real_modes: (tau_s, gain); complex_modes: (pole in 1/s with positive imaginary part, complex gain), both with unit
    DC gain before `gain`. An odd number of real modes is filled with one of zero gain.
    """
    c: list[float] = [direct]
    padded = real_modes + [(1.0, 0.0)] * (len(real_modes) % 2)
    for (tau_1, gain_1), (tau_2, gain_2) in zip(padded[::2], padded[1::2], strict=True):
        modes = [discretise_mode(complex(-1 / tau), dt_s, hold) for tau in (tau_1, tau_2)]
        a, b0, b1 = np.real(np.array(modes)).T
        c += _real_section(a, b0, b1, np.array([gain_1, gain_2]))
    for pole, gain in complex_modes:
        mode_a, mode_b0, mode_b1 = discretise_mode(pole, dt_s, hold)
        c += _complex_section(mode_a, mode_b0, mode_b1, gain)
    n_sections = (len(c) - 1) // _PER_SECTION
    return Stage(name, sections_step, np.array(c), 1 + 2 * n_sections, initial=_at_rest)
