"""Estimation of any chosen parameters of any model: curves, linear block and effects alike.

Levenberg-Marquardt on streamed normal equations. The cost is the sum of squared residuals (or Huber's, which counts
outliers linearly), plus (value - start)^2 / prior_std^2 for parameters that should only move gently:

    (J'WJ + P + lambda D) step = J'W r - P (value - start),   D = diagonal of J'WJ + P

Bounds are kept by freezing parameters that push outwards and clipping the rest. The covariance accounts for coloured
residuals, see `thrustd.identify.covariance`. Other modules use these functions:

    pack, unpack               model <-> vector of chosen parameters   (thrustd.identify.parameters)
    simulate_records           residuals of every segment              (thrustd.identify.sensitivity)
    jacobian                   residual and J in blocks                (thrustd.identify.sensitivity)
    estimate                   all together
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from thrustd.core.errors import RecordingError
from thrustd.identify.covariance import ColouredSum, covariance
from thrustd.identify.parameters import ParameterVector, pack, unpack
from thrustd.identify.segments import Segment
from thrustd.identify.sensitivity import jacobian, jacobian_blocks, residuals, segments_for, simulate_records
from thrustd.model.artifact import ModelSpec
from thrustd.model.stage import Floats
from thrustd.records.recording import Recording

__all__ = [
    "EstimateResult",
    "EstimateSettings",
    "ParameterVector",
    "estimate",
    "estimate_segments",
    "jacobian",
    "pack",
    "simulate_records",
    "unpack",
]

Progress = Callable[[int, float], None]  # (iteration, rmse_n)
HUBER = 1.345  # sigma beyond which a residual counts linearly: 95 % efficient on Gaussian noise (Huber 1981)
_MAD = 1.4826  # median absolute deviation -> sigma


@dataclass(frozen=True, slots=True)
class EstimateSettings:
    """`prior_std`: by parameter name, how far it may plausibly move from where it starts."""

    max_iterations: int = 20
    tolerance: float = 1e-5  # relative fall of the cost that ends the search
    robust: bool = False
    prior_std: Mapping[str, float] = field(default_factory=dict)
    skip_s: float = 0.0  # first seconds of every segment without weight: the state there is a guess
    uncertainty: bool = True  # without, std and cov are NaN, and one pass with a Jacobian is saved


@dataclass(frozen=True, slots=True)
class EstimateResult:
    spec: ModelSpec
    names: tuple[str, ...]
    values: Floats  # (n,)
    std: Floats  # (n,), one sigma, residual colour included
    cov: Floats  # (n, n)
    rmse_before: float  # N
    rmse_after: float
    iterations: int
    at_bound: tuple[str, ...]  # parameters that ended on a bound


@dataclass(frozen=True, slots=True)
class _Problem:
    spec: ModelSpec
    segments: list[Segment]
    start: ParameterVector
    prior: Floats  # 1 / prior_std^2 in residual units, 0 without
    settings: EstimateSettings

    def weights(self, segment: Segment, begin: int, residual: Floats, limit: float) -> Floats:
        """1 for a sample that counts, 0 without reference, less beyond Huber's limit."""
        good = np.isfinite(residual)
        good[: max(0, round(self.settings.skip_s / segment.dt_s) - begin)] = False
        size = np.where(good, np.abs(residual), np.inf)
        with np.errstate(invalid="ignore"):
            return np.where(size > limit, np.where(good, limit / np.maximum(size, 1e-300), 0.0), 1.0) * good


def estimate(
    spec: ModelSpec,
    records: Sequence[Recording],
    which: Sequence[str],
    settings: EstimateSettings | None = None,
    progress: Progress | None = None,
) -> EstimateResult:
    """Fit the parameters chosen by the patterns `which` to the reference force of all records together."""
    return estimate_segments(spec, segments_for(spec, records), which, settings or EstimateSettings(), progress)


def estimate_segments(
    spec: ModelSpec,
    segments: list[Segment],
    which: Sequence[str],
    settings: EstimateSettings,
    progress: Progress | None = None,
) -> EstimateResult:
    """As `estimate`, on segments cut already."""
    start = pack(spec, which)
    first = np.concatenate([residuals(spec, segment) for segment in segments])
    if not np.isfinite(first).any():
        raise RecordingError(f"{segments[0].record}: no finite residual; expected force_N and a stable model")
    prior = np.array([settings.prior_std.get(name, np.inf) for name in start.names]) ** -2.0
    problem = _Problem(spec, segments, start, prior * np.nanvar(first), settings)
    vector, iterations = _search(problem, progress)
    return _result(problem, vector, iterations)


