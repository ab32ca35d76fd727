"""What a use of thrust found, as every front shows it: tables, sentences, one figure, a page, a frame."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from thrustd.records.shown import Shown, as_frame, drawn, plain_table
from thrustd.sinks.html_page import drawing, head, section, sentences, table
from thrustd.sinks.whole_file import write_whole

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure
    from rich.console import Console

COLOURS = "#0072b2", "#e69f00", "#007a59", "#555555"  # of engines, then of others; Okabe & Ito
CHANGED = "#d55e00"  # of the same: what is not as it should be


class Columns(NamedTuple):
    """One table: what it is of, what stands above its columns, its rows."""

    title: str
    heads: Sequence[str]
    rows: list[list[str]]


def said(value: float, form: str) -> str:
    """A number in a table."""
    return f"{value:{form}}" if isfinite(value) else "-"


@dataclass(frozen=True, repr=False)
class Answer(Shown):
    """What was found (`found`: all its numbers), as tables, sentences and one figure.

    `title`, `words`: of the page, what the numbers are. `rows`: a row per point, event or series.
    """

    found: Any
    title: str
    words: str
    tables: Sequence[Columns]
    lines: Sequence[str]
    draw: "Callable[[], Figure]"
    more: "Mapping[str, Callable[[], Figure]]" = field(default_factory=dict)  # further pictures by title

    def to_pandas(self) -> "pd.DataFrame":
        """A row per point, event or series; `NAME_u95` is the 95 % uncertainty of the mean `NAME`."""
        return as_frame(self.found.rows())

    def plot(self) -> "Figure":
        """The figure, shown as a picture where it is the last line of a cell of a notebook."""
        return drawn(self.draw())

    def show(self, console: "Console") -> None:
        for each in self.tables:
            console.print(plain_table(each.heads, each.rows))
        console.print(self.words)
        for line in self.lines:
            console.print(line)

    def write_page(self, path: Path) -> None:
        """HTML with tables, sentences and picture, whole or not at all."""
        parts = [head(self.title, self.words), *(section(each.title, table(*each[1:])) for each in self.tables)]
        parts += [sentences(self.lines), section("Picture", drawing(self.draw(), self.title))]
        parts += [section(title, drawing(draw(), title)) for title, draw in self.more.items()]
        write_whole(path, "".join(parts))
