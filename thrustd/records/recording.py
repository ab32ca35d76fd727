"""One columnar recording: bench, rig or flight data under the canonical channel names (ICD section 3).

Whatever the file type, a `Recording` holds float64 columns on one strictly increasing time axis. Columns that are not
in the catalogue are kept: the diagnosis offers them as explanations. Engine channels of a flight carry the engine's
name as suffix (`n1_pct_left`), mount channels the mount's (`deformation_mm_left_upper`).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError
from thrustd.core.signals import CATALOGUE, Signal
from thrustd.records.grid import GAP_FACTOR, Grid

if TYPE_CHECKING:
    import pandas as pd
    from rich.table import Table


TIME = "time_s"
MOST_MISSING = 8  # channels that get a line each
HOURS_S = 7200.0  # from here on a length is told in hours
OVERLOAD = 1e30  # what acquisition systems write for no reading: 9.9e37, 1e308
MOST_CHANNELS = 40  # of a recording's table
MOST_LISTED = 12  # names in a complaint
MOST_VALUES = 500_000_000  # of a recording on a grid: 4 GB in memory
MOST_FLIGHT_S = 360_000.0  # 100 h: no flight is longer
SUFFIX_UNITS = {  # unit suffixes of columns outside the catalogue
    unit: unit for unit in (
        "N", "kN", "tonf", "kgf", "lbf", "V", "A", "mm", "cm", "um", "g", "Pa", "kPa", "MPa", "hPa", "mbar", "bar",
        "psi", "deg", "degC", "K", "m", "ft", "kt", "s", "ms", "us", "ns", "Hz", "rpm", "kg",
    )
} | {
    "pct": "%", "sec": "s", "m_s": "m/s", "cm_s": "cm/s", "mm_s": "mm/s", "kg_s": "kg/s", "deg_s": "deg/s",
    "m_s2": "m/s2",
}  # fmt: skip


@dataclass(frozen=True, slots=True, repr=False)
class Recording:
    """Columns of equal length; build it with `make_recording`, which checks them."""

    name: str
    time_s: Floats  # (n,), strictly increasing
    channels: dict[str, Floats]  # name -> (n,); NaN = missing
    metadata: dict[str, str] = field(default_factory=dict)
    sha256: str = ""  # of the source file, empty when made in memory
    notes: tuple[str, ...] = ()  # what reading it had to report: gaps, missing values, columns left out
    step_share: float = 1.0  # see `Grid`

    def __len__(self) -> int:
        return len(self.time_s)

    def __repr__(self) -> str:
        from thrustd.records.shown import as_text

        return as_text(lambda console: console.print(_table(self)))

    def _repr_html_(self) -> str:
        from thrustd.records.shown import as_html

        return as_html(lambda console: console.print(_table(self)))

    def to_pandas(self) -> "pd.DataFrame":
        """A column per channel (float64, unit in the name), the time as index."""
        from thrustd.records.shown import as_frame

        return as_frame({TIME: self.time_s, **self.channels}).set_index(TIME)

    def __contains__(self, channel: str) -> bool:
        return channel in self.channels

    def __getitem__(self, channel: str) -> Floats:
        """The column, or a RecordingError which says what there is."""
        if channel == TIME:
            return self.time_s
        if channel not in self.channels:
            raise RecordingError(no_column(self.name, channel, self.channels))
        return self.channels[channel]

    @property
    def sample_hz(self) -> float:
        """The reciprocal of the median step; 0 for a single sample."""
        return 1.0 / float(np.median(np.diff(self.time_s))) if len(self) > 1 else 0.0

    @property
    def duration_s(self) -> float:
        return float(self.time_s[-1] - self.time_s[0])

    @property
    def extent(self) -> str:
        """Rows, length and rate, as people read them: milliseconds taken for seconds show here."""
        hertz = f", {self.sample_hz:.4g} Hz" if len(self) > 1 else ""
        length = f"{self.duration_s:.1f} s" if self.duration_s < HOURS_S else f"{self.duration_s / 3600:.4g} h"
        return f"{self.name}: {len(self)} samples, {length}{hertz}"

    def segments(self, factor: float = GAP_FACTOR) -> list[slice]:
        """Stretches without a gap, a gap being a step longer than `factor` median steps."""
        steps_s = np.diff(self.time_s)
        if len(steps_s) == 0 or steps_s.max() <= factor * steps_s.min():  # the median lies between: no gap
            return [slice(0, len(self))]
        cuts = (np.flatnonzero(steps_s > factor * np.median(steps_s)) + 1).tolist()
        return [slice(a, b) for a, b in zip([0, *cuts], [*cuts, len(self)], strict=True)]

    def select(self, names: Iterable[str]) -> "Recording":
        """Only these columns, in this order."""
        return replace(self, channels={name: self[name] for name in names if name != TIME})

    def rows(self, part: slice) -> "Recording":
        """The rows of one slice, for example of one segment."""
        return replace(
            self, time_s=self.time_s[part], channels={name: column[part] for name, column in self.channels.items()}
        )

    def window(self, start_s: float, stop_s: float) -> "Recording":
        """Rows with start_s <= time_s < stop_s; an empty window is an error."""
        first, last = np.searchsorted(self.time_s, [start_s, stop_s])
        if first == last:
            raise RecordingError(
                f"{self.name}: no samples from {start_s:g} to {stop_s:g} s;"
                f" it covers {self.time_s[0]:g} to {self.time_s[-1]:g} s"
            )
        return self.rows(slice(int(first), int(last)))

    def with_channels(self, **columns: Floats) -> "Recording":
        """A copy with columns added or replaced."""
        columns = {TIME: self.time_s, **self.channels, **columns}
        made = make_recording(self.name, columns, self.metadata, self.sha256, self.notes)
        return replace(made, step_share=self.step_share)

    def at_most(self, longest_s: float) -> "Recording":
        """Itself; RecordingError where its time goes on for longer, as that of a clock that jumped does."""
        if self.duration_s > longest_s:
            after = int(np.argmax(np.diff(self.time_s)))
            raise RecordingError(
                f"{self.name}: {self.duration_s:g} s long, {np.diff(self.time_s)[after]:g} s of it behind data row "
                f"{after + 1}; expected at most {longest_s:g} s"
            )
        return self

    def resample(self, rate_hz: float, longest_s: float | None = None, begin_s: float | None = None) -> "Recording":
        """On a uniform grid from the first sample (or begin_s) on: means of the bins going down, lines going up.

        What was not measured stays missing: values that a column lacks, and whatever is inside a step of time longer
        than `longest_s` (None: `GAP_FACTOR` of the grid's step, or of all but the longest tenth of the recording's).
        """
        if not rate_hz > 0:
            raise RecordingError(f"{self.name}: resample rate is {rate_hz:g} Hz; expected > 0")
        begin_s = float(self.time_s[0]) if begin_s is None else begin_s
        rows = np.floor((float(self.time_s[-1]) - begin_s) * rate_hz * (1 + 1e-12)) + 1
        if not rows * (1 + len(self.channels)) <= MOST_VALUES:
            raise RecordingError(
                f"{self.name}: {self.duration_s:g} s at {rate_hz:g} Hz, that is {rows:.3g} rows; "
                f"expected 1 row and more, at most {MOST_VALUES:.0e} values in all"
            )
        count = int(rows)
        grid_s = begin_s + np.arange(count) / rate_hz
        take = Grid(self.time_s, grid_s, rate_hz, longest_s)
        channels = {name: take(column) for name, column in self.channels.items()}
        return replace(self, time_s=grid_s, channels=channels, step_share=self.step_share * take.step_share)


def no_column(record: str, wanted: str, there: Iterable[str]) -> str:
    """The complaint: what is not there, what is, and which of that is called nearly so."""
    names = sorted(there)
    lower = {name.lower(): name for name in names}
    if len(names) > MOST_LISTED:
        near = [lower[found] for found in get_close_matches(wanted.lower(), list(lower), 5, 0.0)]
        return f"{record}: no column {wanted!r}; nearest of its {len(names)}: {', '.join(near)} (thrustd info: all)"
    near = [lower[found] for found in get_close_matches(wanted.lower(), list(lower), 3)]
    meant = f"; did you mean {' or '.join(near)}?" if near else ""
    return f"{record}: no column {wanted!r}; it has {', '.join(names) or 'none'}{meant}"


def signal_of(name: str) -> Signal | None:
    """The catalogue's entry for a column, its engine or mount suffix aside; None for an unknown column."""
    if name in CATALOGUE:
        return CATALOGUE[name]
    known = [
        signal for signal in CATALOGUE.values() if signal.scope != "aircraft" and name.startswith(signal.name + "_")
    ]
    return known[0] if known else None


