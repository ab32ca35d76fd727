"""Polish a candidate: shape parameters by line search, amplitudes by re-linearising where they ended up."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from thrustd.diagnose.search.candidates import Candidate, column_at, moved_shape
from thrustd.diagnose.search.evidence import Evidence
from thrustd.diagnose.search.start import Start
from thrustd.model.artifact import ModelSpec
from thrustd.model.effect import Parameter
from thrustd.model.stage import Floats

Trial = Callable[[float], tuple[float, Candidate]]  # value of a shape parameter -> (squared error, candidate)
GOLDEN = 0.618
STEPS = 7  # evaluations per shape parameter
PASSES = 2  # re-linearisations of the amplitude


def polished(
    candidate: Candidate, spec: ModelSpec, evidence: Evidence, output_n: Floats, beside: Floats, start: Start
) -> Candidate:
    """The candidate at its best shape and amplitude; `beside` (n, k): columns re-estimated along with it."""
    problem = _Problem.of(evidence.reference_n - output_n, beside, start)
    best = _relinearised(candidate, spec, evidence, output_n, problem)
    for parameter in _shapes(candidate):

        def tried(value: float, name: str = parameter.name, start: Candidate = best) -> tuple[float, Candidate]:
            changed = moved_shape(start, name, value, spec, evidence, output_n)
            return problem.left(changed.columns), changed

        found = _line_search(tried, parameter, best.parameters[parameter.name])
        if found[0] < problem.left(best.columns):
            best = found[1]
    return _relinearised(best, spec, evidence, output_n, problem)


def _shapes(candidate: Candidate) -> Sequence[Parameter]:
    return [p for p in candidate.effect.parameters if not p.amplitude and p.estimate]


@dataclass(frozen=True, slots=True)
class _Problem:
    """Least squares of a residual on columns beside others, what the start may add taken out of all."""

    residual: Floats  # (n,), zero without reference
    beside: Floats  # (n, k)
    good: NDArray[np.bool_]  # (n,)
    start: Start

    @staticmethod
    def of(residual_n: Floats, beside: Floats, start: Start) -> "_Problem":
        good = np.isfinite(residual_n)
        return _Problem(
            start.without(np.where(good, residual_n, 0.0)), start.without(beside * good[:, None]), good, start
        )

    def solved(self, columns: Floats) -> tuple[Floats, float]:
        """(amplitudes (k,) of the columns, squared error left)."""
        table = np.column_stack((self.start.without(columns * self.good[:, None]), self.beside))
        size = np.maximum(np.sqrt(np.mean(table**2, axis=0)), 1e-300)
        table = table / size
        normal, right = table.T @ table, table.T @ self.residual
        normal[np.diag_indices_from(normal)] *= 1 + 1e-9
        solution = np.linalg.solve(normal, right)
        left = float(self.residual @ self.residual - right @ solution)
        return (solution / size)[: columns.shape[1]], left

    def left(self, columns: Floats) -> float:
        return self.solved(columns)[1]


def _relinearised(
    candidate: Candidate, spec: ModelSpec, evidence: Evidence, output_n: Floats, problem: _Problem
) -> Candidate:
    for _ in range(PASSES):
        at = candidate.with_amplitudes(problem.solved(candidate.columns)[0])
        candidate = column_at(candidate.effect, at, spec, evidence, output_n)
    return replace(candidate, parameters=candidate.with_amplitudes(problem.solved(candidate.columns)[0]))


def _line_search(tried: Trial, parameter: Parameter, start: float) -> tuple[float, Candidate]:
    """Golden-section search between the neighbouring starts, on the logarithm where that exists."""
    logarithmic = parameter.low > 0
    low, high = _bracket(parameter, start)
    a, b = (np.log(low), np.log(high)) if logarithmic else (low, high)

    def at(z: float) -> tuple[float, Candidate]:
        return tried(float(np.exp(z)) if logarithmic else float(z))

    left, right = b - GOLDEN * (b - a), a + GOLDEN * (b - a)
    at_left, at_right = at(left), at(right)
    for _ in range(STEPS - 2):
        if at_left[0] <= at_right[0]:
            b, right, at_right = right, left, at_left
            left = b - GOLDEN * (b - a)
            at_left = at(left)
        else:
            a, left, at_left = left, right, at_right
            right = a + GOLDEN * (b - a)
            at_right = at(right)
    return min(at_left, at_right, key=lambda found: found[0])


def _bracket(parameter: Parameter, start: float) -> tuple[float, float]:
    """From one neighbouring start to the other, beyond the outer ones by a factor of three, within the bounds."""
    starts = sorted(parameter.starts)
    below = max((s for s in starts if s < start * 0.999), default=start / 3 if start > 0 else parameter.low)
    above = min((s for s in starts if s > start * 1.001), default=start * 3 if start > 0 else parameter.high)
    return max(below, parameter.low), min(above, parameter.high)
