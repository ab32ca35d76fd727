"""What a file reader hands on, before `make_recording` checks it."""

from typing import NamedTuple

from thrustd.records.recording import FloatArray


class Loaded(NamedTuple):
    columns: dict[str, FloatArray]
    metadata: dict[str, str]
    notes: tuple[str, ...] = ()
