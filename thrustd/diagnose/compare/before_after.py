"""Several models on one recording, in one scale: what the error was and what it has become (matplotlib, PNG)."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from thrustd.diagnose.compare.comparison import Comparison
from thrustd.diagnose.compare.newtons import newtons
from thrustd.diagnose.compare.picture_data import LOOP_DOTS
from thrustd.diagnose.compare.pictures import COLOURS, envelope, in_unit, save, slug

MOST_MODELS = 4  # side by side
REGIONS = 12  # that hold most of the first model's squared error
SHARE = 0.998  # of the errors are inside the scale


def before_after_pictures(comparisons: Sequence[Comparison], folder: Path) -> list[Path]:
    """One picture for every recording that more than one model was compared with, as `<recording>-models.png`."""
    paths = []
    for recording in dict.fromkeys(c.recording for c in comparisons):
        found = [c for c in comparisons if c.recording == recording][:MOST_MODELS]
        if len(found) > 1:
            folder.mkdir(parents=True, exist_ok=True)
            paths.append(folder / f"{slug(recording)}-models.png")
            save(before_after_figure(found), paths[-1])
    return paths


def before_after_figure(found: Sequence[Comparison]) -> Figure:
    """Models side by side on one recording: residuals over time, over the deformation, by region."""
    figure = Figure(figsize=(max(10, 3.6 * len(found)), 10), layout="constrained")
    grid = figure.add_gridspec(3, len(found), height_ratios=(3, 4, 4))
    limit = max(float(np.nanquantile(np.abs(c.residual_n), SHARE)) for c in found) or 1.0
    _history(figure.add_subplot(grid[0, :]), found, limit)
    for i, c in enumerate(found):
        _loop(figure.add_subplot(grid[1, i]), c, limit, i)
    _regions(figure.add_subplot(grid[2, :]), found)
    return figure


def _history(axis: Axes, found: Sequence[Comparison], limit: float) -> None:
    for c, colour in zip(found, COLOURS, strict=False):
        label = f"{c.model}: RMSE {newtons(c.rmse_n, unit=c.roles.output_unit)}"
        axis.plot(*envelope(c.time_s, c.residual_n), color=colour, lw=0.6, alpha=0.8, label=label)
    axis.axhline(0.0, color="black", lw=0.5)
    axis.set(xlabel="time [s]", ylabel=in_unit("measured - model", found[0].roles.output_unit), ylim=(-limit, limit))
    axis.set_title(found[0].recording, fontsize=10)
    axis.legend(fontsize=8, loc="upper right", ncols=len(found))


def _loop(axis: Axes, c: Comparison, limit: float, number: int) -> None:
    step = max(1, len(c.time_s) // LOOP_DOTS)
    x = c.channels["deformation_mm"][::step]
    axis.plot(x, c.residual_n[::step], ".", ms=0.7, color=COLOURS[number % len(COLOURS)], rasterized=True)
    axis.axhline(0.0, color="black", lw=0.5)
    axis.set_ylim(-limit, limit)
    axis.set_title(c.model, fontsize=9)
    axis.set_xlabel(in_unit(c.roles.input, c.roles.input_unit))
    if number == 0:
        axis.set_ylabel(in_unit("measured - model", c.roles.output_unit))


def _regions(axis: Axes, found: Sequence[Comparison]) -> None:
    """RMSE of every model in the regions where the first one had most of its error."""
    worst = sorted(found[0].regions, key=lambda r: r.share_of_squared_error, reverse=True)[:REGIONS][::-1]
    height = 0.8 / len(found)
    for i, (c, colour) in enumerate(zip(found, COLOURS, strict=False)):
        by_label = {(r.dimension, r.label): r.rmse_n for r in c.regions}
        values = [by_label.get((r.dimension, r.label), 0.0) for r in worst]
        axis.barh(np.arange(len(worst)) - i * height, values, height=height, color=colour, label=c.model)
    axis.set_yticks(np.arange(len(worst)) - 0.4 + height / 2, [r.label for r in worst], fontsize=8)
    axis.set_xlabel(in_unit("RMSE", found[0].roles.output_unit))
    axis.legend(fontsize=8, loc="lower right")
