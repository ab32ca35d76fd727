"""A report in one HTML file: head, tables, pictures, nothing that is fetched from elsewhere."""

import base64
import html
from collections.abc import Iterable
from io import BytesIO
from typing import TYPE_CHECKING

from thrustd import __version__

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STYLE = """body{font:14px/1.5 system-ui,sans-serif;max-width:1000px;margin:32px auto;padding:0 20px;color:#16202b}
table{border-collapse:collapse;margin:8px 0 20px}td,th{border-bottom:1px solid #d5dae1;padding:4px 14px 4px 0;
text-align:left}td.n,th.n{text-align:right}img{max-width:100%;margin:6px 0}h1{font-size:22px}h2{font-size:17px;
margin-top:28px}.faint{color:#667383}.bad{color:#b3261e}pre{white-space:pre-wrap;overflow-wrap:anywhere}
@media(max-width:700px){table{display:block;overflow-x:auto}}"""


def head(title: str, words: str) -> str:
    """Everything up to the first section; `words` say what the numbers are."""
    shown = html.escape(title)
    return (
        '<!doctype html><html lang="en"><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width,initial-scale=1">'
        f"<title>{shown}</title><style>{STYLE}</style>"
        f'<h1>{shown}</h1><p class="faint">thrustd {__version__}. {html.escape(words)}</p>'
    )


def section(title: str, *parts: str) -> str:
    return f"<h2>{html.escape(title)}</h2>{''.join(parts)}"


def sentences(lines: Iterable[str]) -> str:
    return "".join(f"<p>{html.escape(line)}</p>" for line in lines)


def table(heads: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """First column text, the others numbers."""
    top = "".join(f"<th{' class=n' if i else ''}>{html.escape(h)}</th>" for i, h in enumerate(heads))
    body = "".join(
        "<tr>"
        + "".join(f"<td{' class=n' if i else ''}>{html.escape(str(c))}</td>" for i, c in enumerate(row))
        + "</tr>"
        for row in rows
    )
    return f"<table><tr>{top}</tr>{body}</table>"


def picture(png: bytes, name: str) -> str:
    content = base64.b64encode(png).decode()
    return f'<img alt="{html.escape(name)}" src="data:image/png;base64,{content}">'


def drawing(figure: "Figure", name: str) -> str:
    """A matplotlib figure as a picture."""
    return picture(png_of(figure, 110), name)


def png_of(figure: "Figure", dpi: float) -> bytes:
    png = BytesIO()
    figure.savefig(png, dpi=dpi, format="png")
    return png.getvalue()
