"""Blocks of time of a fit: normal equations of each, the error on those held back, and what they disagree by.

With the equations of every block at hand, the estimate without a group of blocks and the error on them follow from the
linearisation at the optimum, without another pass.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, ndtri, stdtrit

from thrustd.core.columns import Flags, Floats
from thrustd.core.measures import held_out_groups
from thrustd.identify.regression.bounds import inverse, within_reach
from thrustd.identify.regression.known import Known
from thrustd.identify.regression.record import Indices, Record
from thrustd.identify.regression.shape import Point, Shape
from thrustd.identify.regression.solve import Solution, prior_of
from thrustd.identify.regression.sweep import columns, whitening

BLOCKS = 48  # of equal length over all records
TOGETHER = 1, 2, 4, 8, 16  # blocks whose scores are summed before they are compared: up to a third of the records
UPPER = 0.975  # of the distribution: 95 % intervals
FOLDS = 6  # groups of blocks held back in turn


@dataclass(frozen=True, slots=True)
class Blocks:
    """Normal equations block by block: J'J (b, n, n), J'r (b, n), r'r (b,), samples (b,)."""

    matrix: Floats
    right: Floats
    squares: Floats
    size: Floats

    @classmethod
    def none(cls, n_blocks: int, n: int) -> "Blocks":
        return cls(np.zeros((n_blocks, n, n)), np.zeros((n_blocks, n)), np.zeros(n_blocks), np.zeros(n_blocks))

    def add(self, lies_in: Indices, rows: Floats, missed: Floats) -> None:
        """Samples of these blocks."""
        for b in np.unique(lies_in):
            own, left = rows[lies_in == b], missed[lies_in == b]
            self.matrix[b] += own.T @ own
            self.right[b] += own.T @ left
            self.squares[b] += float(left @ left)
            self.size[b] += len(left)

    def missed(self, mine: Flags, step: Floats) -> Floats:
        """Sums of squares of these blocks behind a step."""
        moved: Floats = self.squares[mine] - 2 * self.right[mine] @ step + self.matrix[mine] @ step @ step
        return np.maximum(moved, 0.0)


def block_equations(
    shape: Shape, point: Point, records: Sequence[Record], n_blocks: int = BLOCKS
) -> tuple[Blocks, Blocks]:
    """As they were read, and made white (`noise`): the same where the noise is white."""
    total = sum(len(record) - record.stood for record in records)
    edges = np.arange(1, n_blocks) * total // n_blocks
    read = Blocks.none(n_blocks, shape.n)
    white = read if all(record.lasting is None for record in records) else Blocks.none(n_blocks, shape.n)
    passed = 0
    for record in records:
        along = whitening(record)
        for known, rows, missed in columns(shape, point, record):
            lies_in = np.searchsorted(edges, passed + known - record.stood, side="right")
            read.add(lies_in, rows, missed)
            if white is not read:
                white.add(lies_in, *along(known, rows, missed))
        passed += len(record) - record.stood
    return read, white


def std_over(found: Solution, blocks: Blocks, held: Flags | None = None) -> Floats:
    """One sigma (n,): the posterior's, or what the blocks disagree by where that is more; 0 where a bound holds.

    held: numbers that are as they are, as if they were known.

    Scores of blocks of time scatter by all that the noise of the likelihood leaves out: errors that last, laws that
    do not hold exactly (White, Econometrica 50 (1982) 1; blocks: Kuensch, Ann. Statist. 17 (1989) 1217). What drifts
    for longer than a block shows in several of them together.
    """
    free = found.free if held is None else found.free & ~held
    scores = (blocks.right / found.noise_variance)[:, free]
    scores = scores - scores.mean(axis=0)
    covariance = inverse(found.information[np.ix_(free, free)])
    moved, std = scores @ covariance, np.zeros(len(free))
    std[free] = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    for width in TOGETHER:
        groups = moved.reshape(-1, width, moved.shape[1]).sum(axis=1)
        count = len(groups)
        unsure = stdtrit(count - 1, UPPER) / ndtri(UPPER)  # a scatter that few groups tell
        std[free] = np.maximum(std[free], unsure * np.sqrt((groups**2).sum(axis=0) * count / (count - 1)))
    return std


def from_nothing(found: Solution, std: Floats, numbers: Sequence[int]) -> float:
    """How far some of a fit's numbers are from nothing together; a number on its bound is nothing.

    As standard errors of one number that is as unlikely to be nothing (Wald, Trans. Am. Math. Soc. 54 (1943) 426): what
    two of them share is told although neither is. std (n,): one sigma of every number, correlated as the posterior is.
    """
    free = found.free
    told = [i for i in numbers if free[i]]
    if not told:
        return 0.0
    among = np.searchsorted(np.flatnonzero(free), told)
    covariance = inverse(found.information[np.ix_(free, free)])[np.ix_(among, among)]
    size = found.point.vector(found.shape)[told] * np.sqrt(np.diag(covariance)) / std[told]
    squares = float(size @ np.linalg.solve(covariance, size))
    return float(-ndtri(chdtrc(len(told), squares) / 2))


def held_back(found: Solution, read: Blocks, white: Blocks, prior: Known) -> tuple[Floats, Floats]:
    """Mean square error (n_blocks,) of every block when its group is left out of the estimate: as read, and white."""
    vector = found.point.vector(found.shape)
    groups = prior_of(found.shape, found.precisions)
    matrix, pull = groups + prior.information(vector), groups @ vector - prior.downhill(vector)
    reach = found.shape.reach(vector)  # what a bound holds, or a prior, is held on any part of the records
    count, noise = len(read.size), found.noise_variance
    of_read, of_white = np.empty(count), np.empty(count)
    whole, right = white.matrix.sum(axis=0), white.right.sum(axis=0)
    for fold in range(FOLDS):
        mine = held_out_groups(count, FOLDS) == fold
        own, towards = white.matrix[mine], white.right[mine]
        information = (whole - own.sum(axis=0)) / noise + matrix
        gradient = (right - towards.sum(axis=0)) / noise - pull
        new, _ = within_reach(information, gradient + information @ vector, found.shape.positive(), reach)
        step = new - vector
        of_read[mine], of_white[mine] = read.missed(mine, step), white.missed(mine, step)
    size = np.maximum(read.size, 1.0)
    return of_read / size, of_white / size
