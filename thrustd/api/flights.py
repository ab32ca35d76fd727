"""replay, points, performance, transients, health: flights in memory."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from thrustd.brochure.deck import Deck
from thrustd.core.errors import UsageError
from thrustd.core.steady import SteadyLimits
from thrustd.flighttest import fleet_report, performance_report, points_report, transients_report
from thrustd.flighttest.fleet_health import fleet_health
from thrustd.flighttest.flight import DECK, read_flight
from thrustd.flighttest.health import HealthJob
from thrustd.flighttest.mass_sheet import MassSheet, read_mass_sheet
from thrustd.flighttest.performance import performance_of, read_wing
from thrustd.flighttest.points import find_points
from thrustd.flighttest.transients import find_transients
from thrustd.installation.shipped import shipped
from thrustd.records.files import read_recording
from thrustd.records.recording import Recording
from thrustd.records.shown import as_frame, as_html, as_text, plain_table
from thrustd.replay.picture import FlightPicture
from thrustd.replay.replay import ReplaySummary
from thrustd.replay.replay import replay as replay_log

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure
    from rich.console import Console

AIRCRAFT = "deploy/citation-ii.toml"


@dataclass(frozen=True)
class Replayed:
    """A replayed flight: `summary` with its errors where a truth is known, `record` with every column."""

    summary: ReplaySummary
    record: Recording
    picture: FlightPicture

    def to_pandas(self) -> "pd.DataFrame":
        return self.record.to_pandas()

    def plot(self) -> "Figure":
        """Thrust of every engine with its band, errors or distances of the sources below."""
        from thrustd.api.drawing import drawn
        from thrustd.replay.summary_table import largest_n

        return drawn(self.picture.figure(self.summary.log, largest_n(self.summary)))

    def show(self, console: "Console") -> None:
        from thrustd.replay.summary_table import print_summary

        print_summary(self.summary, console)

    def __repr__(self) -> str:
        return as_text(self.show)

    def _repr_html_(self) -> str:
        return as_html(self.show)


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


Table = tuple[Sequence[str], list[list[str]]]  # heads, rows


@dataclass(frozen=True)
class Answer:
    """What was found (`found`: all its numbers), as tables, sentences and one figure."""

    found: Any
    tables: list[Table]
    lines: Sequence[str]
    draw: "Callable[[], Figure]"

    def to_pandas(self) -> "pd.DataFrame":
        """A row per point, event or series; `NAME_u95` is the 95 % uncertainty of the mean `NAME`."""
        return as_frame(self.found.rows())

    def plot(self) -> "Figure":
        from thrustd.api.drawing import drawn

        return drawn(self.draw())

    def show(self, console: "Console") -> None:
        for heads, rows in self.tables:
            console.print(plain_table(heads, rows))
        for line in self.lines:
            console.print(line, highlight=False)

    def __repr__(self) -> str:
        return as_text(self.show)

    def _repr_html_(self) -> str:
        return as_html(self.show)


def points(log: str | Path, *, marks: str | None = None, **limits: float) -> Answer:
    """Steady windows of a log or recording, with thrust, fuel flow and their uncertainty.

    marks: a channel that is above 0 in a point, instead of the limits; limits: other spans, as `mach=0.01`.
    """
    unknown = sorted(set(limits) - set(SteadyLimits.__struct_fields__))
    if unknown:
        raise UsageError(f"points: no limit {unknown[0]!r}; expected of {', '.join(SteadyLimits.__struct_fields__)}")
    flight = read_flight(log)
    found = find_points(flight, SteadyLimits(**limits), marks=marks)
    said = [*points_report.unsteady(found), points_report.limits_line(found)]
    table = points_report.HEADS, points_report.table_rows(found)
    return Answer(found, [table], said, partial(points_report.figure, flight, found))


def performance(
    logs: str | Path | Sequence[str | Path],
    *,
    mass_sheet: str | Path | MassSheet | None = None,
    aircraft: str | Path | None = None,
    marks: str | None = None,
) -> Answer:
    """Drag polar of one or more flights: C_D0, Oswald's e, L/D with intervals; throttle steps against the motion.

    The mass by `mass_sheet` (TOML), or by a column mass_kg [kg]. RecordingError, one line: no mass, no air data, no
    steady window, or points that make no polar.
    """
    several = [Path(logs)] if isinstance(logs, str | Path) else [Path(log) for log in logs]
    wing = read_wing(Path(aircraft) if aircraft else shipped(AIRCRAFT, "aircraft"))
    sheet = read_mass_sheet(Path(mass_sheet)) if isinstance(mass_sheet, str | Path) else mass_sheet
    found = performance_of(several, wing, [sheet] if sheet else [], SteadyLimits(), marks)
    tables = performance_report.tables(found)
    return Answer(found, tables, performance_report.lines(found, wing.known), partial(performance_report.figure, found))


def transients(log: str | Path) -> Answer:
    """Spool-ups and -downs of a log or recording with time, overshoot and rate; flame-out and surge candidates."""
    deck = Deck.from_json(shipped(DECK, "deck").read_text(), DECK)
    flight = read_flight(log)
    found = find_transients(flight, deck)
    table = transients_report.HEADS, transients_report.table_rows(found)
    said = [transients_report.words(found)]
    return Answer(found, [table], said, partial(transients_report.figure, flight, found))


def health(logs: Sequence[str | Path]) -> Answer:
    """Engines and mounts over many flights: trends at equal conditions, what changed, when to calibrate again."""
    found = fleet_health([{"file": str(log), **row} for log in logs for row in HealthJob()(str(log))])
    table = fleet_report.HEADS, fleet_report.table_rows(found)
    return Answer(found, [table], fleet_report.lines(found), partial(fleet_report.figure, found))
