"""Recordings whose file has no `time_s`: another column in seconds, or nothing but a sample rate.

Vectors of another length than the rest (a lone `Ts`, where segments begin) are left out with a word: archives hold more
than one table. One that is called as a channel is refused.
"""

import shlex
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError
from thrustd.records.clock import at_rate
from thrustd.records.files import SHOWN_NOTES, file_sha256, load
from thrustd.records.loaded import Loaded
from thrustd.records.offer import offered_renames
from thrustd.records.recording import TIME, Recording, make_recording, no_column, signal_of
from thrustd.records.rename import Rename, check_unit, renamed, units_said


class TimeAxis(NamedTuple):
    """column: of the file, in seconds; or rate_hz, when the rows are so many per second."""

    column: str = TIME
    rate_hz: float | None = None


def read_timed(path: Path, axis: TimeAxis, renames: Sequence[Rename] = (), salvage: bool = False) -> Recording:
    """As `read_recording`, with the time as `axis` says; `renames` come first."""
    return timed(path.name, load(path, salvage), axis, renames, file_sha256(path))


def timed(name: str, loaded: Loaded, axis: TimeAxis, renames: Sequence[Rename] = (), sha256: str = "") -> Recording:
    """What was read of a file, as a recording."""
    named, remarks = renamed(name, loaded.columns, renames)
    columns, notes = _of_one_length(name, named)
    if axis.rate_hz is not None:
        rows = len(next(iter(columns.values()), ()))
        columns[TIME], words = at_rate(name, columns.get(TIME), rows, axis.rate_hz)
        notes += words
    elif axis.column in columns:
        check_unit(axis.column, TIME)
        notes += [f"time_s replaced by {axis.column}, as asked for"] if TIME in columns and axis.column != TIME else []
        columns[TIME] = columns.pop(axis.column)
    else:
        others = "".join(f"; {line}" for line in loaded.notes[:SHOWN_NOTES])
        found = " ".join(f"--rename {shlex.quote(each)}" for each in offered_renames(columns))
        raise RecordingError(
            f"{no_column(name, axis.column, columns)}{others}; expected {found}{', or ' if found else ''}"
            "a column of seconds (--time COLUMN) or the sample rate (--rate HZ; for `thrustd convert` --sampled HZ)"
        )
    return make_recording(
        name, columns, loaded.metadata | units_said(renames), sha256, (*loaded.notes, *remarks, *notes)
    )


def _of_one_length(name: str, columns: dict[str, Floats]) -> tuple[dict[str, Floats], list[str]]:
    """The columns of the usual length, and a word on the others; RecordingError where one of those is a channel."""
    lengths = Counter(len(column) for column in columns.values())
    usual = max(lengths, key=lambda length: (lengths[length], length), default=0)
    others = {key: len(column) for key, column in columns.items() if len(column) != usual}
    if short := [key for key in others if key == TIME or signal_of(key)]:
        raise RecordingError(
            f"{name}: {short[0]} has {others[short[0]]} values, other columns {usual}; expected as many"
        )
    kept = {key: column for key, column in columns.items() if len(column) == usual and key}
    return kept, [f"{key}: {count} values where others have {usual}, left out" for key, count in others.items()]
