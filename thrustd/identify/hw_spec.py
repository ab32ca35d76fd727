"""A fitted HW-PWL model in the units of the data."""

from collections.abc import Sequence

import numpy as np

from thrustd.identify.error_map import rates_of
from thrustd.identify.hw_fit import HwFit
from thrustd.identify.hw_shapes import Shape
from thrustd.identify.hw_theta import gain_values, pole_values
from thrustd.identify.segments import DEFORMATION, Segment
from thrustd.model.artifact import (
    ComplexMode,
    Curve,
    LinearBlock,
    ModelSpec,
    PiecewiseLinear,
    Polynomial,
    RealMode,
    ValidRange,
)
from thrustd.model.stage import Floats

JUMP = 1e-3  # of the curve's range: two knots nearer than this are a jump


def spec_of(
    fit: HwFit, name: str, structure: str = "hw-pwl", shapes: tuple[Shape, Shape] = ("pwl", "pwl")
) -> ModelSpec:
    """The fitted curves and linear block in mm and N, without anything measured about their quality."""
    layout, theta, units = fit.point.layout, fit.point.theta, fit.units
    c = theta[layout.c]
    unit_gain = abs(c) > 1e-6 and c != 1.0
    scale = c if unit_gain else 1.0
    gains = gain_values(layout, theta) / scale
    poles = pole_values(layout, theta)
    n = layout.n_real
    linear = LinearBlock(
        float(c / scale - gains.real.sum()),
        [RealMode(float(-1 / p.real), float(g.real)) for p, g in zip(poles[:n], gains[:n], strict=True)],
        [
            ComplexMode(float(-p.real), float(p.imag), float(g.real), float(g.imag))
            for p, g in zip(poles[n:], gains[n:], strict=True)
        ],
    )
    f_x = units.u_zero + units.u_span * theta[layout.fx]
    f_y = units.u_zero + units.u_span * theta[layout.fy]
    middle = c / scale * units.u_zero  # what the zero shift of w becomes behind the linear block
    h_x = middle + units.u_span * theta[layout.hx] / scale
    h_y = units.y_zero + units.y_span * theta[layout.hy]
    force_n = [segment.force_n for segment in fit.segments]
    deformation = [segment.inputs[DEFORMATION] for segment in fit.segments]
    return ModelSpec(
        schema="thrustd-model/1",
        name=name,
        structure=structure,
        input_curve=_curve(f_x, f_y, shapes[0]),
        linear=linear,
        output_curve=_curve(h_x, h_y, shapes[1]),
        valid=ValidRange(_span(deformation), _span(force_n), (0.0, _fastest(fit.segments))),
    )


def _curve(x: Floats, y: Floats, shape: Shape) -> Curve:
    """Knots as a curve, x rising; a steep pair closer than `JUMP` of the range becomes a jump."""
    if shape == "cubic":
        centre, scale = float(x[0] + x[-1]) / 2, abs(float(x[-1] - x[0])) / 2
        return Polynomial(centre, scale, list(map(float, np.polynomial.polynomial.polyfit((x - centre) / scale, y, 3))))
    if x[-1] < x[0]:
        x, y = x[::-1], y[::-1]
    x = x.copy()
    for i in range(1, len(x) - 2):
        near = x[i + 1] - x[i] < JUMP * (x[-1] - x[0])
        if near and abs(y[i + 1] - y[i]) > 20 * JUMP * np.ptp(y):
            x[i] = x[i + 1] = (x[i] + x[i + 1]) / 2
    return PiecewiseLinear(list(map(float, x)), list(map(float, y)))


def _span(parts: Sequence[Floats]) -> tuple[float, float]:
    return min(float(np.nanmin(part)) for part in parts), max(float(np.nanmax(part)) for part in parts)


def _fastest(segments: Sequence[Segment]) -> float:
    """Deformation rate, mm/s, that one sample in a thousand exceeds."""
    rates = [np.quantile(np.abs(rates_of(segment.inputs[DEFORMATION], segment.dt_s)), 0.999) for segment in segments]
    return float(max(rates))
