"""What makes a fitted model an artifact: error by region, provenance, witness rows."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.metadata import version

import msgspec
import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.signals import CATALOGUE
from thrustd.identify.error_map import error_map
from thrustd.identify.first_state import beginnings_of, begun_at, known_beginning
from thrustd.identify.segments import DEFORMATION, Segment
from thrustd.identify.sensitivity import residuals, segments_for
from thrustd.model.artifact import ModelSpec, PiecewiseLinear, Witness
from thrustd.model.compile import model_stages, witness_of
from thrustd.records.once import columns_sha256
from thrustd.records.recording import Recording
from thrustd.records.roles import COLUMNS, roles_of

WITNESS_BEYOND = 0.1  # of the valid range, on either side of it
DATES = ("date", "recorded", "start_time", "start", "date_utc")


def finished(
    spec: ModelSpec,
    train: Sequence[Recording],
    held_out: Sequence[Recording],
    options: Mapping[str, str | float],
) -> ModelSpec:
    """Add what was measured about a model: error map on held-out records, provenance, witness."""
    segments = segments_for(spec, train)
    measured = msgspec.structs.replace(
        spec,
        error=error_map(spec, _begun(spec, segments, segments_for(spec, held_out))),
        provenance=provenance(train, held_out, options),
    )
    return msgspec.structs.replace(measured, witness=witness_rows(measured, 1.0 / segments[0].dt_s))


def _begun(spec: ModelSpec, seen: Sequence[Segment], held_out: Sequence[Segment]) -> list[Segment]:
    """Segments held back, begun where their first stretch says; where that is hidden, as the same record did."""

    def blind(segment: Segment) -> Floats:
        return -residuals(spec, replace(segment, force_n=np.zeros(len(segment))))

    told = beginnings_of(blind, seen)
    return [begun_at(s, known_beginning(blind, s, told)) for s in held_out]


def provenance(
    train: Sequence[Recording], held_out: Sequence[Recording], options: Mapping[str, str | float]
) -> dict[str, str | float | list[str]]:
    """Where a model comes from: data by name and hash, options, versions, and the date that the data state."""
    dates = [record.metadata[key] for record in train for key in DATES if key in record.metadata]
    found: dict[str, str | float | list[str]] = {
        "train": [f"{record.name} {data_sha256(record)}" for record in train],
        "held_out": [f"{record.name} {data_sha256(record)}" for record in held_out],
        "longest_train_s": max((record.duration_s for record in train), default=0.0),  # slower modes are guesses
        "versions": [f"{package} {version(package)}" for package in ("thrustd", "numpy", "numba")],
    }
    if not (roles := roles_of(train)).own:
        found[COLUMNS] = list(roles)
    if dates:
        found["data_date"] = dates[0]
    warmth = [record["temperature_degC"] for record in train if "temperature_degC" in record]
    if warmth and all(np.isfinite(column).any() for column in warmth):
        found["mean_temperature_degC"] = float(np.mean([np.nanmean(column) for column in warmth]))  # of thermal effects
        found["std_temperature_degC"] = float(np.nanstd(np.concatenate(warmth)))
    return found | {f"option_{key}": value for key, value in options.items()}


def data_sha256(record: Recording) -> str:
    """Hash of the file a record came from, or of its columns when it was made in memory."""
    return record.sha256 or columns_sha256(record)


def witness_rows(spec: ModelSpec, rate_hz: float) -> Witness:
    """From below all knots to above them, and at once back again: no knot, mode or friction can be other than it is
    without a row that shows it. The other channels move about their values at rest.
    """
    low_mm, high_mm = spec.valid.deformation_mm
    if isinstance(spec.input_curve, PiecewiseLinear):
        low_mm, high_mm = min(low_mm, spec.input_curve.x[0]), max(high_mm, spec.input_curve.x[-1])
    middle_mm, half_mm = 0.5 * (low_mm + high_mm), (0.5 + WITNESS_BEYOND) * (high_mm - low_mm)
    way = np.concatenate((np.linspace(-1.0, 1.0, 32), np.repeat((1.0, -1.0), 8)))
    channels = {DEFORMATION: middle_mm + half_mm * way}
    wave = np.sin(np.arange(len(way)) * 0.7)
    for name in {name for stage in model_stages(spec, 1.0) for name in stage.channels} - {DEFORMATION}:
        rest = CATALOGUE[name].rest if name in CATALOGUE and np.isfinite(CATALOGUE[name].rest) else 0.0
        channels[name] = rest + 0.1 * max(1.0, abs(rest)) * wave
    return witness_of(spec, round(rate_hz, 6), channels)
