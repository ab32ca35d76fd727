"""What the core can absorb of a candidate: the large part of a linear look, worked out once for all of them.

The core's numbers of either sign are eliminated (Schur's complement). What is left of a candidate is a few numbers
beside those of the core that cannot be negative.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from thrustd.core.columns import Flags, Floats
from thrustd.identify.regression.bounds import bounded, factor

ROUNDING = 1e-12  # of the information on a number


@dataclass(frozen=True, slots=True)
class Columns:
    """Sums over some rows of a candidate's columns: with the core's (p, k), among them (k, k), with what is missed."""

    across: Floats
    among: Floats
    right: Floats

    def times(self, size: float) -> "Columns":
        """Of columns so many times larger."""
        return Columns(size * self.across, size**2 * self.among, size * self.right)


@dataclass(frozen=True, slots=True)
class Absorbed:
    """The core's most probable step (p,) on some rows, its numbers of either sign eliminated as Cholesky does.

    In units in which the information on every number of the core is 1. Where nothing tells a combination of them, all
    that is known of it is rounding, and would explain what it likes: so much is added to every number.
    """

    vector: Floats  # (p,) where it is
    unit: Floats  # (p,) of every number
    free: NDArray[np.intp]  # numbers of either sign
    bound: NDArray[np.intp]  # the others, which cannot be negative
    root: Floats  # (free, free) R, R'R: information on the free ones
    across: Floats  # (free, bound) R'^-1 times what these share with those
    alone: Floats  # (free,) R'^-1 times their right-hand side
    rest: Floats  # (bound, bound) information on these, whatever the free ones are
    towards: Floats  # (bound,) its right-hand side

    @classmethod
    def of(cls, information: Floats, gradient: Floats, vector: Floats, positive: Flags) -> "Absorbed":
        """information (p, p) and gradient (p,) at the vector."""
        unit = 1.0 / np.sqrt(np.maximum(information.diagonal(), 1e-300))
        told = information * np.outer(unit, unit) + ROUNDING * np.eye(len(unit))
        towards = unit * (gradient + information @ vector)
        free, bound = np.flatnonzero(~positive), np.flatnonzero(positive)
        root = factor(told[np.ix_(free, free)])[0]
        across, alone = (_half(root, right) for right in (told[np.ix_(free, bound)], towards[free]))
        rest = told[np.ix_(bound, bound)] - across.T @ across
        return cls(vector, unit, free, bound, root, across, alone, rest, towards[bound] - across.T @ alone)

    def steps(self, beside: Columns, positive: Flags) -> tuple[Floats, Floats]:
        """The core's step (p,), and the numbers (k,) of columns of prior N(0, 1), in units of the noise."""
        shared, n, k = self.unit[:, None] * beside.across, len(self.bound), len(positive)
        half, among = _half(self.root, shared[self.free]), beside.among + np.eye(k)
        matrix = np.empty((n + k, n + k))
        matrix[:n, :n] = self.rest
        matrix[:n, n:] = shared[self.bound] - self.across.T @ half
        matrix[n:, :n] = matrix[:n, n:].T
        matrix[n:, n:] = among - half.T @ half + ROUNDING * np.diag(among.diagonal())
        right = beside.right + beside.across.T @ self.vector - half.T @ self.alone
        numbers, _ = bounded(matrix, np.append(self.towards, right), np.append(np.ones(n, bool), positive))
        step = np.empty(len(self.vector))
        step[self.bound] = numbers[:n]
        step[self.free] = solve_triangular(self.root, self.alone - self.across @ numbers[:n] - half @ numbers[n:])
        return self.unit * step - self.vector, numbers[n:]


def _half(root: Floats, right: Floats) -> Floats:
    found: Floats = solve_triangular(root, right, trans="T", check_finite=False)
    return found