def _search(problem: _Problem, progress: Progress | None) -> tuple[ParameterVector, int]:
    vector, damping = problem.start, 1e-3
    limit = _huber_limit(problem, vector)
    cost = _cost(problem, vector, limit)
    for iteration in range(problem.settings.max_iterations):
        normal, gradient = _normal_equations(problem, vector, limit)
        before = cost
        for _ in range(8):
            trial = vector.at(vector.values + _step(vector, normal, gradient, damping))
            trial_cost = _cost(problem, trial, limit)
            if trial_cost < cost:
                vector, cost, damping = trial, trial_cost, max(damping / 10, 1e-9)
                break
            damping *= 8
        if progress is not None:
            progress(iteration, float(np.sqrt(cost / max(1, _count(problem)))))
        if before - cost <= problem.settings.tolerance * before:
            return vector, iteration + 1
    return vector, problem.settings.max_iterations


def _huber_limit(problem: _Problem, vector: ParameterVector) -> float:
    if not problem.settings.robust:
        return float("inf")
    spec = unpack(problem.spec, vector)
    middle = np.concatenate([residuals(spec, segment) for segment in problem.segments])
    return HUBER * _MAD * float(np.nanmedian(np.abs(middle - np.nanmedian(middle))))


def _cost(problem: _Problem, vector: ParameterVector, limit: float) -> float:
    """Sum of squares (Huber's beyond the limit) plus the prior; infinite when the model is."""
    spec = unpack(problem.spec, vector)
    total = float(problem.prior @ (vector.values - problem.start.values) ** 2)
    for segment in problem.segments:
        residual = residuals(spec, segment)
        weight = problem.weights(segment, 0, residual, limit)
        if not np.isfinite(residual[np.isfinite(segment.force_n)]).all():
            return float("inf")
        size = np.abs(np.where(weight > 0, residual, 0.0))
        total += float(np.sum(np.where(size <= limit, size**2, limit * (2 * size - limit) if limit < np.inf else 0.0)))
    return total


def _count(problem: _Problem) -> int:
    return sum(int(np.isfinite(segment.force_n).sum()) for segment in problem.segments)


def _normal_equations(problem: _Problem, vector: ParameterVector, limit: float) -> tuple[Floats, Floats]:
    spec = unpack(problem.spec, vector)
    normal = np.diag(problem.prior)
    gradient = -problem.prior * (vector.values - problem.start.values)
    for segment in problem.segments:
        for begin, residual, columns in jacobian_blocks(spec, segment, vector):
            weight = problem.weights(segment, begin, residual, limit)
            root = np.sqrt(weight)
            weighted = columns * root[:, None]
            normal += weighted.T @ weighted
            gradient += weighted.T @ (root * np.where(weight > 0, residual, 0.0))
    return normal, gradient


def _step(vector: ParameterVector, normal: Floats, gradient: Floats, damping: float) -> Floats:
    """Damped step in variables scaled to unit diagonal; parameters that push out of their bounds stay."""
    outwards = ((vector.values <= vector.low) & (gradient < 0)) | ((vector.values >= vector.high) & (gradient > 0))
    size = np.sqrt(np.diag(normal))
    free = ~outwards & (size > 0)
    step = np.zeros(len(vector))
    if free.any():
        scaled = normal[np.ix_(free, free)] / np.outer(size[free], size[free])
        scaled[np.diag_indices_from(scaled)] += damping
        step[free] = np.linalg.lstsq(scaled, gradient[free] / size[free], rcond=1e-12)[0] / size[free]
    return step


def _result(problem: _Problem, vector: ParameterVector, iterations: int) -> EstimateResult:
    spec = unpack(problem.spec, vector)
    cov = np.full((len(vector), len(vector)), np.nan)
    if problem.settings.uncertainty:
        cov = _coloured(problem, spec, vector)
    span = (np.isfinite(vector.low) & (vector.values <= vector.low)) | (
        np.isfinite(vector.high) & (vector.values >= vector.high)
    )
    return EstimateResult(
        spec,
        vector.names,
        vector.values,
        np.sqrt(np.maximum(np.diag(cov), 0.0)),
        cov,
        _rmse(problem.spec, problem),
        _rmse(spec, problem),
        iterations,
        tuple(name for name, hit in zip(vector.names, span, strict=True) if hit),
    )


def _rmse(spec: ModelSpec, problem: _Problem) -> float:
    squares = [residuals(spec, segment) ** 2 for segment in problem.segments]
    return float(np.sqrt(np.nanmean(np.concatenate(squares))))


def _coloured(problem: _Problem, spec: ModelSpec, vector: ParameterVector) -> Floats:
    information, middle, white, count = np.diag(problem.prior), np.zeros((len(vector), len(vector))), 0.0, 0
    for segment in problem.segments:
        means = ColouredSum.for_length(len(segment))
        for begin, residual, columns in jacobian_blocks(spec, segment, vector):
            weight = problem.weights(segment, begin, residual, float("inf"))
            kept = np.where(weight > 0, residual, 0.0)
            columns *= weight[:, None]
            information += columns.T @ columns
            means.add(kept, columns)
            white += float(kept @ kept)
            count += int(np.count_nonzero(weight))
        middle += means.middle()
    return covariance(information, middle, 0.0 if means.width == 1 else white / max(1, count) / means.width)
