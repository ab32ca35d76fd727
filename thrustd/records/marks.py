"""Marked stretches of a recording: `<recording>.marks.json` beside it, read by the page and the command line alike.

An excluded stretch keeps its inputs (the mount goes on moving) but loses its reference force, so that it carries no
weight in any comparison, diagnosis or fit.
"""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np

from thrustd.core.errors import RecordingError
from thrustd.records.recording import Recording
from thrustd.sinks.whole_file import write_whole
from thrustd.sources.plain_file import TEXT_BYTES, read_plain

REFERENCE = "force_N"
SUFFIX = ".marks.json"


class Mark(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """start_s <= time_s <= stop_s."""

    start_s: float
    stop_s: float
    label: Annotated[str, msgspec.Meta(max_length=200)] = ""
    exclude: bool = False


def marks_path(recording: Path) -> Path:
    return recording.with_name(recording.name + SUFFIX)


def read_marks(recording: Path) -> tuple[Mark, ...]:
    """Marks of a recording; none when there is no file, RecordingError when it cannot be understood."""
    path = marks_path(recording)
    if not path.exists():
        return ()
    try:
        return msgspec.json.decode(read_plain(path, TEXT_BYTES, RecordingError), type=tuple[Mark, ...])
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as problem:
        raise RecordingError(f"{path.name}: not a list of marked stretches: {problem}") from None


def write_marks(recording: Path, marks: tuple[Mark, ...]) -> None:
    """Whole or not at all; no marks, no file."""
    for mark in marks:
        if not mark.start_s < mark.stop_s:
            raise RecordingError(
                f"{recording.name}: mark from {mark.start_s} to {mark.stop_s} s; expected start < stop"
            )
    path = marks_path(recording)
    if not marks:
        path.unlink(missing_ok=True)
        return
    write_whole(path, msgspec.json.format(msgspec.json.encode(marks)), RecordingError)


def without_excluded(record: Recording, marks: tuple[Mark, ...]) -> Recording:
    """The recording with its reference taken away where a mark excludes it."""
    excluded = [mark for mark in marks if mark.exclude]
    if not excluded or REFERENCE not in record:
        return record
    force_n = record[REFERENCE].copy()
    for mark in excluded:
        force_n[(record.time_s >= mark.start_s) & (record.time_s <= mark.stop_s)] = np.nan
    if not np.isfinite(force_n).any():
        raise RecordingError(f"{record.name}: every sample with {REFERENCE} is marked as excluded")
    return replace(record, channels={**record.channels, REFERENCE: force_n})
