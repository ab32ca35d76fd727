"""What the core can absorb of a candidate: the large part of a linear look, worked out once for all of them.

The core's numbers of either sign are eliminated (Schur's complement). What is left of a candidate is a few numbers
beside those of the core that cannot be negative.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve

from thrustd.core.columns import Flags, Floats
from thrustd.identify.regression.bounds import bounded, factor

Factor = tuple[Floats, bool]


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
    """The core's most probable step (p,) on some rows, its numbers of either sign eliminated.

    In units in which the information on every number of the core is 1.
    """

    vector: Floats  # (p,) where it is
    unit: Floats  # (p,) of every number
    free: NDArray[np.intp]  # numbers of either sign
    bound: NDArray[np.intp]  # the others, which cannot be negative
    root: tuple[Floats, bool]  # of the information on the free ones
    shares: Floats  # (free, bound) by which those give way to these
    alone: Floats  # (free,) what they were without these
    rest: Floats  # (bound, bound) information on these, whatever the free ones are
    towards: Floats  # (bound,) its right-hand side

    @classmethod
    def of(cls, information: Floats, gradient: Floats, vector: Floats, positive: Flags) -> "Absorbed":
        """information (p, p) and gradient (p,) at the vector."""
        unit = 1.0 / np.sqrt(np.maximum(information.diagonal(), 1e-300))
        told, towards = information * np.outer(unit, unit), unit * (gradient + information @ vector)
        free, bound = np.flatnonzero(~positive), np.flatnonzero(positive)
        root, across = factor(told[np.ix_(free, free)]), told[np.ix_(free, bound)]
        shares, alone = cho_solve(root, across), cho_solve(root, towards[free])
        rest = told[np.ix_(bound, bound)] - across.T @ shares
        return cls(vector, unit, free, bound, root, shares, alone, rest, towards[bound] - across.T @ alone)

    def steps(self, beside: Columns, positive: Flags) -> tuple[Floats, Floats]:
        """The core's step (p,), and the numbers (k,) of columns of prior N(0, 1), in units of the noise."""
        across, n, k = self.unit[:, None] * beside.across, len(self.bound), len(positive)
        with_free = across[self.free]
        give = cho_solve(self.root, with_free)
        matrix = np.empty((n + k, n + k))
        matrix[:n, :n] = self.rest
        matrix[:n, n:] = across[self.bound] - self.shares.T @ with_free
        matrix[n:, :n] = matrix[:n, n:].T
        matrix[n:, n:] = beside.among + np.eye(k) - with_free.T @ give
        right = beside.right + beside.across.T @ self.vector - with_free.T @ self.alone
        numbers, _ = bounded(matrix, np.append(self.towards, right), np.append(np.ones(n, bool), positive))
        step = np.empty(len(self.vector))
        step[self.bound] = numbers[:n]
        step[self.free] = self.alone - self.shares @ numbers[:n] - give @ numbers[n:]
        return self.unit * step - self.vector, numbers[n:]
