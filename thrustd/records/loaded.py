"""What a file reader hands on, before `make_recording` checks it."""

from typing import NamedTuple

import msgspec

from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError

NUMBER_BYTES = 8
MOST_COLUMNS = 4096
MOST_EXPANSION = 100
ALWAYS_BYTES = 256_000_000


class Loaded(NamedTuple):
    columns: dict[str, Floats]
    metadata: dict[str, str]
    notes: tuple[str, ...] = ()


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


def check_expanded(packed_bytes: int, expanded_bytes: int, name: str) -> None:
    """RecordingError when a compressed file is to fill memory: measured data shrink to a tenth at best."""
    limit = max(MOST_EXPANSION * packed_bytes, ALWAYS_BYTES)
    if expanded_bytes > limit:
        raise RecordingError(
            f"{name}: {packed_bytes} bytes that unpack to {expanded_bytes}; expected at most {limit} of measured data"
        )
