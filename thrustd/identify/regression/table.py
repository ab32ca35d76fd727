"""A posterior as the artifact that flies: curves as piecewise-linear tables, lags as modes, friction as an effect.

A table has as many segments as keep it within a tenth of the noise of the smooth curve, or as many as were asked for.
"""

from collections.abc import Callable, Sequence

import numpy as np

from thrustd.core.columns import Floats
from thrustd.identify.error_map import rates_of
from thrustd.identify.regression.bounds import inverse
from thrustd.identify.regression.curve import Grid, travel
from thrustd.identify.regression.shape import Point, Shape
from thrustd.identify.regression.solve import Solution
from thrustd.identify.segments import DEFORMATION, Segment
from thrustd.model.artifact import (
    ComplexMode,
    EffectSpec,
    LinearBlock,
    ModelSpec,
    PiecewiseLinear,
    RealMode,
    ValidRange,
)
from thrustd.model.effects.hysteresis_stops import SHARES, WEIGHTS

WITHIN = 0.1  # of the noise: how far a table may be from its curve
MOST = 200  # segments
FINE = 4000  # places at which a curve is looked at
SMALL = 1e-4  # of the gain at rest: a lag with less is left out

FRICTION = "hysteresis_stops"


def spec_of(
    found: Solution, segments: Sequence[Segment], name: str, wanted: int | None = None, drawn: Sequence[Floats] = ()
) -> ModelSpec:
    """The model in the data's units, without anything measured about its quality.

    `wanted`: segments of a curve; `drawn`: what the input curve was read at, where effects carry that beyond the data.
    """
    shape, point, scale = found.shape, found.point, found.shape.output_scale
    tolerance = WITHIN * float(np.sqrt(found.mean_square)) * scale

    def f(v: Floats) -> Floats:
        return scale * (_spline(shape.f_grid, point.f, v) - _spline(shape.f_grid, point.f, np.array([shape.zero])))

    def out(x: Floats) -> Floats:
        bent = scale * _spline(shape.h_grid, point.h, x / scale) if shape.h_grid else 0.0
        return x + bent + scale * point.offset

    linear = linear_of(found)
    before = tolerance / max(1.0, abs(linear.direct))  # a sudden error passes by the lags
    reach = (shape.h_grid.low * scale, shape.h_grid.high * scale) if shape.h_grid else (0.0, scale)
    rubs = float(point.stops.sum()) > WITHIN * float(np.sqrt(found.mean_square))
    effects = [friction_of(found)] if rubs else []
    table = tabulated(f, (shape.f_grid.low, shape.f_grid.high), before, 1 if shape.line else wanted)
    return ModelSpec(
        schema="thrustd-model/1",
        name=name,
        structure="hw-pwl+prandtl-ishlinskii" if effects else "hw-pwl",
        input_curve=_as_far(f, table, drawn),
        linear=linear,
        output_curve=tabulated(out, reach, tolerance, wanted if shape.h_grid else 1),
        valid=valid_range(segments),
        effects=effects,
    )


def _spline(grid: Grid, coefficients: Floats, v: Floats) -> Floats:
    values: Floats = grid.values(v) @ coefficients
    return values


def tabulated(
    curve: Callable[[Floats], Floats], reach: tuple[float, float], tolerance: float, wanted: int | None
) -> PiecewiseLinear:
    """Knots where the curve bends, evenly in the square root of its curvature: there a table of n segments is best
    (de Boor, A Practical Guide to Splines, 1978, ch. XII)."""
    fine = np.linspace(*reach, FINE)
    heights = curve(fine)
    bend = np.sqrt(np.abs(np.gradient(np.gradient(heights, fine), fine)))
    travelled = np.concatenate(([0.0], np.cumsum(0.5 * (bend[1:] + bend[:-1]))))
    even = np.linspace(0.0, 1.0, FINE)
    share = 0.5 * (travelled / travelled[-1] + even) if travelled[-1] > 0.0 else even
    for count in (wanted,) if wanted else range(1, MOST + 1):
        x = np.interp(np.linspace(0.0, 1.0, count + 1), share, fine)
        y = curve(x)
        if float(np.abs(np.interp(fine, x, y) - heights).max()) <= tolerance:
            break
    return PiecewiseLinear(list(map(float, x)), list(map(float, y)))


def _as_far(curve: Callable[[Floats], Floats], table: PiecewiseLinear, drawn: Sequence[Floats]) -> PiecewiseLinear:
    """The table, on to where the curve was read: beyond its ends that is straight, not along the table's last chord."""
    if not drawn:
        return table
    low, high = min(float(v.min()) for v in drawn), max(float(v.max()) for v in drawn)
    below, above = [low] if low < table.x[0] else [], [high] if high > table.x[-1] else []
    heights = [list(map(float, curve(np.array(ends)))) for ends in (below, above)]
    return PiecewiseLinear([*below, *table.x, *above], [*heights[0], *table.y, *heights[1]])


def linear_of(found: Solution) -> LinearBlock:
    """x = w + sum g (w - L w) + pairs, as direct part and modes."""
    point = found.point
    kept = np.abs(point.gain) > SMALL
    real = [
        RealMode(float(np.exp(log)), -float(g)) for log, g in zip(point.log_tau[kept], point.gain[kept], strict=True)
    ]
    pairs = [
        ComplexMode(float(np.exp(logs[0])), float(np.exp(logs[1])), -float(gain[0]), -float(gain[1]))
        for logs, gain in zip(point.log_pole, point.pair_gain, strict=True)
    ]
    direct = 1.0 + float(point.gain[kept].sum()) + float(point.pair_gain[:, 0].sum())
    return LinearBlock(direct, real, pairs, "zoh" if found.shape.hold == "zoh" else "foh")


def friction_of(found: Solution) -> EffectSpec:
    """The stops with one sigma each."""
    scale, where, radii = found.shape.output_scale, found.shape.parts()["stops"], found.shape.radii
    std, names = scale * std_of(found)[where], WEIGHTS[-len(radii) :]
    weights = {n: scale * float(c) for n, c in zip(names, np.sign(radii) * found.point.stops, strict=True)}
    return EffectSpec(
        FRICTION,
        {"travel_mm": travel_of(found.shape), "growth": growth_of(found.point)} | weights,
        {name: float(s) for name, s in zip(names, std, strict=True) if weights[name] != 0.0},
    )


def growth_of(point: Point) -> float:
    return float(point.growth[0]) if len(point.growth) else 0.0


def travel_of(shape: Shape) -> float:
    """What the radii of stops are shares of."""
    return float(abs(shape.radii[-1]) / SHARES[-1]) if len(shape.radii) else float(travel(shape.f_grid))


def std_of(found: Solution) -> Floats:
    """One sigma of every number (n,) in the shape's units; 0 where a bound holds it."""
    std, free = np.zeros(found.shape.n), found.free
    std[free] = np.sqrt(np.maximum(np.diag(inverse(found.information[np.ix_(free, free)])), 0.0))
    return std


def valid_range(segments: Sequence[Segment]) -> ValidRange:
    rates = [np.quantile(np.abs(rates_of(s.inputs[DEFORMATION], s.dt_s)), 0.999) for s in segments]
    return ValidRange(
        _span([s.inputs[DEFORMATION] for s in segments]), _span([s.force_n for s in segments]), (0.0, float(max(rates)))
    )


def _span(parts: Sequence[Floats]) -> tuple[float, float]:
    return min(float(np.nanmin(part)) for part in parts), max(float(np.nanmax(part)) for part in parts)
