"""Recordings whose file has no `time_s`: another column in seconds, or nothing but a sample rate.

Vectors of another length than the rest (a lone `Ts`, say) are left out with a word.
"""

import hashlib
from collections import Counter
from pathlib import Path
from typing import NamedTuple

import numpy as np

from thrustd.errors import RecordingError
from thrustd.records.files import READERS
from thrustd.records.recording import TIME, FloatArray, Recording, make_recording


class TimeAxis(NamedTuple):
    """column: of the file, in seconds; or rate_hz, when the rows are so many per second."""

    column: str = TIME
    rate_hz: float | None = None


def read_timed(path: Path, axis: TimeAxis) -> Recording:
    """As `read_recording`, with the time as `axis` says."""
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise RecordingError(f"{path.name}: type {path.suffix or '(none)'!r}; expected one of {', '.join(READERS)}")
    try:
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as problem:
        raise RecordingError(f"{path}: cannot be read: {problem.strerror}") from None
    loaded = reader(path)
    columns, notes = _of_one_length(loaded.columns)
    if axis.rate_hz is not None:
        count = len(next(iter(columns.values()), ()))
        columns[TIME] = np.arange(count) / axis.rate_hz
    elif axis.column in columns:
        columns[TIME] = columns.pop(axis.column)
    else:
        raise RecordingError(
            f"{path.name}: no column {axis.column!r}; it has {', '.join(columns)}; "
            "expected a column of seconds (--time COLUMN) or the sample rate (--rate HZ)"
        )
    return make_recording(path.name, columns, loaded.metadata, digest, (*loaded.notes, *notes))


def _of_one_length(columns: dict[str, FloatArray]) -> tuple[dict[str, FloatArray], list[str]]:
    lengths = Counter(len(column) for column in columns.values())
    usual = max(lengths, key=lambda length: (lengths[length], length), default=0)
    kept = {name: column for name, column in columns.items() if len(column) == usual and name}
    return kept, [f"{name}: {len(c)} values where others have {usual}, left out" for name, c in columns.items()
                  if len(c) != usual]  # fmt: skip
