"""The budget as a picture: terms of every source as bars, largest first, beside the sigma of the fused thrust.

One window: a panel per engine, bars in newtons. Many test points: a row per point, a column per term; a bar's length is
what the term makes of its source's variance at this point, the number its sigma.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from thrustd.core.measures import SIGMAS_95
from thrustd.replay.budget import RANDOM, SYSTEMATIC, Budget
from thrustd.replay.picture import GREEN, ORANGE, SKY
from thrustd.sinks.whole_file import whole_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = {"mounts": GREEN, "brochure": ORANGE, "fused": SKY}
SHOWN_N = 0.05  # a smaller term is printed as 0.0
HATCH = "////"
ROW_IN = 0.27  # of a bar, with its name beside it
NUMBER: dict[str, Any] = {"va": "center", "ha": "right", "fontsize": 9}
LEGEND = (
    "Numbers: one sigma, N. Green: mounts, orange: brochure, blue: what is in the fused thrust besides.\n"
    "Bar: the term's part of its source's variance at this point; bold: the largest. Hatched: random, else systematic."
)
Term = tuple[str, str, str]  # source, term, kind
CELL_IN, NAMES_IN, TOP_IN = 0.5, 1.9, 2.6  # of many points: a term's column, the points' names, the terms' names


def save(path: Path, title: str, found: Sequence[Budget]) -> None:
    """PNG, one panel per engine."""
    with whole_file(path) as part:
        picture(title, found).savefig(part, dpi=110, format="png")


def picture(title: str, found: Sequence[Budget]) -> "Figure":
    from matplotlib.figure import Figure  # takes a second

    most = max(len(each.rows) for each in found) + len(COLOURS)
    figure = Figure(figsize=(8 * len(found), 1.5 + ROW_IN * most), layout="constrained")
    axes = figure.subplots(1, len(found), squeeze=False, sharex=True)[0]
    for axis, budget in zip(axes, found, strict=True):
        draw(axis, budget)
    figure.suptitle(title, x=0.01, ha="left", fontsize=12)
    return figure


def points_picture(title: str, points: Sequence[tuple[str, Sequence[Budget]]]) -> "Figure":
    """`points`: name and budgets by engine, as many and in the same order at every point."""
    from matplotlib.figure import Figure

    engines = len(points[0][1])
    terms = _terms([budget for _, each in points for budget in each])
    columns = len(terms) + len(COLOURS)
    panel_in = TOP_IN + ROW_IN * (len(points) + 1)
    figure = Figure(figsize=(NAMES_IN + CELL_IN * columns, 0.8 + engines * panel_in), layout="constrained")
    axes = figure.subplots(engines, 1, squeeze=False)[:, 0]
    for e, axis in enumerate(axes):
        draw_points(axis, [(name, each[e]) for name, each in points], terms)
    figure.suptitle(f"{title}\n{LEGEND}", x=0.01, ha="left", fontsize=11)
    return figure


def draw_points(axis: "Axes", points: Sequence[tuple[str, Budget]], terms: Sequence[Term]) -> None:
    """One engine. `terms`: source, term and kind by column; a source's sum stands behind its last one."""
    names: list[str] = []
    for source, colour in COLOURS.items():
        of_source = [term for term in terms if term[0] == source]
        for term in of_source:
            for row, (_, budget) in enumerate(points):
                _cell(axis, budget, term, (len(names), row), colour)
            names.append(term[1] if term[2] == SYSTEMATIC else f"{term[1]}, {term[2]}")
        for row, (_, budget) in enumerate(points):
            _sum(axis, budget.sums[source], (len(names), row), colour)
        names.append(_together(source))
    axis.set_xticks([0.5 + place for place in range(len(names))], names, rotation=60, ha="left", rotation_mode="anchor")
    axis.tick_params(top=True, labeltop=True, bottom=False, labelbottom=False, length=0, labelsize=9)
    rows = [f"{name}: {budget.thrust_n:.0f} +- {SIGMAS_95 * budget.fused_n:.0f} N" for name, budget in points]
    axis.set_yticks(range(len(rows)), rows, fontsize=9)
    axis.set(xlim=(0.0, len(names)), ylim=(len(rows) - 0.5, -0.5))
    axis.spines[:].set_visible(False)
    heading = f"{points[0][1].engine} engine\npoint: thrust +- 95 %"
    axis.annotate(heading, (0, 1), (-8, 14), "axes fraction", "offset points", ha="right", fontweight="bold")


def _cell(axis: "Axes", budget: Budget, term: Term, place: tuple[int, int], colour: str) -> None:
    source, name, kind = term
    rows, (x, y) = budget.of(source), place
    std_n = next((row.std_n for row in rows if (row.term, row.kind) == (name, kind)), 0.0)
    if std_n < SHOWN_N:
        return
    part = std_n**2 / max(budget.sums[source] ** 2, sum(row.std_n**2 for row in rows))
    hatch = HATCH if kind == RANDOM else None
    axis.barh(y, part, left=x, height=0.9, color=colour, alpha=0.6, hatch=hatch, edgecolor="white", linewidth=0)
    axis.text(x + 0.9, y, _said(std_n), **NUMBER, fontweight="bold" if std_n == rows[0].std_n else "normal")


def _sum(axis: "Axes", std_n: float, place: tuple[int, int], colour: str) -> None:
    x, y = place
    axis.barh(y, 0.96, left=x, height=0.9, color="none", edgecolor=colour, linewidth=1.5)
    axis.text(x + 0.9, y, _said(std_n), **NUMBER)


def _said(std_n: float) -> str:
    return f"{std_n:.0f}" if std_n >= 10.0 else f"{std_n:.1f}"


def _terms(found: Sequence[Budget]) -> list[Term]:
    """Source, term and kind of all that is anything somewhere; of a source the largest first."""
    most: dict[Term, float] = {}
    for row in (row for budget in found for row in budget.rows):
        key = row.source, row.term, row.kind
        most[key] = most.get(key, 0.0) + row.std_n**2
    shown = [key for key, n2 in most.items() if n2 >= SHOWN_N**2]
    return sorted(shown, key=lambda key: (list(COLOURS).index(key[0]), -most[key]))


def _together(source: str) -> str:
    return "fused, as the filter says" if source == "fused" else f"{source} together"


def draw(axis: "Axes", budget: Budget) -> None:
    """Terms in N; hatched: random, of one fused step; hollow: all of a source together."""
    sums = budget.sums
    names: list[str] = []
    for source, colour in COLOURS.items():
        for row in (row for row in budget.of(source) if row.std_n >= SHOWN_N):
            hatch = HATCH if row.kind == RANDOM else None
            axis.barh(len(names), row.std_n, color=colour, hatch=hatch, edgecolor="white")
            _number(axis, row.std_n, len(names))
            names.append(f"{row.term}, {row.kind}")
        axis.barh(len(names), sums[source], color="none", edgecolor=colour, linewidth=1.5)
        _number(axis, sums[source], len(names))
        names.append(_together(source))
    axis.set_yticks(range(len(names)), names, fontsize=9)
    axis.invert_yaxis()
    axis.set_xlim(0.0, 1.15 * max(*sums.values(), *(row.std_n for row in budget.rows)))
    axis.set_xlabel("one sigma of the engine's thrust, N")
    band_n = SIGMAS_95 * budget.fused_n
    axis.set_title(f"{budget.engine} engine, {budget.thrust_n:.0f} +- {band_n:.0f} N (95 %)", loc="left")


def _number(axis: "Axes", std_n: float, place: int) -> None:
    axis.annotate(f" {std_n:.1f}", (std_n, place), va="center", fontsize=9)
