"""replay, points, performance: flights in memory."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from thrustd.core.aircraft import read_aircraft
from thrustd.core.errors import UsageError
from thrustd.core.steady import SteadyLimits
from thrustd.flighttest import performance_report, points_report
from thrustd.flighttest.flight import Flight, read_flight
from thrustd.flighttest.flown import flown
from thrustd.flighttest.mass_sheet import MassSheet, read_mass_sheet
from thrustd.flighttest.performance import Performance
from thrustd.flighttest.performance import performance as polar_of
from thrustd.flighttest.points import TestPoints, find_points
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


@dataclass(frozen=True)
class Points:
    """Test points of a flight."""

    found: TestPoints
    flight: Flight

    def to_pandas(self) -> "pd.DataFrame":
        """A row per point; `NAME_u95` is the 95 % uncertainty of the mean `NAME`."""
        return as_frame(self.found.rows())

    def plot(self) -> "Figure":
        from thrustd.api.drawing import drawn

        return drawn(points_report.figure(self.flight, self.found))

    def show(self, console: "Console") -> None:
        console.print(plain_table(points_report.HEADS, points_report.table_rows(self.found)))
        for line in (*points_report.unsteady(self.found), points_report.limits_line(self.found)):
            console.print(line, highlight=False)

    def __repr__(self) -> str:
        return as_text(self.show)

    def _repr_html_(self) -> str:
        return as_html(self.show)


def points(log: str | Path, *, marks: str | None = None, **limits: float) -> Points:
    """Steady windows of a log or recording, with thrust, fuel flow and their uncertainty.

    marks: a channel that is above 0 in a point, instead of the limits; limits: other spans, as `mach=0.01`.
    """
    unknown = sorted(set(limits) - set(SteadyLimits.__struct_fields__))
    if unknown:
        raise UsageError(f"points: no limit {unknown[0]!r}; expected of {', '.join(SteadyLimits.__struct_fields__)}")
    flight = read_flight(log)
    return Points(find_points(flight, SteadyLimits(**limits), marks=marks), flight)


@dataclass(frozen=True)
class DragPolar:
    """C_D0, Oswald's e and L/D of flights with intervals: `found.polars`, and the points they rest on."""

    found: Performance
    known: tuple[str, ...]

    def to_pandas(self) -> "pd.DataFrame":
        """A row per point."""
        return as_frame(self.found.rows())

    def plot(self) -> "Figure":
        from thrustd.api.drawing import drawn

        return drawn(performance_report.figure(self.found))

    def show(self, console: "Console") -> None:
        console.print(plain_table(performance_report.POLAR_HEADS, performance_report.polar_rows(self.found)))
        for line in performance_report.lines(self.found, self.known):
            console.print(line, highlight=False)

    def __repr__(self) -> str:
        return as_text(self.show)

    def _repr_html_(self) -> str:
        return as_html(self.show)


def performance(
    logs: str | Path | Sequence[str | Path],
    *,
    mass_sheet: str | Path | MassSheet | None = None,
    aircraft: str | Path | None = None,
    marks: str | None = None,
) -> DragPolar:
    """Drag polar of one or more flights; the mass by `mass_sheet` (TOML), or by a column mass_kg [kg].

    RecordingError, one line: no mass, no air data, no steady window, or points that make no polar.
    """
    several = [logs] if isinstance(logs, str | Path) else list(logs)
    where = Path(aircraft) if aircraft else shipped(AIRCRAFT, "aircraft")
    wing = read_aircraft(where.read_text(), str(where)).wing
    if wing is None:
        raise UsageError(f"{where}: no [wing]; expected area_m2, span_m and accel_x_std_g")
    sheet = read_mass_sheet(Path(mass_sheet)) if isinstance(mass_sheet, str | Path) else mass_sheet
    flights = [read_flight(log) for log in several]
    rows = [flown(flight, wing, sheet, SteadyLimits(), marks) for flight in flights]
    fused = all(flight.fused for flight in flights)
    return DragPolar(polar_of(rows, wing.aspect_ratio, fused), wing.known)
