"""Records of millions of samples: the shape from means of all, then a few modes and finer curves over all samples.

Means of so many samples that some ten thousand remain show the curves and the relaxation, fast modes only as what they
leave of a step. The memory then runs through every sample, the regression counts some hundred thousand of them.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from thrustd.core.columns import Floats
from thrustd.identify.regression.curve import Grid
from thrustd.identify.regression.free_run import simulate
from thrustd.identify.regression.general import FASTEST, records_of
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.reduce import reduced
from thrustd.identify.regression.shape import Point, Shape
from thrustd.identify.regression.solve import Given, Progress, Solution, solve
from thrustd.identify.segments import DEFORMATION, Segment

MANY = 300_000  # samples: more are long
THINNED = 60_000  # means that give the shape
COUNTED = 120_000  # samples at the full rate that count
FINER = 3  # times as many coefficients in a curve
PASSES = 10  # at most, over all samples and over their means
SETTLED = Given(least=1, share=1e-4)  # each of these until it hardly gains
KEPT = 0.95  # of the error: with one mode more less than this is left, or it is not kept
RARE = 0.1  # of the samples counted, at either end of the output, are counted there beside them


def sparse(shape: Shape, point: Point, records: Sequence[Record]) -> list[Record]:
    """With so many references left that the regression counts enough; where the output hardly ever goes, all of them.

    What is rare is judged by the model's output: chosen by the measured one, noise would be taken for a bend.
    """
    step = max(1, sum(map(len, records)) // COUNTED)
    if step == 1:
        return list(records)
    outputs = [simulate(shape, point, record) for record in records]
    rare = np.quantile(np.concatenate(outputs), (RARE / step, 1 - RARE / step))
    return [
        replace(r, y=np.where(_counted(out, step, rare), r.y, np.nan)) for r, out in zip(records, outputs, strict=True)
    ]


def _counted(output: Floats, step: int, rare: Floats) -> NDArray[np.bool_]:
    return (np.arange(len(output)) % step == 0) | (output < rare[0]) | (output > rare[1])


def few_modes(
    dense: Solution, thin: Sequence[Segment], dt_s: float, order: int | None, progress: Progress | None
) -> Solution:
    """The fewest modes with which hardly more is missed than with more, or `order`; they move, records begin settled.

    What came before one of millions of samples is soon forgotten.
    """
    most = len(dense.point.gain)
    pairs = len(dense.point.pair_gain) if order is None else min(len(dense.point.pair_gain), order // 2)

    def with_modes(count: int) -> Solution:
        shape, point = reduced(dense.shape, dense.point, count + 2 * pairs, pairs)
        shape = replace(shape, begun=0, limits_s=(dt_s, shape.limits_s[1]))
        start, records = replace(point, begin=np.zeros(0)), records_of(shape, thin)
        return solve(shape, start, records, dense.precisions, iterations=PASSES, progress=progress, given=SETTLED)

    if order is not None:
        return with_modes(order - 2 * pairs)
    few = with_modes(min(1, most))
    for count in range(2, most + 1):
        more = with_modes(count)
        if KEPT**2 * few.mean_square < min(more.mean_square, dense.mean_square):
            break
        few = more
    return few


def finer(found: Solution, segments: Sequence[Segment]) -> tuple[Shape, Point]:
    """Curves on finer grids over all that `segments` reach, for means reach less far: the same model."""
    shape, point = found.shape, found.point
    f_grid = _finer(shape.f_grid, [s.inputs[DEFORMATION] for s in segments])
    h_grid = _finer(shape.h_grid, [s.force_n / shape.output_scale for s in segments]) if shape.h_grid else None
    h = onto(shape.h_grid, point.h, h_grid) if shape.h_grid and h_grid else point.h
    return replace(shape, f_grid=f_grid, h_grid=h_grid), replace(point, f=onto(shape.f_grid, point.f, f_grid), h=h)


def with_spare(shape: Shape, point: Point, dt_s: float, mean_s: float) -> tuple[Shape, Point]:
    """One mode more, not there yet, between what samples show and what means do."""
    fast_s = np.sqrt(2 * dt_s * FASTEST * mean_s)
    log_tau = np.concatenate(([np.log(fast_s)], point.log_tau))
    gain = np.concatenate(([0.0], point.gain))
    return replace(shape, taus_s=np.exp(log_tau)), replace(point, log_tau=log_tau, gain=gain)


def _finer(grid: Grid, columns: Sequence[Floats]) -> Grid:
    low = min(float(np.nanmin(column)) for column in columns)
    high = max(float(np.nanmax(column)) for column in columns)
    return Grid(min(grid.low, low), max(grid.high, high), grid.n if grid.n == 4 else FINER * grid.n)


def onto(old: Grid, coefficients: Floats, new: Grid) -> Floats:
    at = np.linspace(new.low, new.high, 10 * new.n)
    return np.linalg.lstsq(new.values(at), old.values(at) @ coefficients, rcond=None)[0].astype(np.float64)
