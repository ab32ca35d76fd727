"""replay, points, performance, transients, health: flights in memory."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from thrustd.api.spoken import spoken
from thrustd.core.errors import UsageError
from thrustd.core.steady import SteadyLimits
from thrustd.flighttest import questions
from thrustd.flighttest.answer import Answer
from thrustd.flighttest.mass_sheet import MassSheet, read_mass_sheet
from thrustd.records.files import read_recording
from thrustd.records.recording import Recording
from thrustd.records.shown import Shown, drawn
from thrustd.replay.picture import FlightPicture
from thrustd.replay.replay import ReplaySummary
from thrustd.replay.replay import replay as replay_log

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure
    from rich.console import Console


@dataclass(frozen=True, repr=False)
class Replayed(Shown):
    """A replayed flight: `summary` with its errors where a truth is known, `record` with every column."""

    summary: ReplaySummary
    record: Recording
    picture: FlightPicture

    def to_pandas(self) -> "pd.DataFrame":
        return self.record.to_pandas()

    def plot(self) -> "Figure":
        """Thrust of every engine with its band, errors or distances of the sources below."""
        from thrustd.replay.summary_table import largest_n

        return drawn(self.picture.figure(self.summary.log, largest_n(self.summary)))

    def show(self, console: "Console") -> None:
        from thrustd.replay.summary_table import print_summary

        print_summary(self.summary, console)


@spoken
def replay(log: str | Path, *, out: str | Path | None = None) -> Replayed:
    """A flight log through the same pipeline as in flight, with the configuration that it holds.

    out: estimate log to write (.mcap). LogError, one line, when the log cannot be replayed; UsageError when `out` is
    there already.
    """
    if out is not None and Path(out).exists():
        raise UsageError(f"{out}: already exists; expected another name")
    picture = FlightPicture()
    with TemporaryDirectory() as folder:
        written = Path(out) if out is not None else Path(folder) / "estimates.mcap"
        summary = replay_log(Path(log), written, picture=picture)
        return Replayed(summary, read_recording(written, digest=False), picture)


@spoken
def points(
    log: str | Path, *, marks: str | None = None, deck: str | Path | None = None, **limits: float
) -> Answer:  # fmt: skip
    """Steady windows of a log or recording, with thrust, fuel flow and their uncertainty.

    marks: a CSV of windows, or a channel that is above 0 in a point, instead of the limits; deck: a file, for a
    recording without estimates; limits: other spans, as `mach=0.01`.
    """
    return questions.points(Path(log), _limits("points", limits), marks, deck=_path(deck))


@spoken
def performance(
    logs: str | Path | Sequence[str | Path],
    *,
    mass_sheet: str | Path | MassSheet | None = None,
    aircraft: str | Path | None = None,
    marks: str | None = None,
    deck: str | Path | None = None,
    **limits: float,
) -> Answer:
    """Drag polar of one or more flights: C_D0, Oswald's e, L/D with intervals; throttle steps against the motion.

    The mass by `mass_sheet` (TOML), or by a column mass_kg [kg]; marks, deck and limits as for `points`.
    RecordingError, one line: no mass, no air data, no steady window, or points that make no polar.
    """
    several = [Path(logs)] if isinstance(logs, str | Path) else [Path(log) for log in logs]
    sheet = read_mass_sheet(Path(mass_sheet)) if isinstance(mass_sheet, str | Path) else mass_sheet
    sheets = [sheet] if sheet else []
    spans = _limits("performance", limits)
    return questions.performance(several, sheets, spans, marks, _path(deck), _path(aircraft))


def _limits(verb: str, limits: Mapping[str, float]) -> SteadyLimits:
    unknown = sorted(set(limits) - set(SteadyLimits.__struct_fields__))
    if unknown:
        raise UsageError(f"{verb}: no limit {unknown[0]!r}; expected of {', '.join(SteadyLimits.__struct_fields__)}")
    return SteadyLimits(**limits)


def _path(file: str | Path | None) -> Path | None:
    return Path(file) if file else None


@spoken
def transients(log: str | Path, *, deck: str | Path | None = None) -> Answer:
    """Spool-ups and -downs of a log or recording with time, overshoot and rate; flame-out and surge candidates."""
    return questions.transients(Path(log), _path(deck))


@spoken
def health(logs: Sequence[str | Path]) -> Answer:
    """Engines and mounts over many flights: trends at equal conditions, what changed, when to calibrate again."""
    return questions.health([Path(log) for log in logs])
