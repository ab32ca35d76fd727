"""identify, diagnose, extend, compare: the loop on recordings and models in memory."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from thrustd.api.model import Model
from thrustd.api.spoken import RENAMES, listed, spoken
from thrustd.core.errors import UsageError
from thrustd.diagnose.compare.compare import compare as compare_all
from thrustd.diagnose.compare.comparison import CompareReport
from thrustd.diagnose.extend.extend import extend as extend_spec
from thrustd.diagnose.search.diagnose import diagnose as diagnose_spec
from thrustd.diagnose.search.diagnose_report import DiagnoseReport
from thrustd.identify.identify import OTHERS
from thrustd.identify.identify import identify as identify_records
from thrustd.records.recording import Recording
from thrustd.records.roles import roles_of
from thrustd.records.shown import Shown, as_frame, drawn

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure
    from rich.console import Console

    from thrustd.model.effect import Effect

Recordings = Recording | Sequence[Recording]
NO_EFFECT = ("none", "unknown")  # verdicts that name nothing to add


@spoken
def identify(
    bench: Recordings, *, validate: Recordings = (), structures: Sequence[str] = (), name: str = "mount"
) -> Model:
    """A model of bench recordings: columns (n,) `deformation_mm`, mm, and `force_N`, N, or others in their roles.

    validate: recordings not fitted to (else a fifth of the record); structures: names of model structures to try
    (else the usual one). Errors in its report: N, RMS of free runs. RecordingError, one line: a column is missing, or
    the data cannot tell.
    """
    train = _several(bench)
    others = () if roles_of(train).own else OTHERS
    found = identify_records(train, _several(validate), structures, name=name, others=others)
    return Model(found.spec, found)


@dataclass(frozen=True, repr=False)
class Diagnosis(Shown):
    """Which effect is missing: `verdict`, its grade, candidates with parameters and look-alikes."""

    report: DiagnoseReport

    @property
    def verdict(self) -> tuple[str, ...]:
        """Words of effects, or ("none",), or ("unknown",)."""
        return self.report.verdict

    @property
    def effects(self) -> tuple[str, ...]:
        """What `extend` adds: the laws that fit best; empty when nothing is named."""
        return tuple(c.name for c in self.report.candidates if c.in_verdict)

    def to_pandas(self) -> "pd.DataFrame":
        """A row per candidate: error before and after, N, look-alikes."""
        rows = [c.to_json() for c in self.report.candidates]
        return as_frame([{k: v for k, v in row.items() if k != "parameters"} for row in rows])

    def plot(self) -> "Figure":
        """What is left against the channels that it follows; UsageError when it follows none."""
        from thrustd.diagnose.compare.pictures import dependence_figure

        if not self.report.depends_on:
            raise UsageError(f"{self.report.model}: what is left follows no channel; nothing to draw")
        return drawn(dependence_figure(self.report.depends_on))

    def show(self, console: "Console") -> None:
        advice = tuple(RENAMES.sub(listed, line) for line in self.report.advice)
        replace(self.report, advice=advice).print(console)


@spoken
def diagnose(model: Model, measured: Recordings, *, extra: "Sequence[str | Effect]" = ()) -> Diagnosis:
    """Which effect explains what the model leaves of measured recordings: force_N - model, N.

    The recordings have the columns of `identify` and, for effects that read channels, those (`accel_x_g`, ...): an
    effect without its channel is not judged, and the answer says so. extra: effects or expressions judged beside
    the shelf's: 'k * "Temp [degC]"'.
    RecordingError, one line: a column is missing, or a value contradicts its unit.
    """
    return Diagnosis(diagnose_spec(model.spec, _several(measured), name=model.name, extra=extra))


@spoken
def extend(
    model: Model,
    measured: Recordings,
    effects: "Diagnosis | str | Effect | Sequence[str | Effect]",
    *,
    name: str = "",
) -> Model:
    """The model with effects added and estimated; the given one is left as it is.

    effects: a diagnosis (what its verdict names), names of the shelf, or effects. ModelError when held-back blocks are
    not better with them; UsageError when the diagnosis names none.
    """
    if isinstance(effects, Diagnosis):
        if not effects.effects or effects.verdict[0] in NO_EFFECT:
            raise UsageError(f"{model.name}: the diagnosis says {', '.join(effects.verdict)}; expected effects to add")
        effects = effects.effects
    chosen: Any = [effects] if isinstance(effects, str) or hasattr(effects, "word") else list(effects)
    found = extend_spec(model.spec, _several(measured), chosen, name=name or f"{model.name}+")
    return Model(found.spec, found)


@dataclass(frozen=True, repr=False)
class Comparison(Shown):
    """Models against measurements: how wrong, and where."""

    report: CompareReport

    def to_pandas(self) -> "pd.DataFrame":
        """A row per model and recording: rmse_n, mae_n, bias_n, fit_pct, ..., N."""
        rows = [c.to_json() for c in self.report.comparisons]
        return as_frame([{k: v for k, v in row.items() if not isinstance(v, dict | list)} for row in rows])

    def plot(self) -> "Figure":
        """The first recording: one model with its residual, or several models side by side."""
        from thrustd.diagnose.compare.before_after import MOST_MODELS, before_after_figure
        from thrustd.diagnose.compare.pictures import history_figure

        first = self.report.comparisons[0].recording
        found = [c for c in self.report.comparisons if c.recording == first][:MOST_MODELS]
        return drawn(before_after_figure(found) if len(found) > 1 else history_figure(found[0]))

    def pictures(self, folder: str | Path) -> list[Path]:
        """Every picture of every comparison as PNG; UsageError when one already exists."""
        from thrustd.diagnose.compare.pictures import comparison_pictures

        folder = Path(folder)
        with TemporaryDirectory() as scratch:
            made = [path for c in self.report.comparisons for path in comparison_pictures(c, Path(scratch))]
            taken = [path.name for path in made if (folder / path.name).exists()]
            if taken:
                raise UsageError(f"{folder / taken[0]}: already exists; expected an empty folder")
            folder.mkdir(parents=True, exist_ok=True)
            for path in made:
                (folder / path.name).write_bytes(path.read_bytes())
        return [folder / path.name for path in made]

    def show(self, console: "Console") -> None:
        self.report.print(console)


@spoken
def compare(models: Model | Sequence[Model], recordings: Recordings) -> Comparison:
    """Free runs of every model over every recording; the models see deformation and channels, never the reference.

    Errors are measured minus model, N. RecordingError, one line: no reference. A channel that a model reads and a
    recording lacks is taken at rest (20 degC, 1 g), with a warning; one that has no rest is a RecordingError.
    """
    several = [models] if isinstance(models, Model) else list(models)
    names = [model.name if sum(m.name == model.name for m in several) == 1 else f"{model.name} {i}"
             for i, model in enumerate(several, 1)]  # fmt: skip
    specs = {name: model.spec for name, model in zip(names, several, strict=True)}
    report = compare_all(specs, _several(recordings))
    for line in report.remarks:
        warnings.warn(line, stacklevel=3)  # past `spoken`: the line of the caller
    return Comparison(report)


def _several(records: Recordings) -> list[Recording]:
    return [records] if isinstance(records, Recording) else list(records)
