"""Where a flight is steady: windows found by limits, or marked by the crew (a CSV, or a channel of the log)."""

import csv
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from math import isfinite
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError, UsageError
from thrustd.core.steady import Quantity, SteadyLimits, SteadyWatch, quantities
from thrustd.flighttest.flight import Flight
from thrustd.sources.plain_file import read_text

MARK = "mark"  # channel of the catalogue: number of the point while it is flown, 0 between points
MARK_COLUMNS = "start_s", "end_s"
SLIP_S = 4.0  # a channel that is above 0 for less marks nothing: a slip, or the edge of a filtered channel


class Window(NamedTuple):
    """start_s <= time < end_s of the recording."""

    start_s: float
    end_s: float
    name: str


def watched(flight: Flight, limits: SteadyLimits) -> dict[str, Quantity]:
    """What has to be steady, by the column it is in."""
    owners = {quantity: flight.engines[quantity.engine] for quantity in quantities(limits, len(flight.engines))}
    named = {f"{q.channel}_{owner}" if q.channel == "n1_pct" else q.channel: q for q, owner in owners.items()}
    missing = [name for name in named if name not in flight.record]
    if missing:
        raise RecordingError(f"{flight.name}: no column {missing[0]!r}; a steady window needs {', '.join(named)}")
    return named


def steady_windows(flight: Flight, limits: SteadyLimits) -> list[Window]:
    """The longest steady windows of a flight per second, none over another; at least one."""
    named = watched(flight, limits)
    watch = SteadyWatch([quantity.limit for quantity in named.values()])
    rows = np.column_stack([flight.record[name] for name in named])
    running = np.all([flight.record[f"n1_pct_{engine}"] >= limits.least_n1_pct for engine in flight.engines], axis=0)
    rows[~running] = np.nan
    lengths = [watch.take(row) for row in rows.tolist()]
    ends = [place for place, (n, following) in enumerate(pairwise([*lengths, 0])) if following <= n]
    taken = np.zeros(len(lengths), bool)
    found = []
    for end in sorted(ends, key=lambda place: -lengths[place]):
        first = end - lengths[end] + 1
        free = np.flatnonzero(taken[first : end + 1])
        first += int(free[-1]) + 1 if len(free) else 0
        if end - first + 1 >= limits.least_s:
            taken[first : end + 1] = True
            found.append((first, end))
    if not found:
        said = _longest(dict(zip(named, rows.T, strict=True)), named, limits)
        raise RecordingError(f"{flight.name}: no steady window, {said}; expected {_expected(limits)}")
    time_s = flight.record.time_s
    return [Window(float(time_s[a]), float(time_s[b]) + 1.0, str(i + 1)) for i, (a, b) in enumerate(sorted(found))]


def _longest(columns: Mapping[str, Floats], named: Mapping[str, Quantity], limits: SteadyLimits) -> str:
    """Which column is steady for the shortest time, looked at alone."""
    alone = {}
    for name, column in columns.items():
        watch = SteadyWatch([named[name].limit])
        alone[name] = max(watch.take([value]) for value in column.tolist())
    name = min(alone, key=alone.__getitem__)
    if alone[name] >= limits.least_s:
        return "though every channel alone is steady for long enough"
    return f"{name} is steady for {alone[name]} s at most"


def marked_windows(flight: Flight, column: str = MARK) -> list[Window]:
    """Wherever a channel of the log is above 0 without changing."""
    numbers = np.nan_to_num(np.rint(flight.record[column]))
    edges = [0, *(np.flatnonzero(np.diff(numbers)) + 1).tolist(), len(numbers)]
    time_s = [*flight.record.time_s.tolist(), float(flight.record.time_s[-1])]
    found = [(a, b) for a, b in pairwise(edges) if numbers[a] > 0 and time_s[b] - time_s[a] >= SLIP_S]
    if not found:
        raise RecordingError(f"{flight.name}: {column!r} marks no point: it is never above 0 for {SLIP_S:g} s")
    numbered = any(numbers[a] != 1 for a, _ in found)  # else a switch
    return [
        Window(time_s[a], time_s[b], f"{numbers[a]:g}" if numbered else str(i + 1)) for i, (a, b) in enumerate(found)
    ]


def windows_by(flight: Flight, marks: str) -> list[Window]:
    """marks: a CSV of windows, or a channel of the log."""
    return read_windows(Path(marks)) if marks.lower().endswith(".csv") else marked_windows(flight, marks)


def overlaps(windows: Iterable[Window]) -> list[str]:
    """Which neighbours share seconds, in words."""
    pairs = pairwise(sorted(windows))
    return [f"points {a.name} and {b.name} share {min(a.end_s, b.end_s) - b.start_s:.0f} s"
            for a, b in pairs if b.start_s < a.end_s]  # fmt: skip


def read_windows(path: Path) -> list[Window]:
    """A CSV with the columns start_s and end_s, and name if wanted; UsageError names the line that is wrong."""
    rows = csv.DictReader(read_text(path).splitlines(), skipinitialspace=True)
    lacking = [name for name in MARK_COLUMNS if name not in (rows.fieldnames or ())]
    if lacking:
        raise UsageError(f"{path}: no column {lacking[0]!r}; expected start_s, end_s and, if wanted, name")
    found = [_window(row, path, line) for line, row in enumerate(rows, 1)]
    if not found:
        raise UsageError(f"{path}: no row; expected one per test point")
    return found


def _window(row: dict[str, str], path: Path, line: int) -> Window:
    try:
        start_s, end_s = (float(row[name]) for name in MARK_COLUMNS)
    except (TypeError, ValueError):
        raise UsageError(f"{path}: data row {line}: expected seconds in start_s and end_s") from None
    if not (isfinite(start_s) and isfinite(end_s) and start_s < end_s):
        raise UsageError(f"{path}: data row {line}: {start_s:g} to {end_s:g} s; expected start_s < end_s")
    return Window(start_s, end_s, row.get("name") or str(line))


def spans(flight: Flight, window: Window, names: Sequence[str]) -> dict[str, float]:
    """Largest minus smallest of the seconds in a window, by column; NaN where none is known."""
    part = flight.record.window(window.start_s, window.end_s)
    known = {name: part[name][np.isfinite(part[name])] for name in names}
    return {name: float(np.ptp(column)) if len(column) else float("nan") for name, column in known.items()}


def _expected(limits: SteadyLimits) -> str:
    """What a window needs, in words, with the names that `--limit` takes."""
    steady = {name: value for name, value in msgspec.to_builtins(limits).items() if not name.startswith("least_")}
    return (
        f"{limits.least_s:g} s (least_s) with N1 above {limits.least_n1_pct:g} % (least_n1_pct) in which no one-second"
        f" mean is further from another than {', '.join(f'{name} {value:g}' for name, value in steady.items())}"
    )


def limits_said(limits: SteadyLimits) -> str:
    """By the names of `--limit`."""
    return ", ".join(f"{name} {value:g}" for name, value in msgspec.to_builtins(limits).items())
