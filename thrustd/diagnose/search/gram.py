"""Least squares on held-back blocks, from the blocks' normal matrices alone.

For columns Z (n, q) each block b keeps G_b = Z_b' Z_b. Any regression on any choice of columns, trained on some blocks
and judged on others, then costs a solve of a few dozen unknowns and never touches the rows again:

    beta = (sum_train G_cc + ridge)^-1 sum_train G_cy,    SSE_b = G_yy - 2 beta' G_cy + beta' G_cc beta  on block b
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from thrustd.diagnose.search.evidence import FOLDS, Evidence, Ints
from thrustd.diagnose.search.start import Start
from thrustd.model.stage import Floats

Mask = NDArray[np.bool_]
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
    start: Start | None = None,
) -> BlockGram:
    """Normal matrices of residual, core (n, p) and groups (n, k_i) of columns, in that order.

    What the `start` may add is taken out of everything first (multiplied by its W): it could not be learnt from other
    blocks.

    Products are formed with the core and inside each group; no regression here joins two groups, so the products
    between them stay zero. Rows without reference carry no weight.
    """
    good = np.isfinite(residual_n)
    basis = start.basis if start is not None else np.empty((len(good), 0))
    always = np.column_stack((np.where(good, residual_n, 0.0), core, basis))
    ends = always.shape[1] + np.cumsum([0, *(group.shape[1] for group in groups)])
    firsts = np.searchsorted(evidence.block, np.arange(evidence.n_blocks + 1))
    matrices = np.zeros((evidence.n_blocks, ends[-1], ends[-1]))
    for matrix, i, j in zip(matrices, firsts[:-1], firsts[1:], strict=True):
        _products(matrix, [always[i:j], *(group[i:j] for group in groups)], good[i:j])
    counts = np.add.reduceat(good.astype(float), firsts[:-1])
    p = 1 + core.shape[1]
    if start is not None and basis.shape[1]:
        matrices = _projected(matrices, p, ends, start.shrink)
    return BlockGram(matrices, counts, _fold_schemes(evidence.n_blocks), white_n2)


def _products(matrix: Floats, parts: Sequence[Floats], good: Mask) -> None:
    """Products of one block: of the first part with everything, of every other part with itself."""
    rows = np.column_stack(parts)[good]
    p = parts[0].shape[1]
    matrix[:p] = rows[:, :p].T @ rows
    matrix[p:, :p] = matrix[:p, p:].T
    ends = np.cumsum([part.shape[1] for part in parts])
    for begin, end in pairwise(ends):
        part = rows[:, begin:end]
        matrix[begin:end, begin:end] = part.T @ part


def _projected(matrices: Floats, p: int, ends: Ints, shrink: Floats) -> Floats:
    """Take the share `shrink` of what the orthonormal columns from p on explain out of all others, and drop them.

    a = z - B w with w = shrink B' z over all blocks; a' c = z_a' z_c - w_a' B' z_c - z_a' B w_c + w_a' B' B w_c.
    """
    q = p + len(shrink)
    keep = np.concatenate((np.arange(p), np.arange(q, matrices.shape[1])))
    w = shrink[:, None] * matrices[:, p:q, :].sum(axis=0)[:, keep]
    known = np.zeros((len(keep), len(keep)), bool)
    known[:p] = known[:, :p] = True
    for begin, end in pairwise(ends - (q - p)):
        known[begin:end, begin:end] = True
    out = np.empty((len(matrices), len(keep), len(keep)))
    for new, old in zip(out, matrices, strict=True):
        cross = w.T @ old[p:q, keep]
        new[:] = np.where(known, old[np.ix_(keep, keep)] - cross - cross.T + w.T @ old[p:q, p:q] @ w, 0.0)
    return out


def orthonormal(columns: Floats) -> Floats:
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
        trained = np.arange(FOLDS)[:, None] != fold
        beta = _solve(np.tensordot(trained, cc, 1), trained @ cy, relative)[fold.astype(int)]
        sse += yy - 2 * np.sum(cy * beta, axis=1) + np.sum((cc @ beta[:, :, None])[:, :, 0] * beta, axis=1)
    return Fit(_solve(cc.sum(axis=0), cy.sum(axis=0), relative), sse / schemes, gram.counts, gram.white_n2)


def _solve(cc: Floats, cy: Floats, relative: Floats) -> Floats:
    """Ridge solutions (..., k) of systems (..., k, k), every column scaled to its own size."""
    size = np.sqrt(np.maximum(np.diagonal(cc, axis1=-2, axis2=-1), 1e-300))
    scaled = cc / (size[..., :, None] * size[..., None, :]) + np.diag(relative)
    solution: Floats = np.linalg.solve(scaled, (cy / size)[..., None])[..., 0] / size
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
