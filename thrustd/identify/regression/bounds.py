"""Minimum of a quadratic under bounds: of sign, and of how far a number may move in one step."""

import numpy as np
from scipy.linalg import pinvh
from scipy.linalg.lapack import dpotrf, dpotrs, dtrtrs
from scipy.optimize import nnls

from thrustd.core.columns import Flags, Floats
from thrustd.core.errors import ModelError

HOLDS = 1e6  # times its precision: what holds a number


def bounded(matrix: Floats, right: Floats, positive: Flags) -> tuple[Floats, Flags]:
    """Minimum of t'At/2 - b't with t[positive] >= 0 (n,), and which of t are free: elimination, then NNLS."""
    scale = 1.0 / np.sqrt(np.maximum(matrix.diagonal(), 1e-300))
    a, b = matrix * (scale[:, None] * scale), np.asarray_chkfinite(right * scale)
    a.flat[:: len(b) + 1] += 1e-13
    if not positive.any():
        return _solved(factor(a), b) * scale, ~positive
    p, q = np.flatnonzero(positive), np.flatnonzero(~positive)
    t, of_p, of_q = np.zeros(len(b)), p[:, None], q[:, None]
    root_q, a_qp = factor(a[of_q, q]), a[of_q, p]
    across = _solved(root_q, a_qp)
    schur = a[of_p, p] - a[of_p, q] @ across
    left = b[p] - across.T @ b[q]
    schur.flat[:: len(p) + 1] += 1e-12 * np.trace(schur) / len(p)
    root = np.tril(factor(schur, lower=True)[0])
    t[p] = nnls(root.T, dtrtrs(root.T, left, trans=True)[0], maxiter=50 * len(p))[0]
    t[q] = _solved(root_q, b[q] - a_qp @ t[p])
    return t * scale, ~positive | (t > 0.0)


def _solved(root: tuple[Floats, bool], right: Floats) -> Floats:
    """scipy's `cho_solve`, called so often on so little that its looking at what it is given was most of it."""
    if not right.size:
        return np.zeros(right.shape)
    found: Floats = dpotrs(root[0], right, lower=root[1])[0]
    return found


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


def factor(matrix: Floats, lower: bool = False) -> tuple[Floats, bool]:
    """Of a matrix that rounding may have left without its last digits of definiteness; for `cho_solve`."""
    if not len(np.asarray_chkfinite(matrix)):  # LAPACK would take a number that is none
        return matrix, lower
    for ridge in (0.0, 1e-11, 1e-9, 1e-7):
        root, failed = dpotrf(matrix + ridge * np.eye(len(matrix)) if ridge else matrix, lower, clean=False)
        if not failed:
            return root, lower
    raise ModelError("these data and this model do not determine a curve: no positive information; expected more data")


def inverse(information: Floats) -> Floats:
    """Pseudo-inverse (n, n) of what is known of numbers of any size; what nothing tells has no variance.

    By QR (`pinvh`): on some of these matrices LAPACK's divide and conquer, numpy's, does not converge.
    """
    scale = 1.0 / np.sqrt(np.diag(information))
    both = np.outer(scale, scale)
    found: Floats = pinvh(information * both, rtol=1e-13) * both
    return found
