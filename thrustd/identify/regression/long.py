"""Records of millions of samples: the shape from means of all, then passes over shorter means, then over all samples.

Means of so many samples that some ten thousand remain show the curves and all slow relaxation. Its few modes
(`reduce`), with spare ones faster than the means, and finer curves then move together over all samples: the memory
runs through every one, the regression counts some hundred thousand of them.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from thrustd.core.columns import Floats
from thrustd.identify.regression.curve import Grid
from thrustd.identify.regression.reduce import enough, fewer
from thrustd.identify.regression.shape import Point, Shape
from thrustd.identify.regression.solve import Solution
from thrustd.identify.regression.sweep import Record, simulate
from thrustd.identify.segments import DEFORMATION, Segment

MANY = 300_000  # samples: more are long
THINNED = 60_000  # means that give the shape
MIDDLE = 480_000  # shorter means, on which it settles: a pass over them costs half of one over all samples
COUNTED = 120_000  # samples at the full rate that count
FINER = 6  # times as many coefficients in a curve
RARE = 0.1  # of the samples counted, at either end of the output, are counted there beside them
SPARE = 3  # modes faster than the means


def sparse(shape: Shape, point: Point, records: Sequence[Record], counted: int = COUNTED) -> list[Record]:
    """With so many references left that the regression counts enough; where the output hardly ever goes, all of them.

    What is rare is judged by the model's output: chosen by the measured one, noise would be taken for a bend.
    """
    step = max(1, sum(map(len, records)) // counted)
    if step == 1:
        return list(records)
    outputs = [simulate(shape, point, record) for record in records]
    rare = np.quantile(np.concatenate(outputs), (RARE / step, 1 - RARE / step))
    return [
        replace(r, y=np.where(_counted(out, step, rare), r.y, np.nan)) for r, out in zip(records, outputs, strict=True)
    ]


def _counted(output: Floats, step: int, rare: Floats) -> NDArray[np.bool_]:
    return (np.arange(len(output)) % step == 0) | (output < rare[0]) | (output > rare[1])


def finer(found: Solution, segments: Sequence[Segment], thin_dt_s: float, order: int | None) -> tuple[Shape, Point]:
    """Few modes that move, spare fast ones, curves on finer grids over all that `segments` reach: the same model.

    Means reach less far than samples do. Records begin settled: what came before one of millions is soon forgotten.
    """
    shape, point, dt_s = found.shape, found.point, segments[0].dt_s
    spare = SPARE if order is None else min(1, order - 1)
    tau_s, gain = fewer(np.exp(point.log_tau), point.gain, enough(point) if order is None else order - spare)
    fast_s = np.geomspace(2 * dt_s, 2 * thin_dt_s, spare + 2)[1:-1]
    taus_s = np.concatenate((fast_s, tau_s))
    f_grid = _finer(shape.f_grid, [s.inputs[DEFORMATION] for s in segments])
    h_grid = _finer(shape.h_grid, [s.force_n / shape.output_scale for s in segments]) if shape.h_grid else None
    new = replace(
        shape, taus_s=taus_s, f_grid=f_grid, h_grid=h_grid, move=True, begun=0, limits_s=(dt_s, shape.limits_s[1])
    )
    begun = replace(
        point,
        f=onto(shape.f_grid, point.f, f_grid),
        h=onto(shape.h_grid, point.h, h_grid) if shape.h_grid and h_grid else point.h,
        gain=np.concatenate((np.zeros(len(fast_s)), gain)),
        log_tau=np.log(taus_s),
        begin=np.zeros(0),
    )
    return new, begun


def _finer(grid: Grid, columns: Sequence[Floats]) -> Grid:
    low = min(float(np.nanmin(column)) for column in columns)
    high = max(float(np.nanmax(column)) for column in columns)
    return Grid(min(grid.low, low), max(grid.high, high), grid.n if grid.n == 4 else FINER * grid.n)


def onto(old: Grid, coefficients: Floats, new: Grid) -> Floats:
    at = np.linspace(new.low, new.high, 10 * new.n)
    return np.linalg.lstsq(new.values(at), old.values(at) @ coefficients, rcond=None)[0].astype(np.float64)