def unit_of(name: str) -> str:
    """The unit that a column's name carries; empty when it says none."""
    signal = signal_of(name)
    if signal:
        return signal.unit
    endings = ("_".join(name.split("_")[-parts:]) for parts in (2, 1))
    return next((SUFFIX_UNITS[ending] for ending in endings if ending in SUFFIX_UNITS), "")


def make_recording(
    name: str,
    columns: Mapping[str, npt.ArrayLike],
    metadata: Mapping[str, str] | None = None,
    sha256: str = "",
    notes: tuple[str, ...] = (),
) -> Recording:
    """Check the columns (one of them `time_s`) and freeze them. Values beyond `OVERLOAD` become NaN, with a note."""
    if TIME not in columns:
        has = ", ".join(sorted(columns))
        raise RecordingError(
            f"{name}: no column 'time_s' (seconds, rising; thrustd convert --time COLUMN renames one); it has {has}"
            + "".join(f"; {line}" for line in notes[:4])
        )
    time_s = np.ascontiguousarray(columns[TIME], dtype=np.float64)
    _check_time(name, time_s)
    given = {channel: values for channel, values in columns.items() if channel != TIME}
    channels = {channel: _checked(name, channel, values, len(time_s)) for channel, values in given.items()}
    found = [*notes, *_missing(channels)]
    record = Recording(name, time_s, channels, dict(metadata or {}), sha256)
    gaps = len(record.segments()) - 1
    if gaps:
        found.append(f"{gaps} gap{'s' if gaps > 1 else ''} in time_s longer than {GAP_FACTOR} steps")
    return replace(record, notes=tuple(dict.fromkeys(found)))


