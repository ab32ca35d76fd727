"""Compare models with measurements: how wrong, and where.

    report = compare({"mount": spec}, [recording])
    report.to_json();  report.print(console)

Every number is of a free run: the model sees deformation and channels, never the reference. Only where the mount stood
when the recording began is told by the first tenth of it (`identify.first_state`): what came before is in no file, and
no property of the model.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from thrustd.brochure.deck import Deck
from thrustd.core.aircraft import MountPlace
from thrustd.core.columns import Floats
from thrustd.core.measures import percents, rms, usual_load
from thrustd.core.types import Progress
from thrustd.diagnose.compare.check import Check, check_of
from thrustd.diagnose.compare.checks import check_recording, far_outside
from thrustd.diagnose.compare.comparison import CompareReport, Comparison
from thrustd.diagnose.compare.failures import Failure, where_it_fails
from thrustd.diagnose.compare.first_look import first_look
from thrustd.diagnose.compare.measured_force import another_unit, no_load
from thrustd.diagnose.compare.reference import BROCHURE, is_own_output, referenced, rest_remarks
from thrustd.diagnose.compare.regions import RegionError, errors_by_region, regions_of
from thrustd.diagnose.search.evidence import lateness, simulate, simulate_in_flight
from thrustd.diagnose.search.records import shared
from thrustd.identify.first_state import beginning_of, run_from, simulated
from thrustd.identify.segments import Segment, segments_of
from thrustd.model.artifact import ModelSpec
from thrustd.model.calibrated import calibrated
from thrustd.model.compile import model_stages
from thrustd.records.recording import Recording
from thrustd.records.roles import Roles, roles_of

REGION_SAMPLES = 100_000  # at most, evenly spaced, for the search of regions
LAGS_S = (0.1, 1.0, 10.0, 60.0)
IS_NO_TRUTH = (
    "a brochure is some per cent wrong itself: `thrustd diagnose --against brochure` weighs model and brochure"
)


def compare(
    models: Mapping[str, ModelSpec],
    recordings: Sequence[Recording],
    *,
    against: str = "",
    mount: MountPlace | None = None,
    deck: Deck | None = None,
    load_cell_std_n: float | None = None,
    progress: Progress | None = None,
) -> CompareReport:
    """Run every model over every recording, one of a mount as it flies there.

    against: force_N (default), a column, or `brochure`.
    """
    if mount is not None:
        models = {name: calibrated(spec, mount, name) for name, spec in models.items()}
    remarks = rest_remarks(recordings, mount, models.values())
    records = referenced(recordings, against, mount, deck, list(models.values()))
    for record in records:
        for spec in models.values():
            check_recording(record, spec)
    total = len(models) * len(records)
    found = []
    for i, (name, spec) in enumerate(models.items()):
        for j, record in enumerate(records):
            if progress is not None:
                progress((i * len(records) + j) / total, f"{name} on {record.name}")
            found.append(_comparison(name, spec, record, load_cell_std_n, against))
    remarks += dict.fromkeys(
        line for spec in models.values() for line in (far_outside(r, spec) for r in records) if line
    )
    remarks += [f"{c.recording}: {line}" for c in found for line in _of_force(c, models[c.model]) if line]
    remarks += [c.check.sentence for c in found if c.check.sentence]
    remarks += [IS_NO_TRUTH] if against == BROCHURE else []
    looks, extents = {record.name: first_look([record]) for record in records}, [record.extent for record in records]
    return CompareReport(tuple(found), looks, tuple(extents), tuple(remarks))


def _comparison(
    name: str, spec: ModelSpec, record: Recording, load_cell_std_n: float | None, against: str
) -> Comparison:
    needed = [channel for stage in model_stages(spec, 1.0) for channel in stage.channels]
    usable = [name for name in shared([record]) if not is_own_output(name)]
    segments = segments_of([record], dict.fromkeys([*needed, *usable]))
    reference_n = np.concatenate([s.force_n for s in segments])
    rested_n, model_n = (np.concatenate(runs) for runs in zip(*(free_runs(spec, s) for s in segments), strict=True))
    flown_n = np.concatenate([simulate_in_flight(spec, s) for s in segments]) if lateness(spec)[1] else rested_n
    time_s = np.concatenate([s.time_s for s in segments])
    channels = {n: np.concatenate([s.inputs[n] for s in segments]) for n in dict.fromkeys(["deformation_mm", *usable])}
    residual = reference_n - model_n
    worst = int(np.nanargmax(np.abs(residual)))
    rmse, spread, roles = rms(residual), rms(reference_n - np.nanmean(reference_n)), roles_of([record])
    regions, failures = _regions(segments, model_n, reference_n, channels, roles)
    return Comparison(
        name,
        record.name,
        rmse,
        rms(reference_n - rested_n),
        rms(reference_n - flown_n),
        float(np.nanmean(np.abs(residual))),
        _percent_of_large(spec, residual, reference_n, roles),
        float(np.nanmean(residual)),
        100.0 * (1.0 - rmse / spread) if spread > 0 else 0.0,
        float(residual[worst]),
        float(time_s[worst]),
        _autocorrelation(residual, segments[0].dt_s),
        rmse / load_cell_std_n if load_cell_std_n else None,
        regions,
        failures,
        tuple(spec.ledger),
        time_s,
        reference_n,
        model_n,
        channels,
        roles,
        Check() if against == BROCHURE else check_of(name, spec, record, rmse, roles.output_unit),
    )


def _of_force(found: Comparison, spec: ModelSpec) -> tuple[str, str]:
    seen = found.model_n, found.reference_n
    return another_unit(*seen, found.roles), no_load(*seen, found.time_s, spec, found.roles)


def _percent_of_large(spec: ModelSpec, residual_n: Floats, reference_n: Floats, roles: Roles) -> float | None:
    """Of loads of a mount of PH-LAB's kind, in newtons; None elsewhere."""
    ours = roles.output_unit == "N" and usual_load(reference_n, *spec.valid.force_n)
    large = percents(residual_n, reference_n) if ours else np.array([])
    return float(large.mean()) if len(large) else None


def free_runs(spec: ModelSpec, segment: Segment) -> tuple[Floats, Floats]:
    """Model force (n,) from rest, and from the state that the first stretch of the segment shows."""

    def run(stretch: Segment) -> Floats:
        return simulate(spec, stretch)

    from_rest = run_from(run, segment, beginning_of(run, segment))
    return from_rest, simulated(run, segment, from_rest)


def _regions(
    segments: Sequence[Segment], model_n: Floats, reference_n: Floats, channels: Mapping[str, Floats], roles: Roles
) -> tuple[tuple[RegionError, ...], tuple[Failure, ...]]:
    stride = max(1, len(model_n) // REGION_SAMPLES)
    regions = regions_of(model_n, segments[0].dt_s, channels, roles, stride, reference_n)
    left = (reference_n - model_n)[::stride]
    return tuple(errors_by_region(regions, left)), tuple(where_it_fails(regions, left, roles.output_unit))


def _autocorrelation(residual: Floats, dt_s: float) -> dict[str, float]:
    r = np.where(np.isfinite(residual), residual - np.nanmean(residual), 0.0)
    power = float(r @ r)
    lags = {f"{lag:g} s": round(lag / dt_s) for lag in LAGS_S}
    return {
        word: float(r[:-k] @ r[k:] / power) if power > 0 else 0.0 for word, k in lags.items() if 0 < k < len(r) // 2
    }
