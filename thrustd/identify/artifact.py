"""From a fit to an artifact: units of the data, valid range, error by region, uncertainty, provenance, witness rows."""

import hashlib
from collections.abc import Mapping, Sequence
from importlib.metadata import version

import msgspec
import numpy as np

from thrustd.identify.error_map import error_map, rates_of
from thrustd.identify.estimate import EstimateSettings, estimate_segments
from thrustd.identify.fit_hw_pwl import HwFit
from thrustd.identify.hw_theta import gain_values, pole_values
from thrustd.identify.parameters import pack
from thrustd.identify.segments import DEFORMATION, Segment
from thrustd.identify.sensitivity import residuals, segments_for
from thrustd.model.artifact import (
    SCHEMA,
    ComplexMode,
    LinearBlock,
    ModelSpec,
    PiecewiseLinear,
    RealMode,
    ValidRange,
    Witness,
)
from thrustd.model.compile import model_stages, witness_of
from thrustd.model.stage import Floats
from thrustd.records.recording import Recording
from thrustd.signals import CATALOGUE

WITNESS_ROWS = 48
STD_SAMPLES = 100_000  # stretch on which the uncertainty is computed; scaled to the whole by the square root of length
DATES = ("date", "recorded", "start_time", "start", "date_utc")
JUMP = 1e-3  # of the curve's range: two knots nearer than this are a jump


def spec_of(fit: HwFit, name: str, structure: str = "hw-pwl") -> ModelSpec:
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
        schema=SCHEMA,
        name=name,
        structure=structure,
        input_curve=_curve(f_x, f_y),
        linear=linear,
        output_curve=_curve(h_x, h_y),
        valid=ValidRange(_span(deformation), _span(force_n), (0.0, _fastest(fit.segments))),
    )


def _curve(x: Floats, y: Floats) -> PiecewiseLinear:
    """Knots as a curve, x rising; a steep pair closer than `JUMP` of the range becomes a jump."""
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


def finished(
    spec: ModelSpec,
    train: Sequence[Recording],
    held_out: Sequence[Recording],
    options: Mapping[str, str | float],
) -> ModelSpec:
    """Add what was measured about a model: error map on held-out records, uncertainty, provenance, witness."""
    segments = segments_for(spec, train)
    measured = msgspec.structs.replace(
        spec,
        error=error_map(spec, segments_for(spec, held_out)),
        parameter_std=parameter_std(spec, segments),
        provenance=provenance(train, held_out, options),
    )
    return msgspec.structs.replace(measured, witness=witness_rows(measured, segments[0]))


def parameter_std(spec: ModelSpec, segments: Sequence[Segment]) -> dict[str, float]:
    """One sigma of the model's numbers, residual colour included; the ends of f and the direct gain fix the units."""
    last = len(getattr(spec.input_curve, "y", [])) - 1
    fixed = {"linear.direct", "input_curve.y.0", f"input_curve.y.{last}"}
    names = [name for name in pack(spec).names if name not in fixed and name.partition(".")[0] in CORE]
    total = sum(len(segment) for segment in segments)
    part = _stretch(max(segments, key=len))
    result = estimate_segments(spec, [part], names, EstimateSettings(max_iterations=0))
    shrink = float(np.sqrt(len(part) / total))
    return {name: float(std) * shrink for name, std in zip(result.names, result.std, strict=True)}


CORE = ("input_curve", "linear", "output_curve")


def _stretch(segment: Segment) -> Segment:
    n = STD_SAMPLES
    inputs = {name: column[:n] for name, column in segment.inputs.items()}
    return Segment(segment.record, segment.start_s, segment.dt_s, inputs, segment.force_n[:n])


def provenance(
    train: Sequence[Recording], held_out: Sequence[Recording], options: Mapping[str, str | float]
) -> dict[str, str | float | list[str]]:
    """Where a model comes from: data by name and hash, options, versions, and the date that the data state."""
    dates = [record.metadata[key] for record in train for key in DATES if key in record.metadata]
    found: dict[str, str | float | list[str]] = {
        "train": [f"{record.name} {data_sha256(record)}" for record in train],
        "held_out": [f"{record.name} {data_sha256(record)}" for record in held_out],
        "versions": [f"{package} {version(package)}" for package in ("thrustd", "numpy", "numba")],
    }
    if dates:
        found["data_date"] = dates[0]
    warmth = [float(np.nanmean(record["temperature_degC"])) for record in train if "temperature_degC" in record]
    if warmth and np.isfinite(warmth).all():
        found["mean_temperature_degC"] = float(np.mean(warmth))  # reference of the thermal effects
    return found | {f"option_{key}": value for key, value in options.items()}


def data_sha256(record: Recording) -> str:
    """Hash of the file a record came from, or of its columns when it was made in memory."""
    if record.sha256:
        return record.sha256
    digest = hashlib.sha256(record.time_s.tobytes())
    for name in sorted(record.channels):
        digest.update(name.encode())
        digest.update(record.channels[name].tobytes())
    return digest.hexdigest()


def witness_rows(spec: ModelSpec, segment: Segment) -> Witness:
    """A few deformations of the data in their order, with every other channel moving about its value at rest."""
    rows = np.linspace(0, len(segment) - 1, WITNESS_ROWS).astype(int)
    wave = np.sin(np.arange(WITNESS_ROWS) * 0.7)
    channels = {DEFORMATION: segment.inputs[DEFORMATION][rows]}
    for name in dict.fromkeys(name for stage in model_stages(spec, 1.0) for name in stage.channels):
        rest = CATALOGUE[name].rest if name in CATALOGUE and np.isfinite(CATALOGUE[name].rest) else 0.0
        channels[name] = rest + 0.1 * max(1.0, abs(rest)) * wave
    return witness_of(spec, round(1.0 / segment.dt_s, 6), channels)


def fitted_rmse(spec: ModelSpec, segments: Sequence[Segment]) -> float:
    """Free-run error from rest over all segments, N."""
    parts = [residuals(spec, segment) for segment in segments]
    joined = np.concatenate(parts)
    return float(np.sqrt(np.nanmean(joined**2)))
