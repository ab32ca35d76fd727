"""The budget as a picture: terms of every source as bars, largest first, beside the sigma of the fused thrust."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from thrustd.replay.budget import RANDOM, Budget
from thrustd.core.measures import SIGMAS_95
from thrustd.replay.picture import GREEN, ORANGE, SKY
from thrustd.sinks.whole_file import whole_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = {"mounts": GREEN, "brochure": ORANGE, "fused": SKY}
SHOWN_N = 0.05  # a smaller term is printed as 0.0
HATCH = "////"
ROW_IN = 0.27  # of a bar, with its name beside it


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


def draw(axis: "Axes", budget: Budget) -> None:
    """Terms in N; hatched: random, of one fused step; hollow: all of a source together."""
    sums = {"mounts": budget.mounts_n, "brochure": budget.brochure_n, "fused": budget.fused_n}
    names: list[str] = []
    for source, colour in COLOURS.items():
        rows = [row for row in budget.rows if row.source == source and row.std_n >= SHOWN_N]
        for row in sorted(rows, key=lambda row: -row.std_n):
            hatch = HATCH if row.kind == RANDOM else None
            axis.barh(len(names), row.std_n, color=colour, hatch=hatch, edgecolor="white")
            _number(axis, row.std_n, len(names))
            names.append(f"{row.term}, {row.kind}")
        axis.barh(len(names), sums[source], color="none", edgecolor=colour, linewidth=1.5)
        _number(axis, sums[source], len(names))
        names.append("fused, as the filter says" if source == "fused" else f"{source} together")
    axis.set_yticks(range(len(names)), names, fontsize=9)
    axis.invert_yaxis()
    axis.set_xlim(0.0, 1.15 * max(*sums.values(), *(row.std_n for row in budget.rows)))
    axis.set_xlabel("one sigma of the engine's thrust, N")
    band_n = SIGMAS_95 * budget.fused_n
    axis.set_title(f"{budget.engine} engine, {budget.thrust_n:.0f} +- {band_n:.0f} N (95 %)", loc="left")


def _number(axis: "Axes", std_n: float, place: int) -> None:
    axis.annotate(f" {std_n:.1f}", (std_n, place), va="center", fontsize=9)
