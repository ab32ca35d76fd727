"""What a model's error map says: one sigma where the force and its rate are. The outer cells extend outwards."""

from typing import Any

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.jit import compiled
from thrustd.model.artifact import ErrorMap

THESIS_STD_N = 56.0  # HW-PWL on validation data (thesis table 14.1): for an artifact without an error map


def cells(error: ErrorMap | None) -> tuple[Floats, Floats, Floats]:
    """Inner edges of force [N] and |force rate| [N/s], and one sigma [N] in each region, for `region_std_n`."""
    if error is None:
        return np.zeros(0), np.zeros(0), np.array([[THESIS_STD_N]])
    return np.array(error.force_edges_n[1:-1]), np.array(error.rate_edges_n_s[1:-1]), np.array(error.std_n)


@compiled
def _cell(edges: Floats, value: float) -> int:
    cell = 0
    for edge in edges:
        cell += value >= edge
    return cell


@compiled
def region_std_n(force_edges_n: Floats, rate_edges_n_s: Floats, std_n: Floats, force_n: float, rate_n_s: float) -> Any:
    """One sigma at one force and |force rate|."""
    return std_n[_cell(force_edges_n, force_n), _cell(rate_edges_n_s, rate_n_s)]


@compiled
def _over(force_edges_n: Floats, rate_edges_n_s: Floats, std_n: Floats, force_n: Floats, rate_n_s: Floats) -> Any:
    found = np.empty(len(force_n))
    for i in range(len(force_n)):
        found[i] = region_std_n(force_edges_n, rate_edges_n_s, std_n, force_n[i], rate_n_s[i])
    return found


def region_stds_n(error: ErrorMap, force_n: Floats, rate_n_s: Floats) -> Floats:
    """One sigma (n,) over a run: its force [N] and |force rate| [N/s], (n,) each."""
    found: Floats = _over(*cells(error), np.ascontiguousarray(force_n), np.ascontiguousarray(rate_n_s))
    return found
