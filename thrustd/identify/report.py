"""The comparison table: every structure's free-run error on the data it was fitted to and on data it has not seen."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import isfinite, log, nan

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table

from thrustd.core.columns import Floats
from thrustd.core.measures import percents, rms, usual_load
from thrustd.identify.first_state import Beginning, Beginnings, known_beginning, run_from, simulated
from thrustd.identify.segments import Segment
from thrustd.identify.structures.structure import Fitted, schwarz

ABOVE = 4  # its place in the table
RUNAWAY = 100.0  # times the range of the data: further out a free run is called unstable


@dataclass(frozen=True, slots=True)
class Errors:
    """Free run over all segments, each from the state its first stretch shows. NaN where it cannot be said."""

    rmse_n: float
    rmse_from_rest_n: float  # the same with every segment started at rest
    mae_pct_above_2kn: float
    fit_pct: float  # 100 (1 - rmse / standard deviation of the force)
    worst_n: float
    stable: bool
    samples: int


@dataclass(frozen=True, slots=True)
class Score:
    """One line of the table."""

    structure: str
    title: str
    family: str
    train: Errors
    validation: Errors
    fit_s: float
    n_parameters: int
    aic: float
    bic: float
    same_as: str = ""  # the structure whose figures these are


def errors_of(fitted: Fitted, segments: Sequence[Segment], known: Beginnings | None = None) -> Errors:
    """Errors of one fitted structure; a run that grows beyond all measure is unstable, not a crash.

    `known`: where segments begin whose first stretch is held back from the eyes of this.
    """
    runs = [_runs(fitted, segment, known_beginning(fitted.simulate, segment, known or {})) for segment in segments]
    force, rested, error = (np.concatenate(part) for part in zip(*runs, strict=True))
    span = float(np.ptp(force))
    if not np.isfinite(error).all() or float(np.max(np.abs(error))) > RUNAWAY * span:
        return Errors(nan, nan, nan, nan, nan, False, len(error))
    return _errors(error, rested, force)


def _runs(fitted: Fitted, segment: Segment, beginning: Beginning) -> tuple[Floats, Floats, Floats]:
    """Reference, error from rest and error from the state found, where there is a reference."""
    good = np.isfinite(segment.force_n)
    with np.errstate(all="ignore"):
        from_rest = run_from(fitted.simulate, segment, beginning)
        error = segment.force_n - simulated(fitted.simulate, segment, from_rest)
    return segment.force_n[good], (segment.force_n - from_rest)[good], error[good]


def _errors(error: Floats, rested: Floats, force: Floats) -> Errors:
    rmse, spread = rms(error), float(np.std(force))
    above = percents(error, force) if usual_load(force) else np.array([])
    share = float(above.mean()) if above.size else nan
    fit = 100 * (1 - rmse / spread) if spread > 0 else nan
    return Errors(rmse, rms(rested), share, fit, float(np.max(np.abs(error))), True, len(error))


def information(errors: Errors, n_parameters: int) -> tuple[float, float]:
    """Akaike's and Schwarz' criteria for Gaussian residuals: n ln(mse) + 2 p and n ln(mse) + p ln n."""
    if not isfinite(errors.rmse_n) or errors.rmse_n <= 0:
        return nan, nan
    fit = 2 * errors.samples * log(errors.rmse_n)
    return fit + 2 * n_parameters, schwarz(errors.rmse_n, errors.samples, n_parameters)


def as_rows(scores: Sequence[Score]) -> list[dict[str, object]]:
    """For JSON: numbers that cannot be said are null."""
    return [_without_nan(asdict(score)) for score in scores]


def _without_nan(row: dict[str, object]) -> dict[str, object]:
    return {
        key: _without_nan(value) if isinstance(value, dict) else None if value != value else value
        for key, value in row.items()
    }


def as_table(scores: Sequence[Score], unit: str = "N") -> Table:
    """For the terminal; `unit` of the output, empty when nobody knows it."""
    told = any(isfinite(score.validation.mae_pct_above_2kn) for score in scores) and unit == "N"
    title = f"free-run error, {unit or 'unit of the output'}; every record from the state its first tenth shows"
    table = Table(title=title, box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    columns = [
        "structure", "train", "vali-\ndation", "from\nrest", "mean |error|\nabove 2 kN", "fit", "worst", "free\nrun",
        "para-\nmeters", "time", "AIC",
    ]  # fmt: skip
    for i, name in enumerate(columns):
        if told or i != ABOVE:
            table.add_column(name, justify="right" if i else "left", no_wrap=i > 0, min_width=0 if i else 16)
    shown = {score.structure for score in scores}
    for score in scores:
        cells = _cells(score) if score.same_as not in shown else [score.title, f"= {score.same_as}", *[""] * 9]
        table.add_row(*(cell for i, cell in enumerate(cells) if told or i != ABOVE))
    return table


def _cells(score: Score) -> list[str]:
    seen, new = score.train, score.validation
    return [
        score.title,
        _number(seen.rmse_n) if seen.stable else "-",
        _number(new.rmse_n) if new.stable else "-",
        _number(new.rmse_from_rest_n),
        f"{new.mae_pct_above_2kn:.2f} %" if isfinite(new.mae_pct_above_2kn) else "-",
        f"{new.fit_pct:.2f} %" if isfinite(new.fit_pct) else "-",
        _number(new.worst_n),
        "stable" if seen.stable and new.stable else "unstable",
        str(score.n_parameters),
        f"{score.fit_s:.1f} s",
        _number(score.aic),
    ]


def _number(value: float) -> str:
    return f"{value:.4g}" if isfinite(value) else "-"
