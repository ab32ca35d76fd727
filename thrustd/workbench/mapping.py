"""Columns of anyone's files under the names of the catalogue, as a person said it in the page: remembered per folder.

    .thrustd/mappings.json        file -> its columns; the file itself stays as it is
    .thrustd/tables/<key>.json    the columns of a file as they are called there, with what they may be

A file whose columns are called as those of an earlier one is read as that one was.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.errors import UsageError
from thrustd.records.loaded import Loaded
from thrustd.records.offer import CONVERSIONS, offer, spelled, unit_said
from thrustd.records.recording import TIME, signal_of
from thrustd.records.rename import Rename
from thrustd.records.time_axis import TimeAxis
from thrustd.sinks.whole_file import write_whole

PREVIEW = 400  # values of a column in its table
MOST = 60  # columns in a table
ROLES = ("force_N", "deformation_mm")


class Column(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """ours = theirs * factor + offset."""

    theirs: Annotated[str, msgspec.Meta(min_length=1, max_length=200)]
    ours: Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z]\w{0,80}$")]
    factor: float = 1.0
    offset: float = 0.0

    @property
    def spelled(self) -> str:
        return spelled(self.theirs, self.ours, self.factor, self.offset)


class ColumnNames(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Columns that change their names, and the sample rate of a file without time."""

    columns: tuple[Column, ...] = ()
    rate_hz: float | None = None

    @property
    def renames(self) -> list[Rename]:
        return [Rename(c.theirs, c.ours, c.factor, c.offset) for c in self.columns]

    @property
    def axis(self) -> TimeAxis:
        return TimeAxis(TIME, self.rate_hz)


def read_mappings(state: Path) -> dict[str, ColumnNames]:
    """By file name, the latest last."""
    try:
        return msgspec.json.decode((state / "mappings.json").read_bytes(), type=dict[str, ColumnNames])
    except (OSError, msgspec.DecodeError):
        return {}


def keep_mapping(state: Path, name: str, mapping: ColumnNames) -> None:
    """The file's own from now on; one without columns and rate is none."""
    kept = {other: one for other, one in read_mappings(state).items() if other != name}
    if mapping.columns or mapping.rate_hz is not None:
        kept[name] = mapping
    write_whole(state / "mappings.json", msgspec.json.encode(kept))


def checked(body: bytes, there: Iterable[str]) -> ColumnNames:
    """A mapping as the page sends it; UsageError when it cannot be one."""
    try:
        mapping = msgspec.json.decode(body, type=ColumnNames)
    except (msgspec.DecodeError, RecursionError) as problem:
        raise UsageError(f"columns: {problem}") from None
    ours = [column.ours for column in mapping.columns]
    twice = next((name for name in ours if ours.count(name) > 1), "")
    if twice:
        raise UsageError(f"columns: two columns are {twice}; expected one")
    changed = {column.theirs for column in mapping.columns}
    names = set(there)
    for column in mapping.columns:
        if column.theirs not in names:
            raise UsageError(f"columns: no column {column.theirs!r} in this file")
        if column.ours in names - changed:
            raise UsageError(f"columns: the file has a column {column.ours} already; expected another name")
        if not (np.isfinite(column.factor) and column.factor and np.isfinite(column.offset)):
            raise UsageError(f"columns: {column.theirs}: factor {column.factor:g}; expected a number other than 0")
    if mapping.rate_hz is not None and not 0 < mapping.rate_hz <= 1e9:
        raise UsageError(f"columns: {mapping.rate_hz:g} samples per second; expected above 0")
    return mapping


def remembered(state: Path, names: Iterable[str]) -> ColumnNames | None:
    """What the latest file with these columns was read as."""
    there = set(names)
    for mapping in reversed(read_mappings(state).values()):
        if {column.theirs for column in mapping.columns} <= there and (mapping.columns or TIME not in there):
            return mapping
    return None


def table_wanted(name: str) -> bool:
    """A flight log has the channels of its own layout."""
    return not name.lower().endswith(".mcap")


def table_of(loaded: Loaded) -> dict[str, Any]:
    """The columns as the file calls them, thinned to draw, and what they may be."""
    columns = dict(list(loaded.columns.items())[:MOST])
    usual = max(map(len, columns.values()))
    same = {name: column for name, column in columns.items() if len(column) == usual}
    offered = offer(same)
    return {
        "rows": usual,
        "columns": [_column(name, column) for name, column in same.items()],
        "offered": {name: one._asdict() for name, one in offered.items()},
        "timed": TIME in columns,
        "wanting": [one.ours for one in offered.values() if one.ours in ROLES],
        "conversions": CONVERSIONS,
    }


def _column(name: str, column: Floats) -> dict[str, Any]:
    known = column[np.isfinite(column)]
    return {
        "name": name,
        "unit": unit_said(name),
        "known": name == TIME or signal_of(name) is not None,
        "low": float(known.min()) if known.size else None,
        "high": float(known.max()) if known.size else None,
        "missing": int(len(column) - known.size),
        "preview": [float(f"{v:.6g}") if np.isfinite(v) else None for v in column[:: max(1, len(column) // PREVIEW)]],
    }
