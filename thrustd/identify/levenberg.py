"""Levenberg's and Marquardt's search on normal equations, the only one of that kind beside the regression's own.

    (J'WJ + P + lambda D) step = J'W r - P (value - start),   D = diagonal of J'WJ + P

Bounds are kept by freezing parameters that push outwards and clipping the rest.
"""

from collections.abc import Callable

import numpy as np

from thrustd.core.columns import Floats

TRIES = 8  # of one step, each with more damping

Cost = Callable[[Floats], float]
Normal = Callable[[Floats], tuple[Floats, Floats]]  # values (n,) -> J'WJ + P (n, n), J'W r - P (value - start) (n,)


def search(
    start: Floats, cost: Cost, normal: Normal, bounds: tuple[Floats, Floats], iterations: int, tolerance: float
) -> Floats:
    """Values (n,) of least cost; ends with a step that lowers it by less than the relative `tolerance`."""
    values, damping, least = start, 1e-3, cost(start)
    for _ in range(iterations):
        before, (matrix, gradient) = least, normal(values)
        if not np.isfinite(matrix).all():
            break
        for _ in range(TRIES):
            trial = np.clip(values + _step(values, bounds, matrix, gradient, damping), *bounds)
            tried = cost(trial)
            if tried < least:
                values, least, damping = trial, tried, max(damping / 10, 1e-9)
                break
            damping *= 8
        if before - least <= tolerance * before:
            break
    return values


def _step(values: Floats, bounds: tuple[Floats, Floats], matrix: Floats, gradient: Floats, damping: float) -> Floats:
    """In variables scaled to unit diagonal; parameters that push out of their bounds stay."""
    outwards = ((values <= bounds[0]) & (gradient < 0)) | ((values >= bounds[1]) & (gradient > 0))
    size = np.sqrt(np.diag(matrix))
    free = ~outwards & (size > 0)
    step = np.zeros(len(values))
    if free.any():
        scaled = matrix[np.ix_(free, free)] / np.outer(size[free], size[free])
        scaled[np.diag_indices_from(scaled)] += damping
        step[free] = np.linalg.lstsq(scaled, gradient[free] / size[free], rcond=1e-12)[0] / size[free]
    return step
