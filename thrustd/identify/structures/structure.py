"""The interface of a model structure: its name, how to fit it, and a fitted model that runs freely.

Free run means: deformation in, force out, never looking at the measured force. Every stretch of data starts at rest.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import log
from typing import Literal

import numpy as np

from thrustd.core.columns import Floats
from thrustd.identify.first_state import simulated
from thrustd.identify.regression.solve import Progress
from thrustd.identify.segments import DEFORMATION, Segment
from thrustd.identify.sensitivity import residuals
from thrustd.identify.structures.block_fits import BlockFits
from thrustd.model.artifact import ModelSpec

Family = Literal["physical", "static", "linear", "autoregressive", "block-oriented", "beyond"]


@dataclass(frozen=True, slots=True)
class Fitted:
    """`simulate`: segment -> force (n,), N. `spec`: the model as an artifact, where the chain of stages can hold it.

    `warnings` about the model, which matter when it is chosen; `note`: what the structure came down to, said always.
    `same_as`: name of the structure that it came down to, figure for figure.
    `again`: the same structure on more segments, from where this one ended.
    """

    n_parameters: int
    simulate: Callable[[Segment], Floats]
    spec: ModelSpec | None = None
    warnings: tuple[str, ...] = ()
    note: str = ""
    same_as: str = ""
    again: "Callable[[Sequence[Segment]], Fitted] | None" = None


@dataclass(frozen=True, slots=True)
class Structure:
    """`channels`: what it reads besides deformation_mm. `fit` takes what it can from the block fits of others."""

    name: str
    title: str
    family: Family
    fit: Callable[[Sequence[Segment], BlockFits, Progress | None], Fitted]
    channels: tuple[str, ...] = ()


def of_spec(spec: ModelSpec, n_parameters: int, warnings: tuple[str, ...] = (), note: str = "") -> Fitted:
    """A fitted artifact."""
    return Fitted(n_parameters, lambda segment: _simulated(spec, segment), spec, warnings, note)


def _simulated(spec: ModelSpec, segment: Segment) -> Floats:
    unloaded = Segment(segment.record, segment.start_s, segment.dt_s, segment.inputs, np.zeros(len(segment)))
    return -residuals(spec, unloaded)


def error_over(spec: ModelSpec, segments: Sequence[Segment]) -> float:
    """RMS of the free run from rest over all segments; infinite for a model that runs away."""
    with np.errstate(all="ignore"):
        return _size(np.concatenate([residuals(spec, s)[np.isfinite(s.force_n)] for s in segments]))


def error_from_past(spec: ModelSpec, segments: Sequence[Segment]) -> float:
    """As `error_over`, every segment from the state that its first stretch shows."""
    simulate = of_spec(spec, 0).simulate
    with np.errstate(all="ignore"):
        missed = [(s.force_n - simulated(simulate, s, simulate(s)))[np.isfinite(s.force_n)] for s in segments]
        return _size(np.concatenate(missed))


def _size(missed: Floats) -> float:
    """RMS that a NaN does not hide in."""
    error = float(np.sqrt(np.mean(missed**2)))
    return error if np.isfinite(error) else np.inf


def schwarz(rmse: float, samples: float, n_parameters: int) -> float:
    """Schwarz' criterion n ln(mse) + p ln n for Gaussian residuals: the least is best."""
    if not 0 < rmse < np.inf:
        return -np.inf if rmse == 0 else np.inf
    return 2 * samples * log(rmse) + n_parameters * log(samples)


def deformation(segment: Segment) -> Floats:
    return segment.inputs[DEFORMATION]
