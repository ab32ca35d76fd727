"""HW-PWL from records: the search (`hw_fit`), the model in the data's units (`hw_spec`), and warnings."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from thrustd.identify.hw_fit import HwFit, HwSettings, Progress, fit_segments
from thrustd.identify.hw_spec import spec_of
from thrustd.identify.hw_theta import Layout
from thrustd.identify.segments import DEFORMATION, segments_of
from thrustd.model.artifact import ModelSpec
from thrustd.model.stage import Floats
from thrustd.records.recording import Recording

__all__ = ["FitResult", "HwSettings", "fit_hw_pwl"]

NEAR_BOUND = 0.02  # of a logarithm
FEWEST = 20  # samples in a segment of a curve


@dataclass(frozen=True, slots=True)
class FitResult:
    """A fitted model, its error on the data it was fitted to (initial states estimated along), and warnings."""

    spec: ModelSpec
    rmse_n: float
    warnings: tuple[str, ...]
    fit: HwFit


def fit_hw_pwl(
    records: Sequence[Recording],
    settings: HwSettings | None = None,
    progress: Progress | None = None,
    name: str = "mount",
) -> FitResult:
    """Fit deformation_mm -> force_N of all records together."""
    fit = fit_segments(segments_of(records), settings or HwSettings(), progress)
    return FitResult(spec_of(fit, name), fit.rmse, tuple(warnings_of(fit)), fit)


def warnings_of(fit: HwFit) -> list[str]:
    """What its user should know about a fit."""
    return [*fit.notes, *pole_warnings(fit), *(empty_segments(fit) if fit.free_input else [])]


def pole_warnings(fit: HwFit) -> list[str]:
    """Time constants that ended on a bound of the search while their mode has a part in the output."""
    layout: Layout = fit.point.layout
    logs = fit.point.theta[layout.poles][: layout.n_real]
    gains = np.abs(fit.point.theta[layout.gains][: layout.n_real])
    low, high = np.log(fit.limits_s)
    return [
        f"time constant {np.exp(log):.3g} s is on the bound of the search: the data do not show a mode that "
        f"{'fast: sample faster or lower the order' if log - low < NEAR_BOUND else 'slow: record longer'}"
        for log, gain in zip(logs, gains, strict=True)
        if gain > 1e-3 and (log - low < NEAR_BOUND or high - log < NEAR_BOUND)
    ]


def empty_segments(fit: HwFit) -> list[str]:
    """Segments of the input curve in which there are hardly any data."""
    layout, units = fit.point.layout, fit.units
    edges: Floats = units.u_zero + units.u_span * fit.point.theta[layout.fx]
    count = np.histogram(np.concatenate([segment.inputs[DEFORMATION] for segment in fit.segments]), edges)[0]
    return [
        f"input curve: {number} samples between {a:.4g} and {b:.4g}; the curve there is interpolated"
        for number, (a, b) in zip(count, pairwise(edges), strict=True)
        if number < FEWEST
    ]
