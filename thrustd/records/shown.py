"""What a prompt and a notebook show: rich's tables as text and as HTML, columns as a pandas frame."""

from collections.abc import Callable, Sequence
from io import StringIO
from typing import TYPE_CHECKING, Any

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from thrustd.core.errors import UsageError
from thrustd.sinks.html_page import png_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

WIDTH = 110
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
        raise UsageError("to_pandas: pandas is not installed; expected: pip install pandas") from None
    return pd.DataFrame(data)


def drawn(figure: "Figure") -> "Figure":
    """The same figure, shown as a picture where it ends a notebook's cell, although no pyplot made it."""
    vars(figure)["_repr_png_"] = lambda: png_of(figure, 80)
    return figure


def plain_table(heads: Sequence[str], rows: Any) -> Table:
    """First column to the left, the others to the right."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    for number, heading in enumerate(heads):
        table.add_column(heading, justify="left" if number == 0 else "right")
    for row in rows:
        table.add_row(*map(escape, row))  # a column may be called Load [kN]
    return table


def _show(what: Shown, console: Console) -> None:
    if isinstance(what, Table):
        console.print(what)
    else:
        what(console)
