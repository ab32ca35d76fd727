"""Test points as a table, a picture and a page."""

from collections import Counter
from collections.abc import Sequence
from functools import partial
from math import nan
from typing import TYPE_CHECKING

from thrustd.flighttest.answer import CHANGED, COLOURS, Answer, Columns, said
from thrustd.flighttest.flight import Flight, absent
from thrustd.flighttest.points import Point, TestPoints
from thrustd.flighttest.windows import Window, limits_said, overlaps
from thrustd.replay.budget_picture import points_picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WORDS = (
    "Means of steady windows with their 95 % uncertainty. F thrust, Wf fuel, TSFC = Wf / F; F/d, N1/rt by "
    "delta_t and root of theta_t of the total state. r/s: random, samples that repeat one another counted once; "
    "systematic, the same in the whole window: the thrust's own band, meter and density of the fuel ([fuel] of "
    "the aircraft's file). Other sensors' systematic part is not known."
)
SOURCES = {"mounts": "the mounts", "brochure": "the brochure", "fused": "what is in the fused thrust besides"}
BUDGET = "Budget: what the band is made of"
UNTOLD = (
    "terms of the band: not in this log; replay the raw one (thrustd replay LOG -o OUT.mcap) and give its estimates"
)
STEADY = "#56b4e9"
HEADS = ("point", "from\ns", "for\ns", "Mach", "alt\nm", "engine", "F\nN", "r/s\nN", "Wf\ng/s", "r/s\ng/s",
         "TSFC\ng/kNs", "r/s\ng/kNs", "N1\n%", "F/d\nN", "N1/rt\n%")  # fmt: skip


def count(found: TestPoints) -> str:
    return f"{len(found.points)} test point{'s' * (len(found.points) > 1)}"


def table_rows(found: TestPoints) -> list[list[str]]:
    """A row per point and engine, under HEADS."""
    return [_row(point, engine, not number) for point in found.points for number, engine in enumerate(found.engines)]


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
    shared = overlaps(Window(point.start_s, point.end_s, point.name) for point in found.points)
    return [*lines, *(f"{line}: their means are not independent" for line in shared)]


def answer(flight: Flight, found: TestPoints) -> Answer:
    whose = "fused thrust" if found.thrust == "fused" else "no estimates in it: the brochure's thrust alone"
    limits = f"limits (largest minus smallest one-second mean in a point): {limits_said(found.limits)}"
    lines = [f"{found.flight}: {count(found)}; {whose}", *unsteady(found), limits]
    if found.missing_s:
        lines.append(f"of the flight: {absent(found.missing_s)}: no steady window is found there")
    table = Columns("Points", HEADS, table_rows(found))
    title, told = f"Test points of {found.flight}", [point for point in found.points if point.budgets]
    lines += largest(told) if told else [UNTOLD] if found.thrust == "fused" else []
    more = {BUDGET: partial(budget_figure, found.flight, told)} if told else {}
    return Answer(found, title, WORDS, [table], lines, partial(figure, flight, found), more)


def largest(points: Sequence[Point]) -> list[str]:
    """Which term of each source is the largest, engine by engine: a sentence each."""
    lines = []
    for each in zip(*(point.budgets for point in points), strict=True):
        parts = []
        for source in SOURCES:
            rows = [of_source[0] for one in each if (of_source := one.of(source))]
            counts = Counter(row.term for row in rows).most_common()
            told = ", ".join(f"{term} ({n} of {len(rows)} points)" for term, n in counts)
            parts += [f"of {SOURCES[source]}: {told}"] if rows else []
        lines.append(f"{each[0].engine} engine, largest term of the band {'; '.join(parts)}")
    return lines


def budget_figure(flight: str, points: Sequence[Point]) -> "Figure":
    named = [(f"{point.name}{'' if point.steady else '*'}", point.budgets) for point in points]
    return points_picture(f"{flight}: terms of the band at every test point", named)


def figure(flight: Flight, found: TestPoints) -> "Figure":
    """Thrust, N1 and altitude over time with the points shaded; corrected thrust over N1, TSFC over thrust."""
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    drawn = Figure(figsize=(12, 8), layout="constrained")
    grid = drawn.add_gridspec(3, 2, width_ratios=(2, 1))
    record = flight.per_second().record
    first = None
    for row, (name, label) in enumerate(
        (("thrust_N", "net thrust, N"), ("n1_pct", "N1, %"), ("pressure_altitude_m", "pressure altitude, m"))
    ):
        axis = first = drawn.add_subplot(grid[row, 0], sharex=first)
        if name in record:
            axis.plot(record.time_s, record[name], lw=0.8, color="#888888")
        else:
            for engine, colour in zip(found.engines, COLOURS, strict=False):
                axis.plot(record.time_s, record[f"{name}_{engine}"], lw=0.8, color=colour)
        for point in found.points:
            axis.axvspan(point.start_s, point.end_s, color=STEADY if point.steady else CHANGED, alpha=0.3, lw=0)
        axis.set_ylabel(label)
    axis.set_xlabel("time, s")
    _against(drawn.add_subplot(grid[:2, 1]), found, ("n1_corrected_pct", "thrust_corrected_N"),
             ("corrected N1, %", "corrected thrust F / delta_t, N"))  # fmt: skip
    _against(drawn.add_subplot(grid[2, 1]), found, ("thrust_N", "tsfc_g_kN_s"), ("net thrust, N", "TSFC, g/(kN s)"))
    shades = [Patch(color=STEADY, alpha=0.3, label="steady point")]
    if not all(point.steady for point in found.points):
        shades.append(Patch(color=CHANGED, alpha=0.3, label="marked, not steady"))
    handles = [*drawn.axes[-1].get_legend_handles_labels()[0], *shades]
    drawn.legend(handles=handles, loc="outside upper right", ncols=6)
    drawn.suptitle(f"{found.flight}: {count(found)}, {found.thrust} thrust", x=0.01, ha="left", fontsize=11)
    return drawn


def _against(axis: "Axes", found: TestPoints, names: tuple[str, str], labels: tuple[str, str]) -> None:
    """Bars: 95 %."""
    x, y = names
    for engine, colour in zip(found.engines, COLOURS, strict=False):
        pairs = [(p.values[f"{x}_{engine}"], p.values[f"{y}_{engine}"]) for p in found.points
                 if f"{y}_{engine}" in p.values]  # fmt: skip
        if pairs:
            across, up = ([value.mean for value in column] for column in zip(*pairs, strict=True))
            bars = [value.u95 for _, value in pairs]
            axis.errorbar(across, up, bars, fmt="o", ms=4, lw=1, color=colour, label=f"{engine} (bars: 95 %)")
    axis.set(xlabel=labels[0], ylabel=labels[1])
    axis.grid(alpha=0.3, lw=0.5)


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
        parts = (mean.mean, mean.random_u95, mean.systematic_u95) if mean else (nan,) * 3
        shown, random, systematic = (said(scale * part, f".{digits}f") for part in parts)
        numbers += [shown, f"{random}/{systematic}"]
    rest = (("n1_pct", 2), ("thrust_corrected_N", 0), ("n1_corrected_pct", 2))
    numbers += [said(value[f"{name}_{engine}"].mean, f".{digits}f") for name, digits in rest]
    return [*(about if first else [""] * len(about)), engine, *numbers]