def _check_time(name: str, time_s: Floats) -> None:
    if time_s.size == 0:
        raise RecordingError(f"{name}: no samples; expected one or more")
    if time_s.ndim != 1:
        raise RecordingError(f"{name}: time_s has shape {time_s.shape}; expected one column")
    bad = np.flatnonzero(~np.isfinite(time_s))
    if len(bad):
        raise RecordingError(f"{name}: time_s is {time_s[bad[0]]} in data row {bad[0] + 1}; expected a number")
    low_s, high_s = CATALOGUE[TIME].low, CATALOGUE[TIME].high
    far = np.flatnonzero((time_s < low_s) | (time_s > high_s))
    if len(far):
        raise RecordingError(
            f"{name}: time_s = {time_s[far[0]]:g} in data row {far[0] + 1}; expected seconds, {low_s:g} to {high_s:g}"
        )
    back = np.flatnonzero(np.diff(time_s) <= 0)
    if len(back):
        row = int(back[0]) + 1
        raise RecordingError(
            f"{name}: time_s = {time_s[row]!s} in data row {row + 1} follows {time_s[row - 1]!s};"
            " expected strictly rising times"
        )


def _checked(name: str, channel: str, values: npt.ArrayLike, count: int) -> Floats:
    column = np.ascontiguousarray(values, dtype=np.float64)
    if column.shape != (count,):
        raise RecordingError(f"{name}: {channel} has shape {column.shape}; expected ({count},) as time_s")
    finite = np.abs(column) < OVERLOAD  # NaN and infinity are not, either
    return column if finite.all() else np.where(finite, column, np.nan)


def _missing(channels: Mapping[str, Floats]) -> list[str]:
    """A line per channel that misses values; of more than MOST_MISSING, one for all."""
    counts = {name: int(np.isnan(column).sum()) for name, column in channels.items()}
    lines = [f"{name}: {n} of {len(channels[name])} values missing" for name, n in counts.items() if n]
    if len(lines) <= MOST_MISSING:
        return lines
    worst = max(counts, key=lambda name: counts[name])
    return [f"{len(lines)} channels with values missing; most: {worst}, {counts[worst]} of {len(channels[worst])}"]


def _table(record: Recording) -> "Table":
    """A row per channel: unit, smallest, mean, largest, how much is missing."""
    from thrustd.records.shown import plain_table

    rows = [_channel(name, unit_of(name), column) for name, column in list(record.channels.items())[:MOST_CHANNELS]]
    more = len(record.channels) - len(rows)
    if more > 0:
        rows.append([f"... {more} more", "", "", "", "", ""])
    table = plain_table(("channel", "unit", "smallest", "mean", "largest", "missing"), rows)
    table.title = record.extent
    table.title_justify = "left"
    return table


def _channel(name: str, unit: str, column: Floats) -> list[str]:
    known = column[np.isfinite(column)]
    missing = f"{100 * (1 - len(known) / len(column)):.1f} %" if len(known) < len(column) else ""
    numbers = [f"{f(known):.5g}" for f in (np.min, np.mean, np.max)] if len(known) else ["-", "-", "-"]
    return [name, unit, *numbers, missing]
