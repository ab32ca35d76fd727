"""The visible window of a time history as a figure for a report: 180 mm wide, title, units, PNG (300 dpi) or SVG."""

import secrets
from collections.abc import Mapping
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from thrustd.core.errors import UsageError
from thrustd.core.types import Progress
from thrustd.sinks.whole_file import whole_file
from thrustd.workbench.folder import Folder
from thrustd.workbench.lines import Line
from thrustd.workbench.pyramid import zoom

MM = 1 / 25.4  # inches
WIDTH_MM, PANEL_MM, HEAD_MM = 180.0, 42.0, 22.0
DPI = 300
BUCKETS = 1500  # per line: more than the printer resolves
TITLE_SIGNS, LEGEND_SIGNS = 110, 75  # in a line
MEASURED = "#16202b"
COLORS = ("#0072b2", "#d55e00", "#009e73", "#b0538a", "#5c6875")


def write_figure(folder: Folder, arguments: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """One axes per panel over the same time; every sample takes part in the lowest and the highest drawn."""
    panels, kind = arguments["panels"], arguments["format"]
    start_s, stop_s = arguments["start_s"], arguments["stop_s"]
    if not start_s < stop_s:
        raise UsageError(f"figure: window from {start_s:g} to {stop_s:g} s; expected start < stop")
    progress(0.2, "drawing")
    figure = Figure(figsize=(WIDTH_MM * MM, (HEAD_MM + PANEL_MM * len(panels)) * MM), layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(fill(arguments["title"], TITLE_SIGNS), fontsize=9)
    places = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    for place, panel in zip(places, panels, strict=True):
        lines = [folder.line(arguments["recording"], channel) for channel in panel["channels"]]
        _draw(place, lines, start_s, stop_s)
        place.set_title(panel["title"], fontsize=7, loc="left")
    places[-1].set_xlabel("time [s]", fontsize=8)
    places[-1].set_xlim(start_s, stop_s)
    reports = folder.state / "reports"
    reports.mkdir(parents=True, exist_ok=True)
    number = f"{secrets.token_hex(8)}.{kind}"
    with whole_file(reports / number) as part:
        figure.savefig(part, format=kind, dpi=DPI)
    return {"report": number}


def _draw(place: Axes, lines: list[Line], start_s: float, stop_s: float) -> None:
    colors = iter(COLORS * len(lines))
    for line in lines:
        time_s = line.columns.time_s
        first, last = np.searchsorted(time_s, [start_s, stop_s])
        first, last = max(0, int(first) - 1), min(len(time_s), int(last) + 1)
        found = zoom(line.columns.column(line.channel), line.columns.levels(line.channel), first, last, BUCKETS)
        values = np.column_stack((found.low, found.high)).ravel()
        measured = line.channel == "force_N"  # wide enough to be seen behind a model
        color, width = (MEASURED, 1.6) if measured else (next(colors), 0.7)
        place.plot(np.repeat(time_s[found.first], 2), values, lw=width, color=color, label=_named(line.label))
    place.tick_params(labelsize=7)
    place.grid(True, lw=0.3, color="#cccccc")
    if len(lines) > 1:  # above the axes, beside its title or over it: never over a curve
        beside = sum(len(_named(line.label)) for line in lines) < LEGEND_SIGNS
        place.legend(
            fontsize=6, loc="lower right", bbox_to_anchor=(1, 1 if beside else 1.1), ncols=len(lines) if beside else 1,
            frameon=False, borderaxespad=0.3,
        )  # fmt: skip


def _named(label: str) -> str:
    """model@folder/mount.json -> mount"""
    return "measured" if label == "force_N" else label.split("@")[-1].split("/")[-1].removesuffix(".json")
