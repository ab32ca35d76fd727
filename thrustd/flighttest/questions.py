"""The questions of a flight test as the command line, Python and the workbench ask them: files in, an `Answer` out."""

from collections.abc import Sequence
from pathlib import Path

from thrustd.core.steady import SteadyLimits
from thrustd.core.types import Progress
from thrustd.flighttest import fleet_report, performance_report, points_report, transients_report
from thrustd.flighttest.answer import Answer
from thrustd.flighttest.fleet_health import fleet_health
from thrustd.flighttest.flight import read_flight
from thrustd.flighttest.health import HealthJob
from thrustd.flighttest.mass_sheet import MassSheet
from thrustd.flighttest.performance import performance_of
from thrustd.flighttest.points import find_points
from thrustd.flighttest.transients import find_transients
from thrustd.flighttest.windows import MARK
from thrustd.installation.shipped import aircraft_data, read_deck
from thrustd.records.once import check_once
from thrustd.records.rows import Row


def points(
    log: Path, limits: SteadyLimits | None = None, marks: str | None = None, auto: bool = False,
    deck: Path | None = None, aircraft: Path | None = None,
) -> Answer:  # fmt: skip
    """marks: a CSV of windows or a channel; None: the log's own marks where it has such, unless `auto`; else limits."""
    fuel_std = aircraft_data(aircraft).fuel.mass
    flight = read_flight(log, deck, aircraft)
    if marks is None and not auto and MARK in flight.record:
        marks = MARK
    return points_report.answer(flight, find_points(flight, limits, None, marks, fuel_std))


def performance(
    logs: Sequence[Path], sheets: Sequence[MassSheet] = (), limits: SteadyLimits | None = None,
    marks: str | None = None, deck: Path | None = None, aircraft: Path | None = None,
    advance: Progress = lambda share, what: None,
) -> Answer:  # fmt: skip
    """A mass sheet per log, or one for all, or none: a column mass_kg."""
    found = performance_of(logs, aircraft, sheets, limits or SteadyLimits(), marks, deck, advance)
    return performance_report.answer(found)


def transients(log: Path, deck: Path | None = None, aircraft: Path | None = None) -> Answer:
    flight = read_flight(log, deck, aircraft)
    return transients_report.answer(flight, find_transients(flight, read_deck(deck)))


def health(logs: Sequence[Path], deck: Path | None = None, advance: Progress = lambda share, what: None) -> Answer:
    """UsageError when two logs are the same flight."""
    job, rows, seen = HealthJob(str(deck or "")), list[Row](), dict[str, str]()
    for number, log in enumerate(logs):
        advance(number / len(logs), log.name)
        found = job(str(log))
        check_once(seen, log.name, found[0]["sha256"])
        rows += [{"file": str(log)} | row for row in found]
    return health_of(rows)


def health_of(rows: Sequence[Row]) -> Answer:
    """Of rows of `HealthJob`, each with its `file`."""
    return fleet_report.answer(fleet_health(rows))
