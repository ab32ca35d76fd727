"""What a prompt and a notebook show: rich's tables as text and as HTML, columns as a pandas frame."""

from collections.abc import Callable, Sequence
from io import StringIO
from typing import TYPE_CHECKING, Any

from rich import box
from rich.console import Console
from rich.table import Table

from thrustd.core.errors import UsageError
from thrustd.sinks.html_page import png_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

WIDTH = 110
PLAIN: dict[str, Any] = {"markup": False, "highlight": False}  # of a console: a column may be called Load [kN]
PAGE = '<pre style="font-family:ui-monospace,monospace;line-height:1.25">{code}</pre>'


class Shown:
    """A prompt shows it as `show` prints it, without colours, and a notebook as HTML."""

    __slots__ = ()

    def show(self, console: Console) -> None:
        raise NotImplementedError

    def __repr__(self) -> str:
        return as_text(self.show)

    def _repr_html_(self) -> str:
        return as_html(self.show)


def as_text(show: Callable[[Console], None]) -> str:
    """What a function prints, in a notebook too, whose kernel asks for colours."""
    page = StringIO()
    show(Console(file=page, width=WIDTH, force_jupyter=False, force_terminal=False, **PLAIN))
    return page.getvalue().rstrip()


def as_html(show: Callable[[Console], None]) -> str:
    console = Console(file=StringIO(), width=WIDTH, record=True, force_jupyter=False, **PLAIN)
    show(console)
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
        table.add_row(*row)
    return table
