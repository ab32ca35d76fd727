"""Fewer knots: take out those which the data can best do without.

Taking a knot out means it lies on the line of its neighbours. With the normal equations M at the optimum, and e' theta
the knot's distance from that line, the cost rises by (e' theta)^2 / (e' M^-1 e) after all other parameters have
adjusted (a Wald statistic). The cheapest ones go, never two neighbours at once.
"""

from dataclasses import replace

import numpy as np

from thrustd.identify.hw_prior import bend_rows, free_columns
from thrustd.identify.hw_problem import Normal, Point
from thrustd.identify.hw_theta import Layout
from thrustd.model.stage import Floats


def bend_costs(point: Point, normal: Normal) -> Floats:
    """Rise of the sum of squares when an inner knot is taken out: f's inner knots, then h's."""
    layout = point.layout
    free = free_columns(point)
    matrix = normal.matrix[np.ix_(free, free)]
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    inverse = np.linalg.pinv(matrix / np.outer(size, size), rcond=1e-12, hermitian=True) / np.outer(size, size)
    bends = bend_rows(layout, point.theta)
    reach = bends[:, free[: layout.size]]
    inner = inverse[: reach.shape[1], : reach.shape[1]]
    spread = np.einsum("ij,jk,ik->i", reach, inner, reach)
    costs: Floats = (bends @ point.theta) ** 2 / np.maximum(spread, 1e-300)
    return costs


def merged(point: Point, normal: Normal, n_f: int, n_h: int) -> Point:
    """Without the cheapest knots, so that n_f and n_h remain (ends included)."""
    layout = point.layout
    costs = bend_costs(point, normal)
    inner_f = max(0, layout.n_f - 2)
    pins = [pin % layout.n_f for pin in point.pins]
    costs[[pin - 1 for pin in pins if 0 < pin < layout.n_f - 1]] = np.inf
    f_out = _cheapest(costs[:inner_f], layout.n_f - n_f)
    h_out = _cheapest(costs[inner_f:], layout.n_h - n_h)
    kept = np.ones(layout.size, bool)
    for part, out in ((layout.fy, f_out), (layout.fx, f_out), (layout.hy, h_out), (layout.hx, h_out)):
        kept[part.start + 1 + out] = False
    smaller = Layout(layout.n_f - len(f_out), layout.n_real, layout.n_complex, layout.n_h - len(h_out))
    first, second = (pin - int(np.sum(f_out + 1 < pin)) for pin in pins)
    return replace(point, layout=smaller, theta=point.theta[kept], pins=(first, second))


def _cheapest(costs: Floats, count: int) -> Floats:
    """Indices of up to `count` low costs, no two of them neighbours."""
    out: list[int] = []
    for i in np.argsort(costs):
        if len(out) < count and np.isfinite(costs[i]) and not {i - 1, i + 1} & set(out):
            out.append(int(i))
    return np.array(sorted(out), dtype=np.intp)
