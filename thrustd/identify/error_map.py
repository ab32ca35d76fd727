"""Error of a model by region of force and force rate, on data it was not fitted to: fusion's measurement noise."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from thrustd.core.columns import Floats
from thrustd.identify.segments import Segment
from thrustd.identify.sensitivity import residuals
from thrustd.model.artifact import FORCE_RATE_TAU_S, ErrorMap, ModelSpec

FORCE_CELLS = 8
RATE_SHARES = (0.5, 0.9, 0.97, 0.99)  # quantiles of the rate that bound its cells
FEWEST = 300  # samples for a cell of its own


def rates_of(signal: Floats, dt_s: float) -> Floats:
    """Rate of change behind a first-order lag at every sample (n,), unit of the signal per second."""
    keep = np.exp(-dt_s / FORCE_RATE_TAU_S)
    lagged = lfilter([1.0 - keep], [1.0, -keep], signal, zi=[keep * signal[0]])[0]
    rate: Floats = (signal - lagged) / FORCE_RATE_TAU_S
    return rate


def error_map(spec: ModelSpec, segments: Sequence[Segment]) -> ErrorMap:
    """RMS of the residual in cells of equal force range and given quantiles of |force rate|, N."""
    parts = [-residuals(spec, replace(segment, force_n=np.zeros(len(segment)))) for segment in segments]
    force = np.concatenate(parts)
    rate = np.concatenate([np.abs(rates_of(part, s.dt_s)) for s, part in zip(segments, parts, strict=True)])
    residual = np.concatenate([s.force_n for s in segments]) - force
    good = np.isfinite(residual)
    return _cells(force[good], rate[good], residual[good])


def _cells(force: Floats, rate: Floats, residual: Floats) -> ErrorMap:
    force_edges = np.linspace(force.min(), force.max(), FORCE_CELLS + 1)
    if force.max() <= force.min():
        force_edges = force.min() + np.arange(2.0)
    inner = np.quantile(rate, RATE_SHARES)
    rate_edges = np.unique(np.concatenate(([0.0], inner, [max(float(rate.max()), 1e-6)])))
    rows = np.clip(np.searchsorted(force_edges, force, side="right") - 1, 0, len(force_edges) - 2)
    columns = np.clip(np.searchsorted(rate_edges, rate, side="right") - 1, 0, len(rate_edges) - 2)
    shape = (len(force_edges) - 1, len(rate_edges) - 1)
    place = rows * shape[1] + columns
    size = shape[0] * shape[1]
    count = np.asarray(np.bincount(place, np.ones(len(place)), size), float).reshape(shape)
    squares = np.asarray(np.bincount(place, residual**2, size), float).reshape(shape)
    return ErrorMap(force_edges.tolist(), rate_edges.tolist(), _filled(squares, count).tolist())


def _filled(squares: Floats, count: Floats) -> Floats:
    """RMS per cell; a cell with few data takes the larger of its own and its rate column's."""
    overall = max(float(np.sqrt(squares.sum() / max(1, count.sum()))), 1e-9)
    column = np.sqrt(squares.sum(axis=0) / np.maximum(1, count.sum(axis=0)))
    column = np.where(count.sum(axis=0) < FEWEST, max(overall, float(column.max())), column)
    own = np.sqrt(squares / np.maximum(1, count))
    filled: Floats = np.maximum(np.where(count < FEWEST, np.maximum(own, column), own), 1e-9)
    return filled
