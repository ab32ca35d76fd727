"""Minimum of a quadratic under bounds: of sign, and of how far a number may move in one step."""

import numpy as np
from scipy.linalg import cho_factor, cho_solve, pinvh, solve_triangular
from scipy.optimize import nnls

from thrustd.core.columns import Flags, Floats
from thrustd.core.errors import ModelError

HOLDS = 1e6  # times its precision: what holds a number


def bounded(matrix: Floats, right: Floats, positive: Flags) -> tuple[Floats, Flags]:
    """Minimum of t'At/2 - b't with t[positive] >= 0 (n,), and which of t are free: elimination, then NNLS."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    a, b = matrix * np.outer(scale, scale) + 1e-13 * np.eye(len(right)), right * scale
    p, q = np.flatnonzero(positive), np.flatnonzero(~positive)
    t = np.zeros(len(b))
    root_q = factor(a[np.ix_(q, q)])
    if len(p):
        across = cho_solve(root_q, a[np.ix_(q, p)])
        schur = a[np.ix_(p, p)] - a[np.ix_(p, q)] @ across
        left = b[p] - across.T @ b[q]
        root = np.linalg.cholesky(schur + 1e-12 * np.eye(len(p)) * np.trace(schur) / len(p))
        t[p] = nnls(root.T, solve_triangular(root, left, lower=True), maxiter=50 * len(p))[0]
    t[q] = cho_solve(root_q, b[q] - a[np.ix_(q, p)] @ t[p])
    return t * scale, ~positive | (t > 0.0)


def within_reach(matrix: Floats, right: Floats, positive: Flags, reach: tuple[Floats, Floats]) -> tuple[Floats, Flags]:
    """The same, with every number (n,) that would go below or above its `reach` held at the end of it."""
    matrix, right, free_of = matrix.copy(), right.copy(), np.ones(len(right), bool)
    while True:
        target, free = bounded(matrix, right, positive)
        end = np.clip(target, *reach)
        far = free_of & (end != target)
        if not np.any(far):
            return target, free
        held = HOLDS * np.abs(np.diag(matrix)[far]).max()
        matrix[far, far] += held
        right[far] += held * end[far]
        free_of &= ~far


def factor(matrix: Floats) -> tuple[Floats, bool]:
    """Of a matrix that rounding may have left without its last digits of definiteness."""
    for ridge in (0.0, 1e-11, 1e-9, 1e-7):
        try:
            found: tuple[Floats, bool] = cho_factor(matrix + ridge * np.eye(len(matrix)))
        except np.linalg.LinAlgError:
            continue
        return found
    raise ModelError("these data and this model do not determine a curve: no positive information; expected more data")


def inverse(information: Floats) -> Floats:
    """Pseudo-inverse (n, n) of what is known of numbers of any size; what nothing tells has no variance.

    By QR (`pinvh`): on some of these matrices LAPACK's divide and conquer, numpy's, does not converge.
    """
    scale = 1.0 / np.sqrt(np.diag(information))
    both = np.outer(scale, scale)
    found: Floats = pinvh(information * both, rtol=1e-13) * both
    return found
