"""What a prompt and a notebook show: rich's tables as text and as HTML, columns as a pandas frame."""

from collections.abc import Callable
from io import StringIO
from typing import TYPE_CHECKING, Any

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from thrustd.core.errors import UsageError

if TYPE_CHECKING:
    import pandas as pd

    from thrustd.records.recording import Recording

WIDTH = 110
MOST_CHANNELS = 40  # of a recording's table
PAGE = '<pre style="font-family:ui-monospace,monospace;line-height:1.25">{code}</pre>'
Shown = Table | Callable[[Console], None]


def as_text(what: Shown) -> str:
    """A table, or what a function prints, without colours, in a notebook too (whose kernel asks for them)."""
    page = StringIO()
    _show(what, Console(file=page, width=WIDTH, force_jupyter=False, force_terminal=False))
    return page.getvalue().rstrip()


def as_html(what: Shown) -> str:
    console = Console(file=StringIO(), width=WIDTH, record=True, force_jupyter=False)
    _show(what, console)
    return console.export_html(inline_styles=True, code_format=PAGE)


def as_frame(data: Any) -> "pd.DataFrame":
    """Rows or columns as a frame; UsageError that says what to install where pandas is not there."""
    try:
        import pandas as pd
    except ModuleNotFoundError:
        raise UsageError("to_pandas: pandas is not installed, expected: pip install 'thrustd[notebook]'") from None
    return pd.DataFrame(data)


def plain_table(heads: "list[str] | tuple[str, ...]", rows: Any) -> Table:
    """First column to the left, the others to the right."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    for number, heading in enumerate(heads):
        table.add_column(heading, justify="left" if number == 0 else "right")
    for row in rows:
        table.add_row(*row)
    return table


def recording_table(record: "Recording") -> Table:
    """A row per channel: unit, smallest, mean, largest, how much is missing."""
    from thrustd.records.recording import unit_of

    rows = [_channel(name, unit_of(name), column) for name, column in list(record.channels.items())[:MOST_CHANNELS]]
    more = len(record.channels) - len(rows)
    if more > 0:
        rows.append([f"... {more} more", "", "", "", "", ""])
    table = plain_table(("channel", "unit", "smallest", "mean", "largest", "missing"), rows)
    hertz = f", {record.sample_hz:g} Hz" if len(record) > 1 else ""
    table.title = f"{record.name}: {len(record)} samples, {record.duration_s:.1f} s{hertz}"
    table.title_justify = "left"
    return table


def _channel(name: str, unit: str, column: Any) -> list[str]:
    known = column[np.isfinite(column)]
    missing = f"{100 * (1 - len(known) / len(column)):.1f} %" if len(known) < len(column) else ""
    numbers = [f"{f(known):.5g}" for f in (np.min, np.mean, np.max)] if len(known) else ["-", "-", "-"]
    return [name, unit, *numbers, missing]


def _show(what: Shown, console: Console) -> None:
    if isinstance(what, Table):
        console.print(what)
    else:
        what(console)
