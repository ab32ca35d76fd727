"""Where a record begins: the state of a model at the first sample, told by the first stretch of the record itself.

Recordings of other people begin anywhere: levels half way down, springs still swinging. A model that starts at rest is
then wrong for as long as its memory lasts, which says nothing about the model. What the state is follows from what came
before, so that is what is estimated: an input before the first sample, at rest at one level and then moving through
others, held for 1, 2, 4, ... samples. It suits every structure, with hysteresis or without; no state has to be known.

Gauss-Newton with finite differences; levels are believed within the input's range, and the residual of the rest of the
record is its noise. The start at rest stays unless the stretch is followed clearly better.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from thrustd.identify.segments import DEFORMATION, Segment, head
from thrustd.model.stage import Floats

Simulate = Callable[[Segment], Floats]

SHARE, LONGEST = 0.1, 20_000  # of the record, samples: the stretch that tells the state
HELD = (1, 128, 64, 32, 16, 8, 4, 2, 1)  # samples per level, the oldest first, at which the model rests
ITERATIONS = 6
STEP = 1e-3  # of the input's range
CLEARLY = 0.8  # of the stretch's sum of squares, from which on a start at rest is given up


def simulated(simulate: Simulate, segment: Segment, rested: Floats) -> Floats:
    """Free run (n,) over the segment, from the state that its first stretch shows; rested: its error from rest."""
    levels = _levels(simulate, segment, rested)
    if levels is None:
        return segment.force_n - rested
    return simulate(_with_past(segment, levels))[sum(HELD) :]


def stretch_of(segment: Segment) -> int:
    """Samples of the stretch that tells the state; 0 where the record has no reference there."""
    n = min(LONGEST, int(SHARE * len(segment)))
    return n if np.isfinite(segment.force_n[:n]).sum() > 2 * len(HELD) else 0


def _levels(simulate: Simulate, segment: Segment, rested: Floats) -> Floats | None:
    """Levels of the input before the record (len(HELD),), the oldest first; None for a start at rest."""
    n = stretch_of(segment)
    if n == 0:
        return None
    start = head(segment, n)
    u = segment.inputs[DEFORMATION]
    spread = float(np.ptp(u)) or 1.0
    good = np.isfinite(start.force_n)

    def residual(levels: Floats) -> Floats:
        out = simulate(_with_past(start, levels))[sum(HELD) :]
        return np.asarray((start.force_n - out)[good], float)

    with np.errstate(all="ignore"):
        found, cost = _searched(residual, np.full(len(HELD), u[0]), spread, float(np.nanmean(rested[n:] ** 2)))
    return found if cost < CLEARLY * float(np.nansum(rested[:n] ** 2)) else None


def _searched(residual: Callable[[Floats], Floats], rest: Floats, spread: float, noise: float) -> tuple[Floats, float]:
    """Levels and the sum of squares there."""
    levels, found = rest, residual(rest)
    prior = max(noise, 1e-12 * float(found @ found)) / spread**2
    damping, cost = 1e-3, float(found @ found)
    for _ in range(ITERATIONS):
        columns = np.column_stack([(residual(levels + STEP * spread * e) - found) / (STEP * spread)
                                   for e in np.eye(len(levels))])  # fmt: skip
        if not np.isfinite(columns).all():
            break
        matrix = columns.T @ columns + prior * np.eye(len(levels))
        right = -columns.T @ found - prior * (levels - rest)
        step = np.linalg.solve(matrix + damping * np.diag(np.diag(matrix)), right)
        trial = levels + step
        tried = residual(trial)
        total = float(tried @ tried) + prior * float((trial - rest) @ (trial - rest))
        if not total < cost:
            damping = max(damping, 1e-4) * 100
            continue
        done = total > (1 - 1e-4) * cost
        levels, found, cost, damping = trial, tried, total, damping / 10
        if done:
            break
    return levels, float(found @ found)


def _with_past(segment: Segment, levels: Floats) -> Segment:
    before = np.repeat(levels, HELD)
    inputs = {
        name: np.concatenate((np.full(len(before), column[0]), column)) for name, column in segment.inputs.items()
    }
    inputs[DEFORMATION] = np.concatenate((before, segment.inputs[DEFORMATION]))
    force_n = np.concatenate((np.full(len(before), np.nan), segment.force_n))
    return replace(segment, inputs=inputs, force_n=force_n)
