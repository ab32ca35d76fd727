"""Pictures of a comparison and of a diagnosis (matplotlib, PNG, no display needed)."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.signal import coherence, welch

from thrustd.diagnose.candidates import moves
from thrustd.diagnose.dependence import Dependence, drawn
from thrustd.diagnose.regions import force_rate
from thrustd.model.stage import Floats
from thrustd.records.recording import unit_of

if TYPE_CHECKING:
    from thrustd.diagnose.compare import Comparison

MEASURED, MODEL, RESIDUAL = "#444444", "#0072b2", "#d55e00"  # Okabe & Ito: distinct for colour-blind readers
POINTS = 4000  # per line: drawn as minimum and maximum of bins, so that no spike is lost
DPI = 110


def comparison_pictures(comparison: "Comparison", folder: Path) -> list[Path]:
    """All pictures of one comparison, as `<model>-<recording>-<what>.png`."""
    folder.mkdir(parents=True, exist_ok=True)
    drawings: dict[str, Callable[[Comparison], Figure]] = {
        "history": _history,
        "channels": _channels,
        "loop": _loop,
        "spectrum": _spectrum,
        "map": _map,
    }
    paths = []
    for what, draw in drawings.items():
        path = folder / f"{_slug(comparison.model)}-{_slug(comparison.recording)}-{what}.png"
        draw(comparison).savefig(path, dpi=DPI)
        paths.append(path)
    return paths


def dependence_picture(dependences: list[Dependence], path: Path) -> Path:
    """Residual against the channels that it follows."""
    figure = Figure(figsize=(5 * len(dependences), 3.6), layout="constrained")
    axes = figure.subplots(1, len(dependences), squeeze=False)[0]
    for axis, dependence in zip(axes, dependences, strict=True):
        _draw_dependence(axis, dependence)
    figure.savefig(path, dpi=DPI)
    return path


def _history(c: "Comparison") -> Figure:
    figure = Figure(figsize=(11, 6), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    for column, colour, label in ((c.reference_n, MEASURED, "measured"), (c.model_n, MODEL, c.model)):
        top.plot(*_envelope(c.time_s, column), color=colour, lw=0.8, label=label)
    bottom.plot(*_envelope(c.time_s, c.residual_n), color=RESIDUAL, lw=0.6)
    bottom.axhline(0.0, color="black", lw=0.5)
    top.set(ylabel="force [N]", title=f"{c.model} on {c.recording}: RMSE {c.rmse_n:.1f} N")
    bottom.set(ylabel="measured - model [N]", xlabel="time [s]")
    top.legend(loc="upper right", fontsize=8)
    return figure


def _channels(c: "Comparison") -> Figure:
    columns = {n: w for n, w in c.channels.items() if moves(w)} | {"model force_N": c.model_n, "time_s": c.time_s}
    rows = -(-len(columns) // 3)
    figure = Figure(figsize=(11, 2.8 * rows), layout="constrained")
    axes = figure.subplots(rows, 3, squeeze=False).ravel()
    for axis, (name, column) in zip(axes, columns.items(), strict=False):
        _draw_dependence(axis, drawn(name, column, c.residual_n, c.rmse_n, c.rmse_n))
    for axis in axes[len(columns) :]:
        axis.set_axis_off()
    return figure


def _draw_dependence(axis: Axes, dependence: Dependence) -> None:
    axis.fill_between(dependence.at, dependence.low_n, dependence.high_n, color=RESIDUAL, alpha=0.2, lw=0)
    axis.plot(dependence.at, dependence.residual_n, "o-", color=RESIDUAL, ms=3, lw=1)
    axis.axhline(0.0, color="black", lw=0.5)
    unit = unit_of(dependence.channel)
    axis.set_xlabel(f"{dependence.channel}{f' [{unit}]' if unit else ''}", fontsize=8)
    axis.set_ylabel("residual [N]: mean, 10-90 %", fontsize=8)
    axis.tick_params(labelsize=7)


def _loop(c: "Comparison") -> Figure:
    figure = Figure(figsize=(7, 6), layout="constrained")
    axis = figure.subplots()
    step = max(1, len(c.time_s) // 40_000)
    x, force, residual = c.channels["deformation_mm"][::step], c.reference_n[::step], c.residual_n[::step]
    limit = float(np.nanquantile(np.abs(residual), 0.98)) or 1.0
    dots = axis.scatter(x, force, c=residual, s=1, cmap="RdBu_r", vmin=-limit, vmax=limit, rasterized=True)
    axis.plot(x, c.model_n[::step], color=MODEL, lw=0.2, alpha=0.6)
    figure.colorbar(dots, label="measured - model [N]")
    axis.set(xlabel="deformation [mm]", ylabel="force [N]", title=f"{c.recording}: loop, coloured by error")
    return figure


def _spectrum(c: "Comparison") -> Figure:
    figure = Figure(figsize=(9, 6), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True)
    residual = np.where(np.isfinite(c.residual_n), c.residual_n, 0.0)
    rate_hz = 1.0 / float(np.median(np.diff(c.time_s)))
    length = min(len(residual), 1 << 14)
    frequency, power = welch(residual, rate_hz, nperseg=length)
    top.loglog(frequency[1:], np.sqrt(power[1:]), color=RESIDUAL, lw=0.9)
    top.set(ylabel="residual [N/sqrt(Hz)]", title=f"{c.model} on {c.recording}")
    for name, column in c.channels.items():
        if moves(column):
            frequency, share = coherence(residual, column, rate_hz, nperseg=min(length, 1 << 12))
            bottom.semilogx(frequency[1:], share[1:], lw=0.8, label=name)
    bottom.set(xlabel="frequency [Hz]", ylabel="coherence with the residual", ylim=(0, 1))
    bottom.legend(fontsize=7, ncols=2)
    return figure


def _map(c: "Comparison") -> Figure:
    rate = np.abs(force_rate(c.model_n, float(np.median(np.diff(c.time_s)))))
    good = np.isfinite(c.residual_n)
    force_edges = np.unique(np.quantile(c.model_n, np.linspace(0, 1, 13)))
    rate_edges = np.concatenate(([0.0], np.geomspace(5.0, max(10.0, float(rate.max()) * 1.01), 9)))
    inside = (c.model_n[good], rate[good])
    total, _, _ = np.histogram2d(*inside, bins=(force_edges, rate_edges), weights=c.residual_n[good] ** 2)
    count, _, _ = np.histogram2d(*inside, bins=(force_edges, rate_edges))
    figure = Figure(figsize=(8, 5), layout="constrained")
    axis = figure.subplots()
    rms = np.sqrt(np.divide(total, count, out=np.full_like(total, np.nan), where=count > 0))
    mesh = axis.pcolormesh(force_edges, rate_edges, rms.T, cmap="viridis")
    figure.colorbar(mesh, label="RMS error [N]")
    axis.set_yscale("symlog", linthresh=5.0)
    axis.set(xlabel="model force [N]", ylabel="|force rate| [N/s]", title=f"{c.model} on {c.recording}: error map")
    return figure


def _envelope(time_s: Floats, column: Floats) -> tuple[Floats, Floats]:
    """Minimum and maximum of each of POINTS / 2 bins, in the order of time."""
    width = -(-len(column) // (POINTS // 2))
    if width < 2:
        return time_s, column
    m = len(column) // width * width
    table = np.nan_to_num(column[:m].reshape(-1, width))
    both = np.column_stack((table.min(axis=1), table.max(axis=1))).ravel()
    return np.repeat(time_s[:m:width], 2), both


def _slug(name: str) -> str:
    return "".join(ch if ch.isalnum() else "_" for ch in name.rsplit(".", 1)[0]).strip("_")
