"""Polynomial NARX (Kolmogorov-Gabor): the force from products of past forces and deformations, terms selected.

    y(k) = sum_j theta_j prod_i z_i^p_ij(k),   z = y(k-1), y(k-2), u(k), u(k-1), u(k-2),   total degree <= 3

Terms enter by error reduction ratio (forward orthogonal least squares, Billings, Nonlinear System Identification, 2013,
section 3.2), computed from the Gram matrix. Like ARX it minimises the prediction of the next sample; its free run is
as poor and unstable as the thesis found it, and is reported as such.
"""

from collections.abc import Sequence
from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import NDArray

from thrustd.identify.regression.solve import Progress
from thrustd.identify.segments import Segment
from thrustd.identify.structures.block_fits import BlockFits
from thrustd.identify.structures.structure import Fitted, Structure, deformation
from thrustd.model.stage import Floats, jit

LAGS, DEGREE, TERMS = 2, 3, 10
ROWS = 200_000
LIMIT = 50.0  # of the normalised force: further out it has run away

_N = 2 * LAGS + 1
EXPONENTS = np.array(
    [
        [combo.count(i) for i in range(_N)]
        for d in range(DEGREE + 1)
        for combo in combinations_with_replacement(range(_N), d)
    ]
)


def _fit(segments: Sequence[Segment], fits: BlockFits, progress: Progress | None) -> Fitted:
    u_all = np.concatenate([deformation(s) for s in segments])
    y_all = np.concatenate([s.force_n for s in segments])
    scale = (float(u_all.mean()), float(np.std(u_all)) or 1.0, float(np.nanmean(y_all)), float(np.nanstd(y_all)) or 1.0)
    stride = max(1, len(u_all) // ROWS)
    rows, targets = zip(*(_regressors(s, scale, stride) for s in segments), strict=True)
    table, target = np.concatenate(rows), np.concatenate(targets)
    chosen = _forward(table.T @ table, table.T @ target, float(target @ target))
    theta = np.linalg.lstsq(table[:, chosen], target, rcond=1e-12)[0]
    exponents = EXPONENTS[chosen]

    def simulate(segment: Segment) -> Floats:
        u = (deformation(segment) - scale[0]) / scale[1]
        rest = 0.0
        for _ in range(200):  # at rest under the first deformation
            rest = float(np.clip(_next(theta, exponents, np.array([rest, rest, u[0], u[0], u[0]])), -LIMIT, LIMIT))
        return _run(theta, exponents, u, rest) * scale[3] + scale[2]

    gone = next((s.record for s in segments if not np.isfinite(simulate(s)).all()), None)
    note = f"runs away in free run on {gone}, to which it was fitted" if gone is not None else ""
    return Fitted(TERMS, simulate, note=note)


def _regressors(segment: Segment, scale: tuple[float, float, float, float], stride: int) -> tuple[Floats, Floats]:
    u, y = (deformation(segment) - scale[0]) / scale[1], (segment.force_n - scale[2]) / scale[3]
    k = np.arange(LAGS, len(u), stride)
    z = np.column_stack([y[k - 1], y[k - 2], u[k], u[k - 1], u[k - 2]])
    good = np.isfinite(z).all(axis=1) & np.isfinite(y[k])
    powers = np.stack([z[good] ** p for p in range(DEGREE + 1)])
    table = np.ones((int(good.sum()), len(EXPONENTS)))
    for i in range(_N):
        table *= powers[EXPONENTS[:, i], :, i].T
    return table, y[k][good]


def _forward(gram: Floats, right: Floats, energy: float) -> NDArray[np.intp]:
    """Terms by error reduction ratio: each step deflates the Gram matrix by the chosen direction."""
    gram, right = gram.copy(), right.copy()
    size = np.diag(gram).copy()
    chosen: list[int] = []
    for _ in range(TERMS):
        left = np.diag(gram)
        ratio = np.where(left > 1e-9 * size, right**2 / np.maximum(left, 1e-300), 0.0) / energy
        ratio[chosen] = 0.0
        best = int(np.argmax(ratio))
        chosen.append(best)
        direction = gram[best] / gram[best, best]
        right = right - direction * right[best]
        gram = gram - np.outer(direction, gram[best])
    return np.array(sorted(chosen), dtype=np.intp)


@jit
def _next(theta: Floats, exponents: Floats, z: Floats) -> float:
    total = 0.0
    for j in range(theta.shape[0]):
        term = theta[j]
        for i in range(z.shape[0]):
            for _ in range(exponents[j, i]):
                term *= z[i]
        total += term
    return total


@jit
def _run(theta: Floats, exponents: Floats, u: Floats, rest: float) -> Floats:
    """Free run; NaN from where it runs away."""
    out = np.full(u.shape[0], np.nan)
    z = np.array([rest, rest, u[0], u[0], u[0]])
    for k in range(u.shape[0]):
        z[4], z[3], z[2] = z[3], z[2], u[k]
        y = _next(theta, exponents, z)
        if not abs(y) < 50.0:
            break
        out[k] = y
        z[1], z[0] = z[0], y
    return out


STRUCTURES = (Structure("narx", f"NARX, Kolmogorov-Gabor, {TERMS} terms", "autoregressive", _fit),)
