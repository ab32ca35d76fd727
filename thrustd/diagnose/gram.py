"""Least squares on held-back blocks, from the blocks' normal matrices alone.

For columns Z (n, q) each block b keeps G_b = Z_b' Z_b. Any regression on any choice of columns, trained on some blocks
and judged on others, then costs a solve of a few dozen unknowns and never touches the rows again:

    beta = (sum_train G_cc + ridge)^-1 sum_train G_cy,    SSE_b = G_yy - 2 beta' G_cy + beta' G_cc beta  on block b
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from thrustd.diagnose.evidence import FOLDS, Evidence
from thrustd.model.stage import Floats

TINY = 1e-9  # relative ridge on every column, against exact collinearity


@dataclass(frozen=True, slots=True)
class BlockGram:
    """Normal matrices of the columns, block by block. Column 0 is the residual to be explained."""

    matrices: Floats  # (n_blocks, q, q)
    counts: Floats  # (n_blocks,) rows with a reference
    fold: Floats  # (n_schemes, n_blocks) which fold holds the block back
    white_n2: float = 0.0  # squared error inside the rows, added to every fit

    @property
    def size(self) -> Floats:
        """Root mean square of every column (q,)."""
        total: Floats = np.sqrt(np.einsum("bii->i", self.matrices) / self.counts.sum())
        return total


def block_gram(
    evidence: Evidence,
    residual_n: Floats,
    core: Floats,
    groups: Sequence[Floats],
    white_n2: float = 0.0,
    starts: Floats | None = None,
) -> BlockGram:
    """Normal matrices of residual, core (n, p) and groups (n, k_i) of columns, in that order.

    What `starts` (n, k) can represent is taken out of everything first: it lives at the start of the record only, and
    could not be learnt from other blocks.

    Products are formed with the core and inside each group; no regression here joins two groups, so the products
    between them stay zero. Rows without reference carry no weight.
    """
    good = np.isfinite(residual_n)
    always = np.column_stack((np.where(good, residual_n, 0.0), core)) * good[:, None]
    rest = np.column_stack(groups) * good[:, None] if groups else np.empty((len(good), 0))
    if starts is not None and starts.shape[1]:
        basis = _orthonormal(starts * good[:, None])
        always = (always - basis @ (basis.T @ always)) * good[:, None]
        rest = (rest - basis @ (basis.T @ rest)) * good[:, None]
    p, ends = always.shape[1], np.cumsum([0, *(group.shape[1] for group in groups)])
    firsts = np.searchsorted(evidence.block, np.arange(evidence.n_blocks + 1))
    matrices = np.zeros((evidence.n_blocks, p + rest.shape[1], p + rest.shape[1]))
    for matrix, i, j in zip(matrices, firsts[:-1], firsts[1:], strict=True):
        mine, others = always[i:j], rest[i:j]
        matrix[:p, :p] = mine.T @ mine
        matrix[:p, p:] = mine.T @ others
        matrix[p:, :p] = matrix[:p, p:].T
        for begin, end in pairwise(ends):
            part = others[:, begin:end]
            inside = part.T @ part if end - begin > 1 else np.einsum("ij,ij->j", part, part)[:, None]
            matrix[p + begin : p + end, p + begin : p + end] = inside
    counts = np.add.reduceat(good.astype(float), firsts[:-1])
    return BlockGram(matrices, counts, _fold_schemes(evidence.n_blocks), white_n2)


def _orthonormal(columns: Floats) -> Floats:
    """Orthonormal basis of the columns' span, nearly dependent ones left out."""
    size = np.maximum(np.sqrt(np.sum(columns**2, axis=0)), 1e-300)
    left, singular, _ = np.linalg.svd(columns / size, full_matrices=False)
    basis: Floats = left[:, singular > 1e-6 * singular[0]]
    return basis


def _fold_schemes(n_blocks: int) -> Floats:
    """Two ways of holding blocks back: every sixth one, and whole sixths of the record."""
    index = np.arange(n_blocks)
    return np.array([index % FOLDS, index * FOLDS // n_blocks])


@dataclass(frozen=True, slots=True)
class Fit:
    """One regression: coefficients from all blocks, squared error of every block when it was held back."""

    beta: Floats  # (k,)
    sse: Floats  # (n_blocks,), mean of the schemes
    counts: Floats  # (n_blocks,)
    white_n2: float = 0.0

    @property
    def mse(self) -> float:
        return float(self.sse.sum() / self.counts.sum()) + self.white_n2

    @property
    def rmse(self) -> float:
        return self.mse**0.5


def held_out_fit(gram: BlockGram, chosen: Sequence[int], ridge: Sequence[float], schemes: int = 2) -> Fit:
    """Regress the residual on columns `chosen` (numbers >= 1), each with a ridge relative to its own size."""
    at = np.asarray(chosen, int)
    if len(at) == 0:
        return Fit(np.zeros(0), gram.matrices[:, 0, 0].copy(), gram.counts, gram.white_n2)
    cc = gram.matrices[:, at[:, None], at]
    cy = gram.matrices[:, at, 0]
    yy = gram.matrices[:, 0, 0]
    relative = np.asarray(ridge, float) + TINY
    sse = np.zeros(len(yy))
    for fold in gram.fold[:schemes]:
        for held in np.unique(fold):
            test = fold == held
            beta = _solve(cc[~test].sum(axis=0), cy[~test].sum(axis=0), relative)
            sse[test] += yy[test] - 2 * cy[test] @ beta + np.einsum("i,bij,j->b", beta, cc[test], beta)
    return Fit(_solve(cc.sum(axis=0), cy.sum(axis=0), relative), sse / schemes, gram.counts, gram.white_n2)


def _solve(cc: Floats, cy: Floats, relative: Floats) -> Floats:
    size = np.sqrt(np.maximum(np.diag(cc), 1e-300))
    scaled = cc / np.outer(size, size)
    scaled[np.diag_indices_from(scaled)] += relative
    solution: Floats = np.linalg.solve(scaled, cy / size) / size
    return solution


def gain_t(before: Fit, after: Fit) -> float:
    """How sure the held-back gain is: mean gain per block over its standard error.

    An effect of steps or manoeuvres gains much in few blocks, which a plain mean takes for chance; so the same is
    asked of the gains' signed square roots, and the larger answer counts.
    """
    gain = before.sse - after.sse
    return max(_t(gain), _t(np.sign(gain) * np.sqrt(np.abs(gain))))


def _t(values: Floats) -> float:
    spread = float(np.std(values, ddof=1)) * len(values) ** 0.5
    return float(values.sum() / spread) if spread > 0 else 0.0
