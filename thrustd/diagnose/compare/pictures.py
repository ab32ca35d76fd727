"""Pictures of a comparison and of a diagnosis (matplotlib, PNG, no display needed)."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from thrustd.core.columns import Floats
from thrustd.diagnose.compare.comparison import Comparison
from thrustd.diagnose.compare.motion import motion_of
from thrustd.diagnose.compare.newtons import newtons
from thrustd.diagnose.compare.picture_data import LOOP_DOTS, channel_dependences, loop_of, rate_map_of, spectrum_of
from thrustd.diagnose.search.dependence import Dependence
from thrustd.records.recording import unit_of
from thrustd.records.roles import INPUT, OUTPUT, Roles
from thrustd.sinks.whole_file import whole_file

MEASURED, MODEL, RESIDUAL = "#444444", "#0072b2", "#d55e00"  # Okabe & Ito: distinct for colour-blind readers
UP, DOWN = "#0072b2", "#d55e00"  # direction of the motion
COLOURS = ("#667383", "#0072b2", "#009e73", "#cc79a7")  # of models in one picture: before is grey, as on the page
CHANNELS = (("#d55e00", "-"), ("#0072b2", "--"), ("#009e73", "-."), ("#cc79a7", ":"))  # those that explain most
POINTS = 4000  # per line: drawn as minimum and maximum of bins, so that no spike is lost
DPI = 110
LOOP_BINS = 40


def comparison_pictures(comparison: Comparison, folder: Path) -> list[Path]:
    """All pictures of one comparison, as `<model>-<recording>-<what>.png`."""
    folder.mkdir(parents=True, exist_ok=True)
    drawings: dict[str, Callable[[Comparison], Figure]] = {
        "history": history_figure,
        "channels": _channels,
        "loop": _loop,
        "spectrum": _spectrum,
        "map": _map,
    }
    paths = []
    for what, draw in drawings.items():
        path = folder / f"{slug(comparison.model)}-{slug(comparison.recording)}-{what}.png"
        save(draw(comparison), path)
        paths.append(path)
    return paths


def dependence_picture(dependences: Sequence[Dependence], path: Path, roles: Roles | None = None) -> Path:
    """Residual against the channels that it follows."""
    path.parent.mkdir(parents=True, exist_ok=True)
    save(dependence_figure(dependences, roles), path)
    return path


def dependence_figure(dependences: Sequence[Dependence], roles: Roles | None = None) -> Figure:
    figure = Figure(figsize=(5 * len(dependences), 3.6), layout="constrained")
    axes = figure.subplots(1, len(dependences), squeeze=False)[0]
    for axis, dependence in zip(axes, dependences, strict=True):
        _draw_dependence(axis, dependence, roles or Roles())
    return figure


def save(figure: Figure, path: Path) -> None:
    with whole_file(path) as part:
        figure.savefig(part, dpi=DPI, format="png")


def history_figure(c: Comparison) -> Figure:
    """Measured and model over time, the residual below."""
    figure = Figure(figsize=(11, 6), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    for column, colour, label in ((c.reference_n, MEASURED, "measured"), (c.model_n, MODEL, c.model)):
        top.plot(*envelope(c.time_s, column), color=colour, lw=0.8, label=label)
    bottom.plot(*envelope(c.time_s, c.residual_n), color=RESIDUAL, lw=0.6)
    bottom.axhline(0.0, color="black", lw=0.5)
    rmse = newtons(c.rmse_n, unit=c.roles.output_unit)
    top.set(ylabel=_output(c), title=f"{c.model} on {c.recording}: RMSE {rmse}")
    bottom.set(ylabel=_error(c), xlabel="time [s]")
    top.legend(loc="upper right", fontsize=8)
    return figure


def _channels(c: Comparison) -> Figure:
    dependences = channel_dependences(c)
    rows = -(-len(dependences) // 3)
    figure = Figure(figsize=(11, 2.8 * rows), layout="constrained")
    axes = figure.subplots(rows, 3, squeeze=False).ravel()
    for axis, dependence in zip(axes, dependences, strict=False):
        _draw_dependence(axis, dependence, c.roles)
    for axis in axes[len(dependences) :]:
        axis.set_axis_off()
    return figure


def _draw_dependence(axis: Axes, dependence: Dependence, roles: Roles) -> None:
    axis.fill_between(dependence.at, dependence.low_n, dependence.high_n, color=RESIDUAL, alpha=0.2, lw=0)
    axis.plot(dependence.at, dependence.residual_n, "o-", color=RESIDUAL, ms=3, lw=1)
    axis.axhline(0.0, color="black", lw=0.5)
    axis.set_xlabel(_named(dependence.channel, roles), fontsize=8)
    axis.set_ylabel(in_unit("measured - model", roles.output_unit) + ": mean, 10-90 %", fontsize=8)
    axis.tick_params(labelsize=7)


def _loop(c: Comparison) -> Figure:
    """Left the loops with their error, right the loops of the error itself: one colour up, one down."""
    figure = Figure(figsize=(12, 6), layout="constrained")
    left, right = figure.subplots(1, 2)
    loop = loop_of(c)
    x, limit = loop.deformation_mm, loop.limit_n
    dots = left.scatter(
        x, loop.reference_n, c=loop.residual_n, s=1, cmap="RdBu_r", vmin=-limit, vmax=limit, rasterized=True
    )
    left.plot(x, loop.model_n, color="black", lw=0.3, alpha=0.6, label=c.model)
    left.legend(loc="upper left", fontsize=8)
    figure.colorbar(dots, label=_error(c), ax=left)
    left.set(xlabel=_input(c), ylabel=_output(c), title=f"{c.recording}: loop, coloured by error")
    _error_loop(right, c)
    return figure


def _error_loop(axis: Axes, c: Comparison) -> None:
    """Error over deformation, by the direction of the last movement: dots, and the mean of each way."""
    x = c.channels[INPUT]
    direction = motion_of(x, float(np.median(np.diff(c.time_s)))).direction
    low, high = np.quantile(x, [0.002, 0.998])
    edges = np.linspace(low, high, LOOP_BINS + 1)
    for way, colour, words in ((1, UP, "last moved up"), (-1, DOWN, "last moved down")):
        rows = np.flatnonzero((direction == way) & np.isfinite(c.residual_n))
        thin = rows[:: max(1, len(rows) // LOOP_DOTS)]
        axis.plot(x[thin], c.residual_n[thin], ".", ms=0.6, alpha=0.3, color=colour, rasterized=True)
        number = np.digitize(x[rows], edges)
        means = [c.residual_n[rows[number == i]].mean() if (number == i).any() else np.nan
                 for i in range(1, LOOP_BINS + 1)]  # fmt: skip
        axis.plot(0.5 * (edges[1:] + edges[:-1]), means, "-", lw=2, color=colour, label=f"{words}: mean")
    axis.axhline(0.0, color="black", lw=0.5)
    axis.legend(loc="upper right", fontsize=8)
    axis.set(xlabel=_input(c), ylabel=_error(c), title=f"error of {c.model} by direction")


def _spectrum(c: Comparison) -> Figure:
    figure = Figure(figsize=(9, 6), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True)
    spectrum = spectrum_of(c)
    top.loglog(spectrum.frequency_hz, spectrum.residual_n_rthz, color=RESIDUAL, lw=0.9)
    top.set(ylabel=in_unit("residual", f"{c.roles.output_unit or 1}/sqrt(Hz)"), title=f"{c.model} on {c.recording}")
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
    figure.colorbar(mesh, label=in_unit("RMS error", c.roles.output_unit))
    axis.set_yscale("symlog", linthresh=float(errors.rate_edges_n_s[1]))
    axis.set(
        xlabel=in_unit("model", c.roles.output_unit),
        ylabel=in_unit("|rate|", _per_second(c.roles.output_unit)),
        title=f"{c.model} on {c.recording}: error map",
    )
    return figure


def envelope(time_s: Floats, column: Floats) -> tuple[Floats, Floats]:
    """Minimum and maximum of each of POINTS / 2 bins, in the order of time."""
    width = -(-len(column) // (POINTS // 2))
    if width < 2:
        return time_s, column
    m = len(column) // width * width
    table = np.nan_to_num(column[:m].reshape(-1, width))
    both = np.column_stack((table.min(axis=1), table.max(axis=1))).ravel()
    return np.repeat(time_s[:m:width], 2), both


def in_unit(words: str, unit: str) -> str:
    """`force [N]`; no brackets where nobody knows the unit, or the name says it already."""
    return f"{words} [{unit}]" if unit and not words.endswith((f"[{unit}]", f"({unit})", f"_{unit}")) else words


def _per_second(unit: str) -> str:
    return f"{unit or 1}/s"


def _input(c: Comparison) -> str:
    return in_unit("deformation" if c.roles.input == INPUT else c.roles.input, c.roles.input_unit)


def _output(c: Comparison) -> str:
    return in_unit("force" if c.roles.output == OUTPUT else c.roles.output, c.roles.output_unit)


def _error(c: Comparison) -> str:
    return in_unit("measured - model", c.roles.output_unit)


def _named(channel: str, roles: Roles) -> str:
    """A channel by its name in the file, with its unit."""
    if channel == f"model {OUTPUT}":
        return in_unit(f"model {roles.output}", roles.output_unit)
    return in_unit(roles.input, roles.input_unit) if channel == INPUT else in_unit(channel, unit_of(channel))


def slug(name: str) -> str:
    return "".join(ch if ch.isalnum() else "_" for ch in name.rsplit(".", 1)[0]).strip("_")
