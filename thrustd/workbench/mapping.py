"""Columns of anyone's files under the names of the catalogue, as a person said it in the page: remembered per folder.

    .thrustd/mappings.json        column -> what it is, in every file that has it; files that are read in their own way
    .thrustd/tables/<key>.json    the columns of a file as they are called there, with what they may be

The files themselves stay as they are.
"""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.errors import UsageError
from thrustd.records.loaded import Loaded
from thrustd.records.offer import offer
from thrustd.records.recording import TIME, signal_of
from thrustd.records.rename import Rename, spelled
from thrustd.records.time_axis import TimeAxis
from thrustd.records.units import CONVERSIONS, unit_said
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


class Said(msgspec.Struct, frozen=True):
    """What was said in this folder; `seen`: columns somebody was asked about, also those left as they are called."""

    columns: tuple[Column, ...] = ()
    rate_hz: float | None = None  # of files without a column of time
    own: dict[str, ColumnNames] = {}  # files that are read in their own way
    seen: frozenset[str] = frozenset()

    def of(self, name: str, there: Collection[str]) -> ColumnNames:
        """How a file with the columns `there` is read."""
        if name in self.own:
            return self.own[name]
        latest = {column.ours: column for column in self.columns if column.theirs in there}
        kept = set(there) - {column.theirs for column in latest.values()}
        columns = tuple(column for ours, column in latest.items() if ours not in kept)
        timed = TIME in kept or TIME in latest
        return ColumnNames(columns, None if timed else self.rate_hz)


def read_said(state: Path) -> Said:
    try:
        return msgspec.json.decode((state / "mappings.json").read_bytes(), type=Said)
    except (OSError, msgspec.DecodeError):
        return Said()


def keep_mapping(state: Path, name: str, mapping: ColumnNames, there: Collection[str], *, only: bool = False) -> None:
    """`mapping` for the columns `there` in every file of the folder that has them; `only`: in the file `name`."""
    said = read_said(state)
    own = {other: one for other, one in said.own.items() if other != name}
    if only:
        kept = msgspec.structs.replace(said, own=own | {name: mapping}, seen=said.seen.union(there))
    else:
        others = tuple(column for column in said.columns if column.theirs not in there)
        rate_hz = said.rate_hz if mapping.rate_hz is None else mapping.rate_hz
        kept = Said((*others, *mapping.columns), rate_hz, own, said.seen.union(there))
    write_whole(state / "mappings.json", msgspec.json.encode(kept))


def checked(body: bytes, there: Collection[str], elsewhere: Collection[str] = ()) -> ColumnNames:
    """A mapping as the page sends it, of the file's columns and of `elsewhere`; UsageError when it cannot be one."""
    try:
        mapping = msgspec.json.decode(body, type=ColumnNames)
    except (msgspec.DecodeError, RecursionError) as problem:
        raise UsageError(f"columns: {problem}") from None
    ours = [column.ours for column in mapping.columns if column.theirs in there]
    twice = next((name for name in ours if ours.count(name) > 1), "")
    if twice:
        raise UsageError(f"columns: two columns are {twice}; expected one")
    kept = set(there) - {column.theirs for column in mapping.columns}
    for column in mapping.columns:
        if column.theirs not in {*there, *elsewhere}:
            raise UsageError(f"columns: no column {column.theirs!r} in this file")
        if column.theirs in there and column.ours in kept:
            raise UsageError(f"columns: the file has a column {column.ours} already; expected another name")
        if not (np.isfinite(column.factor) and column.factor and np.isfinite(column.offset)):
            raise UsageError(f"columns: {column.theirs}: factor {column.factor:g}; expected a number other than 0")
    if mapping.rate_hz is not None and not 0 < mapping.rate_hz <= 1e9:
        raise UsageError(f"columns: {mapping.rate_hz:g} samples per second; expected above 0")
    return mapping


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


def read_table(path: Path) -> dict[str, Any]:
    """A table as it was kept, its columns by name."""
    table: dict[str, Any] = msgspec.json.decode(path.read_bytes())
    return table | {"columns": {column["name"]: column for column in table["columns"]}}


def with_others(name: str, table: dict[str, Any], others: Mapping[str, dict[str, Any]], said: Said) -> dict[str, Any]:
    """A table for the page: its columns, then those that only other files of the folder have, and what was said."""
    columns, offered = dict(table["columns"]), dict(table["offered"])
    for file, other in others.items():
        for column in other["columns"].keys() - columns.keys():
            columns[column] = other["columns"][column] | {"file": file}
            offered |= {column: other["offered"][column]} if column in other["offered"] else {}
    offered = {theirs: one for theirs, one in offered.items() if theirs not in said.seen}
    return table | {
        "columns": list(columns.values()),
        "offered": offered,
        "said": said.columns,
        "only": name in said.own,
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
