"""A figure that a notebook shows, although no pyplot made it."""

from io import BytesIO

from matplotlib.figure import Figure


class Drawing(Figure):
    def _repr_png_(self) -> bytes:
        png = BytesIO()
        self.savefig(png, format="png", dpi=80)
        return png.getvalue()


def drawn(figure: Figure) -> Figure:
    """The same figure, shown as a picture where it is the last line of a cell."""
    figure.__class__ = Drawing
    return figure
