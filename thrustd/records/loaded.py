"""What a file reader hands on, before `make_recording` checks it."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError
from thrustd.records.recording import signal_of

NUMBER_BYTES = 8
MOST_COLUMNS = 4096
MOST_EXPANSION = 100
ALWAYS_BYTES = 256_000_000


class Loaded(NamedTuple):
    columns: dict[str, Floats]
    metadata: dict[str, str]
    notes: tuple[str, ...] = ()


def vectors(arrays: Mapping[str, NDArray[Any]], name: str) -> Loaded:
    """Those of a file that are columns of numbers; of the others a word, RecordingError where it is a channel."""
    columns: dict[str, Floats] = {}
    notes: list[str] = []
    longest = max((array.size for array in arrays.values()), default=0)
    for key, array in arrays.items():
        if array.size == 1 < longest and not signal_of(key):
            notes.append(f"{key}: one value beside columns of {longest} left out")
        elif array.dtype.kind in "fiub" and array.ndim == 1:
            columns[key] = array.astype(np.float64, copy=False)
        elif signal_of(key):
            raise RecordingError(f"{name}: {key} has shape {array.shape} of {array.dtype}; expected 1-D numbers")
        else:
            what = "structure or cell" if array.dtype.kind == "O" else f"shape {array.shape} of {array.dtype}"
            notes.append(f"{key}: {what} left out")
    return Loaded(columns, {}, tuple(notes))


def read_metadata(text: str | bytes, name: str) -> dict[str, str]:
    """Texts by name, as the JSON that an archive keeps them in; RecordingError, from the file `name`."""
    try:
        return msgspec.json.decode(text, type=dict[str, str])
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as problem:
        raise RecordingError(f"{name}: its metadata are damaged: {problem}; expected texts by name as JSON") from None


def check_columns(count: int, name: str) -> None:
    """RecordingError when it is no table of channels."""
    if count > MOST_COLUMNS:
        raise RecordingError(f"{name}: {count} columns; expected one per channel, at most {MOST_COLUMNS}")


def most_expanded(packed_bytes: int) -> int:
    """What so many bytes of measured data may unpack to."""
    return max(MOST_EXPANSION * packed_bytes, ALWAYS_BYTES)


def check_expanded(packed_bytes: int, expanded_bytes: int, name: str) -> None:
    """RecordingError when a compressed file is to fill memory: measured data shrink to a tenth at best."""
    limit = most_expanded(packed_bytes)
    if expanded_bytes > limit:
        raise RecordingError(
            f"{name}: {packed_bytes} bytes that unpack to {expanded_bytes}; expected at most {limit} of measured data"
        )
