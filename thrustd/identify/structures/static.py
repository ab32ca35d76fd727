"""Static structures (thesis sections 13.2 and 14.3): force as a curve of deformation, no memory.

polynomial-ols   cubic, ordinary least squares
polynomial-wls   cubic, weighted by the reciprocal number of samples at that deformation: every level counts alike
static-pwl       ten segments with knots half even, half at quantiles
"""

from collections.abc import Sequence

import numpy as np

from thrustd.core.columns import Floats
from thrustd.identify.regression.solve import Progress
from thrustd.identify.segments import Segment
from thrustd.identify.structures.block_fits import BlockFits
from thrustd.identify.structures.structure import Fitted, Structure, deformation, of_spec
from thrustd.model.artifact import Curve, LinearBlock, ModelSpec, PiecewiseLinear, Polynomial, ValidRange

DEGREE = 3
SEGMENTS = 10
BINS = 50
STRAIGHTEN = 0.01  # weight of a bend, in units of all samples
STRAIGHT = PiecewiseLinear([0.0, 1.0], [0.0, 1.0])


def _data(segments: Sequence[Segment]) -> tuple[Floats, Floats]:
    u = np.concatenate([deformation(s) for s in segments])
    force_n = np.concatenate([s.force_n for s in segments])
    good = np.isfinite(force_n)
    return u[good], force_n[good]


def _static(name: str, curve: Curve, u: Floats, force_n: Floats, n_parameters: int) -> Fitted:
    valid = ValidRange((float(u.min()), float(u.max())), (float(force_n.min()), float(force_n.max())))
    spec = ModelSpec("thrustd-model/1", name, name, curve, LinearBlock(1.0), STRAIGHT, valid)
    return of_spec(spec, n_parameters)


def _polynomial(segments: Sequence[Segment], name: str, weighted: bool) -> Fitted:
    u, force_n = _data(segments)
    centre, scale = float(u.min() + u.max()) / 2, float(np.ptp(u)) / 2
    edges = np.linspace(u.min(), u.max(), BINS + 1)
    bins = np.clip(np.searchsorted(edges, u, side="right") - 1, 0, BINS - 1)
    weight = 1 / np.sqrt(np.bincount(bins, minlength=BINS)[bins]) if weighted else None
    # `full`: an input of fewer levels than coefficients gets the smallest of them, and no warning of numpy's
    found, _ = np.polynomial.polynomial.polyfit((u - centre) / scale, force_n, DEGREE, w=weight, full=True)
    return _static(name, Polynomial(centre, scale, list(map(float, found))), u, force_n, DEGREE + 1)


def _ols(segments: Sequence[Segment], fits: BlockFits, progress: Progress | None) -> Fitted:
    return _polynomial(segments, "polynomial-ols", weighted=False)


def _wls(segments: Sequence[Segment], fits: BlockFits, progress: Progress | None) -> Fitted:
    return _polynomial(segments, "polynomial-wls", weighted=True)


def _pwl(segments: Sequence[Segment], fits: BlockFits, progress: Progress | None) -> Fitted:
    u, force_n = _data(segments)
    share = np.linspace(0, 1, SEGMENTS + 1)
    knots = np.unique(0.5 * np.quantile(u, share) + 0.5 * (u.min() + np.ptp(u) * share))
    at = np.clip(np.searchsorted(knots, u, side="right") - 1, 0, len(knots) - 2)
    t = (u - knots[at]) / np.diff(knots)[at]
    n = len(knots)
    matrix = np.diag(np.bincount(at, (1 - t) ** 2, n) + np.bincount(at + 1, t**2, n))
    side = np.bincount(at, t * (1 - t), n)[:-1]
    matrix += np.diag(side, 1) + np.diag(side, -1)
    right = np.bincount(at, (1 - t) * force_n, n) + np.bincount(at + 1, t * force_n, n)
    bends = _bends(knots)
    matrix += STRAIGHTEN * len(u) * bends.T @ bends  # hardly anything where there are data, a straight line where not
    heights = np.linalg.lstsq(matrix, right, rcond=1e-12)[0]
    curve = PiecewiseLinear(list(map(float, knots)), list(map(float, heights)))
    return _static("static-pwl", curve, u, force_n, n)


def _bends(knots: Floats) -> Floats:
    """Rows (n - 2, n): distance of each inner knot from the line of its neighbours."""
    rows = np.zeros((len(knots) - 2, len(knots)))
    for j in range(1, len(knots) - 1):
        t = (knots[j] - knots[j - 1]) / (knots[j + 1] - knots[j - 1])
        rows[j - 1, j - 1 : j + 2] = t - 1, 1, -t
    return rows


STRUCTURES = (
    Structure("polynomial-ols", "static polynomial, OLS", "static", _ols),
    Structure("polynomial-wls", "static polynomial, WLS", "static", _wls),
    Structure("static-pwl", "static piecewise linear", "static", _pwl),
)
