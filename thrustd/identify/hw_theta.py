"""The parameters of an HW-PWL model as one vector in normalised units, and the tables its recursion needs."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from thrustd.identify import hw_kernel as kernel
from thrustd.model.stage import Floats

SMALLEST = 1e-250  # what a mode may decay to between two rows


@dataclass(frozen=True)  # no slots: places are asked for by the hundred thousand, so they are worked out once
class Layout:
    """Which entry of the vector is what: f's y and x, poles, gains, c, h's y and x (knots include both ends)."""

    n_f: int
    n_real: int
    n_complex: int
    n_h: int

    @cached_property
    def width(self) -> int:
        """Numbers per kind of linear parameter: one for a real mode, two for a complex pair."""
        return self.n_real + 2 * self.n_complex

    @cached_property
    def size(self) -> int:
        return 2 * self.n_f + 2 * self.width + 1 + 2 * self.n_h

    @cached_property
    def fy(self) -> slice:
        return slice(0, self.n_f)

    @cached_property
    def fx(self) -> slice:
        return slice(self.n_f, 2 * self.n_f)

    @cached_property
    def poles(self) -> slice:
        """log tau_s of real modes, then log decay and log frequency of each pair."""
        return slice(2 * self.n_f, 2 * self.n_f + self.width)

    @cached_property
    def gains(self) -> slice:
        return slice(self.poles.stop, self.poles.stop + self.width)

    @cached_property
    def c(self) -> int:
        """Place of the DC gain of the linear block."""
        return self.gains.stop

    @cached_property
    def hy(self) -> slice:
        return slice(self.c + 1, self.c + 1 + self.n_h)

    @cached_property
    def hx(self) -> slice:
        return slice(self.hy.stop, self.hy.stop + self.n_h)


def pole_values(layout: Layout, theta: Floats) -> NDArray[np.complex128]:
    """Poles in 1/s of all modes, complex ones with positive imaginary part."""
    logs = theta[layout.poles]
    real = -np.exp(-logs[: layout.n_real])
    pairs = logs[layout.n_real :].reshape(-1, 2)
    return np.concatenate((real.astype(complex), -np.exp(pairs[:, 0]) + 1j * np.exp(pairs[:, 1])))


def gain_values(layout: Layout, theta: Floats) -> NDArray[np.complex128]:
    gains = theta[layout.gains]
    pairs = gains[layout.n_real :].reshape(-1, 2)
    return np.concatenate((gains[: layout.n_real].astype(complex), pairs[:, 0] + 1j * pairs[:, 1]))


def mode_table(layout: Layout, theta: Floats, dt_s: float) -> Floats:
    """Coefficients (7, 2, n_modes) of `hw_kernel`: FOH discretisation and its derivative by p (real: by log tau).

    With z = p T: a = e^z, b1 = 1 + (1 - a)/z, b0 = -(1 - a)/z - a, beta = a b1 + b0, and d/dp = T d/dz.
    """
    z = pole_values(layout, theta) * dt_s
    a = np.exp(z)
    ratio = -np.expm1(z) / z
    ratio_slope = (-a - ratio) / z
    chain = np.where(np.arange(len(z)) < layout.n_real, -z, dt_s)  # dz / d log tau, dz / dp
    beta_slope = a * ratio + a * ratio_slope - ratio_slope
    table = np.array(
        [
            a,
            a * ratio - ratio,
            1 + ratio,
            a * chain,
            beta_slope * chain,
            ratio_slope * chain,
            gain_values(layout, theta),
        ]
    )
    return np.ascontiguousarray(np.stack((table.real, table.imag), axis=1))


def power_table(table: Floats, longest: int) -> Floats:
    """(2, n_lags + 1, 2, n_modes): beta / a^lag and a^lag, up to `longest` lags or where 1 / a^lag would overflow."""
    a = table[kernel.A, 0] + 1j * table[kernel.A, 1]
    a = np.where(np.abs(a) < SMALLEST, SMALLEST, a)
    longest = int(np.clip(-np.log(SMALLEST) / max(1e-9, -np.log(np.abs(a).min())), 1, longest))
    beta = table[kernel.BETA, 0] + 1j * table[kernel.BETA, 1]
    powers = a ** np.arange(longest + 1)[:, None]
    both = np.array([beta / powers, powers])
    return np.ascontiguousarray(np.stack((both.real, both.imag), axis=2))


def column_map(layout: Layout, theta: Floats) -> Floats:
    """Matrix (n_kernel, size + width) from the kernel's columns to those of theta and the initial states.

    A knot's y moves the right half of the segment before it and the left half of the one after; its x moves the same
    halves by minus the segment's slope. Logs of decay and frequency follow from Re p and Im p by the chain rule.
    """
    n_f, n_h, width = layout.n_f - 1, layout.n_h - 1, layout.width
    n_dense = 2 * n_f + 3 * width + 1
    table = np.zeros((n_dense + 2 * n_h, layout.size + width))
    for row, n, y_part, x_part in ((0, n_f, layout.fy, layout.fx), (n_dense, n_h, layout.hy, layout.hx)):
        slopes = np.diff(theta[y_part]) / np.diff(theta[x_part])
        for half in (0, 1):
            rows, knots = row + half + 2 * np.arange(n), half + np.arange(n)
            table[rows, y_part.start + knots] = 1.0
            table[rows, x_part.start + knots] = -slopes
    middle = np.arange(2 * width + 1)
    table[2 * n_f + middle, layout.poles.start + middle] = 1.0
    pairs = np.arange(layout.n_real, width)
    factors = np.exp(theta[layout.poles][pairs]) * np.tile([-1.0, 1.0], layout.n_complex)
    table[2 * n_f + pairs, layout.poles.start + pairs] = factors
    starts = np.arange(width)
    table[2 * n_f + 2 * width + 1 + starts, layout.size + starts] = 1.0
    return table


def starting_state(layout: Layout, deviation: Floats) -> Floats:
    """State (3, 2, n_modes) before the first sample; deviation (width,) from rest."""
    state = np.zeros((3, 2, layout.n_real + layout.n_complex))
    state[kernel.R, 0, : layout.n_real] = deviation[: layout.n_real]
    state[kernel.R, :, layout.n_real :] = deviation[layout.n_real :].reshape(-1, 2).T
    state[kernel.DECAY, 0] = 1.0
    return state
