"""Test points as a table, a picture and a page."""

from collections.abc import Callable, Iterable
from functools import partial
from typing import TYPE_CHECKING

import msgspec
import numpy as np

from thrustd.flighttest.answer import CHANGED, COLOURS, Answer, Columns, said
from thrustd.flighttest.flight import Flight, absent
from thrustd.flighttest.points import Point, TestPoints
from thrustd.flighttest.uncertainty import Mean

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WORDS = (
    "Means of steady windows with their 95 % uncertainty. F thrust, Wf fuel, TSFC = Wf / F in g/(kN s); F/d, N1/rt by "
    "delta_t and root of theta_t of the total state. r: random, samples that repeat one another counted once. "
    "s: systematic, the same in the whole window: the thrust's own band, meter and density of the fuel ([fuel] of "
    "the aircraft's file). Other sensors' systematic part is not known."
)
HEADS = ("point", "from s", "s", "Mach", "alt m", "engine", "F N", "r", "s", "Wf g/s", "r", "s", "TSFC", "r", "s",
         "N1 %", "F/d N", "N1/rt")  # fmt: skip


def count(found: TestPoints) -> str:
    return f"{len(found.points)} test point{'s' * (len(found.points) > 1)}"


def table_rows(found: TestPoints) -> list[list[str]]:
    """A row per point and engine, under HEADS."""
    return [_row(point, engine, not number) for point in found.points for number, engine in enumerate(found.engines)]


def limits_line(found: TestPoints) -> str:
    """The limits, in one sentence."""
    limits = ", ".join(f"{name} {value:g}" for name, value in msgspec.to_builtins(found.limits).items())
    return f"limits (largest minus smallest one-second mean in a point): {limits}"


def unsteady(found: TestPoints) -> list[str]:
    """Of points that were given and do not hold the limits, and of estimates that doubt something: a sentence each."""
    lines = []
    for point in found.points:
        if point.moved:
            moved = ", ".join(f"{name} by {point.spans[name]:.3g}" for name in point.moved)
            lines.append(f"* point {point.name} is not steady: moved in {moved}")
        if point.missing_s:
            whole = f"of {point.end_s - point.start_s:.0f} s; means are of the others"
            lines.append(f"* point {point.name}: {absent(point.missing_s)} {whole}")
        lines += [f"point {point.name}, {engine}: {', '.join(bits)}" for engine, bits in point.status.items()]
    return lines


def answer(flight: Flight, found: TestPoints) -> Answer:
    whose = "fused thrust" if found.thrust == "fused" else "no estimates in it: the brochure's thrust alone"
    lines = [f"{found.flight}: {count(found)}; {whose}", *unsteady(found), limits_line(found)]
    if found.missing_s:
        lines.append(f"of the flight: {absent(found.missing_s)}: no steady window is found there")
    table = Columns("Points", HEADS, table_rows(found))
    return Answer(found, f"Test points of {found.flight}", WORDS, [table], lines, partial(figure, flight, found))


def figure(flight: Flight, found: TestPoints) -> "Figure":
    """Thrust, N1 and altitude over time with the points shaded; corrected thrust over corrected N1."""
    from matplotlib.figure import Figure

    drawn = Figure(figsize=(11, 9), layout="constrained")
    grid = drawn.add_gridspec(3, 2, width_ratios=(2, 1))
    record = flight.per_second().record
    first = None
    for row, (name, label) in enumerate(
        (("thrust_N", "thrust, N"), ("n1_pct", "N1, %"), ("pressure_altitude_m", "altitude, m"))
    ):
        axis = first = drawn.add_subplot(grid[row, 0], sharex=first)
        columns = [name] if name in record else [f"{name}_{engine}" for engine in found.engines]
        for column, colour in zip(columns, COLOURS, strict=False):
            axis.plot(record.time_s, record[column], lw=0.8, color=colour, label=column)
        for point in found.points:
            axis.axvspan(point.start_s, point.end_s, color="#56b4e9" if point.steady else CHANGED, alpha=0.3, lw=0)
        axis.set_ylabel(label)
        axis.legend(fontsize=7, loc="upper right")
    axis.set_xlabel("time, s")
    _against(drawn.add_subplot(grid[:2, 1]), found, "n1_corrected_pct", "thrust_corrected_N")
    _against(drawn.add_subplot(grid[2, 1]), found, "thrust_N", "tsfc_g_kN_s")
    drawn.suptitle(f"{found.flight}: {count(found)} ({found.thrust} thrust)", x=0.01, ha="left")
    return drawn


def _against(axis: "Axes", found: TestPoints, x: str, y: str) -> None:
    for engine, colour in zip(found.engines, COLOURS, strict=False):
        pairs = [(p.values[f"{x}_{engine}"], p.values[f"{y}_{engine}"]) for p in found.points
                 if f"{y}_{engine}" in p.values]  # fmt: skip
        if pairs:
            xs, ys = zip(*pairs, strict=True)
            across, up, bars = _column(xs, _mean), _column(ys, _mean), _column(ys, _u95)
            axis.errorbar(across, up, bars, fmt="o", ms=4, lw=1, color=colour, label=engine)
    axis.set_xlabel(x)
    axis.set_ylabel(y)
    axis.grid(alpha=0.3, lw=0.5)
    axis.legend(fontsize=7)


def _column(values: Iterable[Mean], part: Callable[[Mean], float]) -> "np.typing.NDArray[np.float64]":
    return np.array([part(value) for value in values])


def _mean(value: Mean) -> float:
    return value.mean


def _u95(value: Mean) -> float:
    return value.u95


def _row(point: Point, engine: str, first: bool) -> list[str]:
    value = point.values
    air = said(value["mach"].mean, ".3f"), said(value["pressure_altitude_m"].mean, ".0f")
    about = [
        point.name + ("" if point.steady else "*"),
        f"{point.start_s:.0f}",
        f"{point.end_s - point.start_s:.0f}",
        *air,
    ]
    numbers = []
    for name, scale, digits in (("thrust_N", 1.0, 0), ("fuel_flow_kg_s", 1e3, 2), ("tsfc_g_kN_s", 1.0, 2)):
        mean = value.get(f"{name}_{engine}")
        parts = (mean.mean, mean.random_u95, mean.systematic_u95) if mean else (np.nan,) * 3
        numbers += [said(scale * part, f".{digits}f") for part in parts]
    rest = (("n1_pct", 2), ("thrust_corrected_N", 0), ("n1_corrected_pct", 2))
    numbers += [said(value[f"{name}_{engine}"].mean, f".{digits}f") for name, digits in rest]
    return [*(about if first else [""] * len(about)), engine, *numbers]
