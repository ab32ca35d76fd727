"""Estimation of any chosen parameters of any model: curves, linear block and effects alike.

The cost is the sum of squared residuals, plus (value - start)^2 / prior_std^2 for parameters that should only move
gently, in units of the residual's variance at the start.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError
from thrustd.core.measures import rms
from thrustd.identify.levenberg import search
from thrustd.identify.parameters import pack, unpack
from thrustd.identify.segments import Segment
from thrustd.identify.sensitivity import jacobian, residuals
from thrustd.model.artifact import ModelSpec


class Estimated(NamedTuple):
    spec: ModelSpec
    rmse_n: float


def estimate(
    spec: ModelSpec,
    segments: Sequence[Segment],
    which: Sequence[str],
    iterations: int = 20,
    tolerance: float = 1e-5,
    prior_std: Mapping[str, float] | None = None,
) -> Estimated:
    """The parameters chosen by the patterns `which`, fitted to the reference force of all segments together.

    `prior_std`: by parameter name, how far it may plausibly move from where it starts.
    """
    start = pack(spec, which)
    first = np.concatenate([residuals(spec, segment) for segment in segments])
    if not np.isfinite(first).any():
        raise RecordingError(f"{segments[0].record}: no finite residual; expected force_N and a stable model")
    prior = np.array([(prior_std or {}).get(name, np.inf) for name in start.names]) ** -2.0 * np.nanvar(first)

    def cost(values: Floats) -> float:
        """Infinite when the model is."""
        moved, total = unpack(spec, start.at(values)), float(prior @ (values - start.values) ** 2)
        for segment in segments:
            missed = residuals(moved, segment)[np.isfinite(segment.force_n)]
            total += float(missed @ missed)
        return total if np.isfinite(total) else np.inf

    def normal(values: Floats) -> tuple[Floats, Floats]:
        matrix, gradient = np.diag(prior), -prior * (values - start.values)
        for segment in segments:
            missed, columns = jacobian(spec, segment, start.at(values))
            there = np.isfinite(missed)
            columns *= there[:, None]
            matrix += columns.T @ columns
            gradient += columns.T @ np.where(there, missed, 0.0)
        return matrix, gradient

    with np.errstate(over="ignore", invalid="ignore"):
        found = search(start.values, cost, normal, (start.low, start.high), iterations, tolerance)
    best = unpack(spec, start.at(found))
    return Estimated(best, rms(np.concatenate([residuals(best, segment) for segment in segments])))
