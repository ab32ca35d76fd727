"""Compare models with measurements: how wrong, and where.

    report = compare({"mount": spec}, [recording])
    report.to_json();  report.print(console);  report.pictures(folder)

Every number is of a free run: the model sees deformation and channels, never the reference. Only where the mount stood
when the recording began is told by the first tenth of it (`identify.first_state`): what came before is in no file, and
no property of the model.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from rich.console import Console
from rich.table import Table

from thrustd.brochure.deck import Deck
from thrustd.diagnose.checks import check_recording
from thrustd.diagnose.evidence import lateness, simulate, simulate_in_flight
from thrustd.diagnose.failures import Failure, where_it_fails
from thrustd.diagnose.newtons import newtons
from thrustd.diagnose.reference import referenced
from thrustd.diagnose.regions import RegionError, errors_by_region, regions_of
from thrustd.identify.first_state import simulated
from thrustd.identify.segments import Segment, bridged, segments_of
from thrustd.model.artifact import LedgerEntry, ModelSpec
from thrustd.model.compile import model_stages
from thrustd.model.stage import Floats
from thrustd.records.recording import Recording

LARGE_N = 2000.0  # above it, errors in per cent mean something (thesis)
REGION_SAMPLES = 200_000  # at most, evenly spaced, for the search of regions
LAGS_S = (0.1, 1.0, 10.0, 60.0)

Progress = Callable[[float, str], None]


@dataclass(frozen=True, slots=True)
class Comparison:
    """One model on one recording; arrays (n,) are kept for pictures."""

    model: str
    recording: str
    rmse_n: float
    rmse_from_rest_n: float  # the same, the model settled on the first sample
    rmse_in_flight_n: float  # from rest, as samples come in: a late reading can then only be extrapolated
    mae_n: float
    mae_pct_above_2kn: float | None
    bias_n: float
    fit_pct: float  # 100 (1 - |error| / |reference - its mean|)
    worst_n: float
    worst_at_s: float
    autocorrelation: dict[str, float]  # of the residual, by lag ("1 s")
    rmse_in_noise: float | None  # RMSE over the load cell's noise, when that is known
    regions: tuple[RegionError, ...]
    where_it_fails: tuple[Failure, ...]
    ledger: tuple[LedgerEntry, ...]
    time_s: Floats
    reference_n: Floats
    model_n: Floats
    channels: dict[str, Floats]  # deformation and every complete column

    @property
    def residual_n(self) -> Floats:
        return self.reference_n - self.model_n

    def to_json(self) -> dict[str, Any]:
        """The numbers, without arrays."""
        return {
            "model": self.model,
            "recording": self.recording,
            "rmse_n": self.rmse_n,
            "rmse_from_rest_n": self.rmse_from_rest_n,
            "rmse_in_flight_n": self.rmse_in_flight_n,
            "mae_n": self.mae_n,
            "mae_pct_above_2kn": self.mae_pct_above_2kn,
            "bias_n": self.bias_n,
            "fit_pct": self.fit_pct,
            "worst": {"error_n": self.worst_n, "time_s": self.worst_at_s},
            "autocorrelation": self.autocorrelation,
            "rmse_in_noise": self.rmse_in_noise,
            "regions": [_region_json(region) for region in self.regions],
            "where_it_fails": [_failure_json(failure) for failure in self.where_it_fails],
            "ledger": [msgspec.to_builtins(entry) for entry in self.ledger],
        }


@dataclass(frozen=True, slots=True)
class CompareReport:
    """Every model on every recording."""

    comparisons: tuple[Comparison, ...]

    def to_json(self) -> dict[str, Any]:
        return {"comparisons": [c.to_json() for c in self.comparisons]}

    def print(self, console: Console) -> None:
        """Table side by side, then where each model fails, then its error ledger."""
        console.print(_table(self.comparisons))
        for c in self.comparisons:
            console.print(f"\n[bold]Where {c.model} fails on {c.recording}[/bold]")
            for i, failure in enumerate(c.where_it_fails, 1):
                console.print(f"  {i}. {failure.sentence}", highlight=False)
            if not c.where_it_fails:
                console.print("  nowhere in particular: the error is spread as evenly as the time")
            if c.rmse_in_flight_n != c.rmse_from_rest_n:
                console.print(
                    f"  its reading is late, and put back to its time here: in flight that is extrapolated, RMSE"
                    f" {newtons(c.rmse_in_flight_n)} N",
                    highlight=False,
                )
        for c in {c.model: c for c in self.comparisons if c.ledger}.values():
            console.print(f"\n[bold]Error ledger of {c.model}[/bold]")
            for entry in c.ledger:
                fall = f"{newtons(entry.rmse_before_n)} -> {newtons(entry.rmse_after_n)} N"
                console.print(f"  + {entry.added}: {fall}  {entry.data}")

    def pictures(self, folder: Path) -> list[Path]:
        """Write the pictures of every comparison; returns their paths."""
        from thrustd.diagnose.pictures import comparison_pictures  # matplotlib takes a second to import

        return [path for c in self.comparisons for path in comparison_pictures(c, folder)]


def compare(
    models: Mapping[str, ModelSpec],
    recordings: Sequence[Recording],
    *,
    against: str = "",
    mount: str = "",
    deck: Deck | None = None,
    load_cell_std_n: float | None = None,
    progress: Progress | None = None,
) -> CompareReport:
    """Run every model over every recording. `against`: force_N (default), a column, or `brochure`."""
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
            found.append(_comparison(name, spec, record, load_cell_std_n))
    return CompareReport(tuple(found))


def _comparison(name: str, spec: ModelSpec, record: Recording, load_cell_std_n: float | None) -> Comparison:
    needed = [channel for stage in model_stages(spec, 1.0) for channel in stage.channels]
    complete = [n for n in record.channels if n != "force_N" and np.isfinite(bridged(record[n])).mean() > 0.999]
    segments = segments_of([record], dict.fromkeys([*needed, *complete]))
    reference_n = np.concatenate([s.force_n for s in segments])
    rested_n, model_n = (np.concatenate(runs) for runs in zip(*(_free_runs(spec, s) for s in segments), strict=True))
    flown_n = np.concatenate([simulate_in_flight(spec, s) for s in segments]) if lateness(spec)[1] else rested_n
    time_s = np.concatenate([s.time_s for s in segments])
    channels = {
        n: np.concatenate([s.inputs[n] for s in segments]) for n in dict.fromkeys(["deformation_mm", *complete])
    }
    residual = reference_n - model_n
    worst = int(np.nanargmax(np.abs(residual)))
    regions, failures = _regions(segments, model_n, residual, channels)
    rmse = float(np.sqrt(np.nanmean(residual**2)))
    spread = float(np.sqrt(np.nanmean((reference_n - np.nanmean(reference_n)) ** 2)))
    large = np.abs(reference_n) > LARGE_N
    return Comparison(
        name,
        record.name,
        rmse,
        float(np.sqrt(np.nanmean((reference_n - rested_n) ** 2))),
        float(np.sqrt(np.nanmean((reference_n - flown_n) ** 2))),
        float(np.nanmean(np.abs(residual))),
        float(100 * np.nanmean(np.abs(residual[large] / reference_n[large]))) if large.any() else None,
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
    )


def _free_runs(spec: ModelSpec, segment: Segment) -> tuple[Floats, Floats]:
    """Model force (n,) from rest, and from the state that the first stretch of the segment shows."""

    def run(stretch: Segment) -> Floats:
        return simulate(spec, stretch)

    from_rest = run(segment)
    return from_rest, simulated(run, segment, from_rest)


def _regions(
    segments: Sequence[Segment], model_n: Floats, residual: Floats, channels: Mapping[str, Floats]
) -> tuple[tuple[RegionError, ...], tuple[Failure, ...]]:
    stride = max(1, len(model_n) // REGION_SAMPLES)
    thin = {name: column[::stride] for name, column in channels.items()}
    regions = regions_of(model_n[::stride], segments[0].dt_s * stride, thin)
    left = residual[::stride]
    return tuple(errors_by_region(regions, left)), tuple(where_it_fails(regions, left))


def _autocorrelation(residual: Floats, dt_s: float) -> dict[str, float]:
    r = np.where(np.isfinite(residual), residual - np.nanmean(residual), 0.0)
    power = float(r @ r)
    lags = {f"{lag:g} s": round(lag / dt_s) for lag in LAGS_S}
    return {
        word: float(r[:-k] @ r[k:] / power) if power > 0 else 0.0 for word, k in lags.items() if 0 < k < len(r) // 2
    }


def _region_json(region: RegionError) -> dict[str, Any]:
    return {
        "dimension": region.dimension,
        "region": region.label,
        "rmse_n": region.rmse_n,
        "bias_n": region.bias_n,
        "share_of_time": region.share_of_time,
        "share_of_squared_error": region.share_of_squared_error,
    }


def _failure_json(failure: Failure) -> dict[str, Any]:
    return {
        "sentence": failure.sentence,
        "regions": list(failure.labels),
        "share_of_squared_error": failure.share_of_squared_error,
        "share_of_time": failure.share_of_time,
        "rmse_n": failure.rmse_n,
        "bias_n": failure.bias_n,
    }


def _table(comparisons: Sequence[Comparison]) -> Table:
    table = Table(title="Free run against the reference, from the state that the first tenth of it shows")
    for heading in ("model", "recording"):
        table.add_column(heading)
    for heading in ("RMSE N", "mean abs N", "above 2 kN %", "bias N", "fit %", "worst N", "at s", "autocorr. 1 s"):
        table.add_column(heading, justify="right")
    for c in comparisons:
        pct = "-" if c.mae_pct_above_2kn is None else f"{c.mae_pct_above_2kn:.2f}"
        row = [
            newtons(c.rmse_n),
            newtons(c.mae_n),
            pct,
            newtons(c.bias_n, "+"),
            f"{c.fit_pct:.2f}",
            newtons(c.worst_n, "+", 0),
        ]
        table.add_row(c.model, c.recording, *row, f"{c.worst_at_s:.1f}", f"{c.autocorrelation.get('1 s', 0.0):.2f}")
    return table
