"""Pictures of a comparison and of a diagnosis (matplotlib, PNG, no display needed)."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from thrustd.diagnose.compare.comparison import Comparison
from thrustd.diagnose.compare.picture_data import SLOWEST_N_S, channel_dependences, loop_of, rate_map_of, spectrum_of
from thrustd.diagnose.search.dependence import Dependence
from thrustd.model.stage import Floats
from thrustd.records.recording import unit_of
from thrustd.sinks.whole_file import whole_file

MEASURED, MODEL, RESIDUAL = "#444444", "#0072b2", "#d55e00"  # Okabe & Ito: distinct for colour-blind readers
CHANNELS = (("#d55e00", "-"), ("#0072b2", "--"), ("#009e73", "-."), ("#cc79a7", ":"))  # those that explain most
POINTS = 4000  # per line: drawn as minimum and maximum of bins, so that no spike is lost
DPI = 110


def comparison_pictures(comparison: Comparison, folder: Path) -> list[Path]:
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
        _save(draw(comparison), path)
        paths.append(path)
    return paths


def dependence_picture(dependences: Sequence[Dependence], path: Path) -> Path:
    """Residual against the channels that it follows."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure = Figure(figsize=(5 * len(dependences), 3.6), layout="constrained")
    axes = figure.subplots(1, len(dependences), squeeze=False)[0]
    for axis, dependence in zip(axes, dependences, strict=True):
        _draw_dependence(axis, dependence)
    _save(figure, path)
    return path


def _save(figure: Figure, path: Path) -> None:
    with whole_file(path) as part:
        figure.savefig(part, dpi=DPI, format="png")


def _history(c: Comparison) -> Figure:
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


def _channels(c: Comparison) -> Figure:
    dependences = channel_dependences(c)
    rows = -(-len(dependences) // 3)
    figure = Figure(figsize=(11, 2.8 * rows), layout="constrained")
    axes = figure.subplots(rows, 3, squeeze=False).ravel()
    for axis, dependence in zip(axes, dependences, strict=False):
        _draw_dependence(axis, dependence)
    for axis in axes[len(dependences) :]:
        axis.set_axis_off()
    return figure


def _draw_dependence(axis: Axes, dependence: Dependence) -> None:
    axis.fill_between(dependence.at, dependence.low_n, dependence.high_n, color=RESIDUAL, alpha=0.2, lw=0)
    axis.plot(dependence.at, dependence.residual_n, "o-", color=RESIDUAL, ms=3, lw=1)
    axis.axhline(0.0, color="black", lw=0.5)
    unit = unit_of(dependence.channel)
    axis.set_xlabel(f"{dependence.channel}{f' [{unit}]' if unit else ''}", fontsize=8)
    axis.set_ylabel("measured - model [N]: mean, 10-90 %", fontsize=8)
    axis.tick_params(labelsize=7)


def _loop(c: Comparison) -> Figure:
    figure = Figure(figsize=(7, 6), layout="constrained")
    axis = figure.subplots()
    loop = loop_of(c)
    x, limit = loop.deformation_mm, loop.limit_n
    dots = axis.scatter(
        x, loop.reference_n, c=loop.residual_n, s=1, cmap="RdBu_r", vmin=-limit, vmax=limit, rasterized=True
    )
    axis.plot(x, loop.model_n, color=MODEL, lw=0.2, alpha=0.6)
    figure.colorbar(dots, label="measured - model [N]")
    axis.set(xlabel="deformation [mm]", ylabel="force [N]", title=f"{c.recording}: loop, coloured by error")
    return figure


def _spectrum(c: Comparison) -> Figure:
    figure = Figure(figsize=(9, 6), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True)
    spectrum = spectrum_of(c)
    top.loglog(spectrum.frequency_hz, spectrum.residual_n_rthz, color=RESIDUAL, lw=0.9)
    top.set(ylabel="residual [N/sqrt(Hz)]", title=f"{c.model} on {c.recording}")
    lines = zip(spectrum.coherence.items(), CHANNELS, strict=False)
    for (name, share), (colour, dash) in lines:
        label = f"{name}: {100 * spectrum.explained[name]:.0f} % of the residual's power"
        bottom.semilogx(spectrum.coherence_hz, share, dash, lw=1.0, color=colour, label=label)
    bottom.set(xlabel="frequency [Hz]", ylabel="coherence with the residual", ylim=(0, 1))
    figure.legend(fontsize=8, ncols=2, loc="outside lower center")
    return figure


def _map(c: Comparison) -> Figure:
    figure = Figure(figsize=(8, 5), layout="constrained")
    axis = figure.subplots()
    errors = rate_map_of(c)
    mesh = axis.pcolormesh(errors.force_edges_n, errors.rate_edges_n_s, errors.rms_n.T, cmap="viridis")
    figure.colorbar(mesh, label="RMS error [N]")
    axis.set_yscale("symlog", linthresh=SLOWEST_N_S)
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
