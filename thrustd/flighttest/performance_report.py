"""A drag polar as tables, sentences, a picture and a page."""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from thrustd.core.measures import SIGMAS_95
from thrustd.flighttest.answer import COLOURS, Answer, Columns
from thrustd.flighttest.performance import Interval, Performance, PerformancePoint, PolarResult, rms_difference_n
from thrustd.flighttest.steps import ThrottleStep, gain_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WORDS = (
    "C_D = C_D0 + C_L^2 / (pi A e), total least squares over steady, straight windows. 95 % intervals: random errors "
    "in the fit, every systematic source shifted by one sigma and fitted again."
)
COLUMNS = (
    "error N: thrust minus what polar and excess thrust ask for; air-acc N: air data minus accelerometer",
    "counts %: weight in the first polar, of the point that counts most; an error in g is more C_D in slow flight",
    "because: what else makes a point count less: thrust and acceleration that move in it (sigma of their mean), or "
    "air data that differ from the accelerometer by more or less than usual in this flight",
    "a step with * has an error outside its random 95 %",
)
POLAR_HEADS = "polar", "points", "C_D0", "95 %", "e", "95 %", "L/D max", "95 %"
POINT_HEADS = ("flight", "point", "from s", "s", "Mach", "alt m", "C_L", "C_D", "thrust N", "error N", "air-acc N",
               "counts %", "because")  # fmt: skip

STEP_HEADS = "flight", "at s", "N1 %", "thrust N", "accel N", "air N", "minus accel N", "95 %", "minus air N", "95 %"


def polar_rows(found: Performance) -> list[list[str]]:
    """Under POLAR_HEADS."""
    return [
        [polar.of, f"{polar.points}", *_shown(polar.zero_lift_drag, 4), *_shown(polar.oswald, 3),
         *_shown(polar.best_lift_to_drag, 1)]
        for polar in found.polars
    ]  # fmt: skip


def point_rows(found: Performance) -> list[list[str]]:
    """Under POINT_HEADS."""
    first = {name: points[0] for name, points in _by_flight(found.points)}
    return [
        [p.flight if first[p.flight] is p else "", p.name, f"{p.start_s:.0f}", f"{p.end_s - p.start_s:.0f}",
         f"{p.mach:.3f}", f"{p.altitude_m:.0f}", f"{p.lift:.3f}", f"{p.drag:.4f}", f"{p.thrust_n:.0f}",
         f"{p.thrust_error_n:+.0f}", f"{p.energy_minus_accel_n:+.0f}", f"{100 * p.counts:.0f}", p.left_out or p.why]
        for p in found.points
    ]  # fmt: skip


def step_rows(found: Performance) -> list[list[str]]:
    """Under STEP_HEADS: changes of thrust over throttle steps, errors by accelerometer and by air data."""
    return [
        [s.flight, f"{s.start_s:.0f}", f"{s.n1_from_pct:.0f} to {s.n1_to_pct:.0f}", f"{s.thrust_n:+.0f}",
         f"{s.accel_n:+.0f}", f"{s.air_n:+.0f}", _error(s, "accel"), f"{s.accel_error_u95:.0f}", _error(s, "air"),
         f"{s.air_error_u95:.0f}"]
        for s in found.steps
    ]  # fmt: skip


def tables(found: Performance) -> list[Columns]:
    steps = [Columns("Throttle steps", STEP_HEADS, step_rows(found))] if found.steps else []
    points = Columns("Points", POINT_HEADS, point_rows(found))
    return [points, *steps, Columns("Polars", POLAR_HEADS, polar_rows(found))]


def lines(found: Performance, known: Sequence[str]) -> list[str]:
    """What has to be said beside the tables."""
    said = [*COLUMNS[: 4 if found.steps else 3], *(_budget(polar) for polar in found.polars)]
    said.append(
        f"excess thrust, air data against accelerometer: {rms_difference_n(found.points):.0f} N rms over the points"
    )
    said += [_outside(step) for step in found.steps if step.outside]
    said += [_gain(found, way, name) for way, name in (("accel", "accelerometer"), ("air", "air data"))]
    for flight, (zero_g, std_g) in found.accelerometer_zero_g.items():
        half_mg = 1e3 * SIGMAS_95 * std_g
        said.append(f"{flight}: accelerometer zero {1e3 * zero_g:+.2f} +- {half_mg:.2f} mg (95 %), taken out")
    return [*said, *(f"known: {line}" for line in known), *found.notes]


def answer(found: Performance, known: Sequence[str]) -> Answer:
    """`known`: what the aircraft's file says of its wing."""
    return Answer(found, "Drag polar", WORDS, tables(found), lines(found, known), partial(figure, found))


def figure(found: Performance) -> "Figure":
    """C_D over C_L^2 with the polars; thrust error and excess thrust check over thrust."""
    from matplotlib.figure import Figure

    drawn = Figure(figsize=(11, 5), layout="constrained")
    left, right = drawn.subplots(1, 2)
    for flight, points in _by_flight(found.points):
        used = [p for p in points if not p.left_out]
        bars = [p.drag_u95 for p in used]
        left.errorbar([p.lift**2 for p in used], [p.drag for p in used], bars, fmt="o", ms=4, lw=0.8, label=flight)
        right.plot(
            [p.thrust_n for p in used], [p.thrust_error_n for p in used], "o", ms=4, label=f"{flight}: thrust error"
        )
        right.plot([p.thrust_n for p in used], [p.energy_minus_accel_n for p in used], "x", ms=4, color="#999999")
    out = [p for p in found.points if p.left_out and np.isfinite(p.drag)]
    top = max((p.lift**2 for p in found.points if not p.left_out), default=1.0)
    left.plot([p.lift**2 for p in out], [p.drag for p in out], "x", color="#999999", ms=5, label="left out")
    grid = np.linspace(0.0, 1.05 * top, 50)
    for polar, colour in zip(found.polars, COLOURS, strict=False):
        drag = (
            polar.zero_lift_drag.value
            + (1 / (4 * polar.zero_lift_drag.value * polar.best_lift_to_drag.value**2)) * grid
        )
        left.plot(grid, drag, color=colour, lw=1.2, label=polar.of)
    left.set(xlabel="C_L^2", ylabel="C_D", xlim=(0, 1.05 * top), ylim=(0, None))
    right.plot([], [], "x", color="#999999", label="air data minus accelerometer")
    right.axhline(0.0, color="black", lw=0.5)
    right.set(xlabel="thrust of all engines, N", ylabel="N")
    for axis in (left, right):
        axis.grid(alpha=0.3, lw=0.5)
        axis.legend(fontsize=7)
    return drawn


def _gain(found: Performance, way: str, name: str) -> str:
    gain = gain_of(found.steps, way)
    if gain.steps < 2:
        return f"throttle steps against {name}: {gain.steps}; two or more are needed, 15 s of rest on both sides"
    much = f"{100 * gain.error:+.1f} +- {100 * gain.u95:.1f} %"
    return f"throttle steps against {name}: thrust changes by {much} more, {gain.steps} steps, weighed with their 95 %"


def _error(step: ThrottleStep, way: str) -> str:
    return f"{getattr(step, f'{way}_error_n'):+.0f}{'*' * (way in step.outside)}"


def _outside(step: ThrottleStep) -> str:
    what = {
        ("accel", "air"): "by both: the thrust is wrong there, or the polar",
        ("accel",): "by the accelerometer alone: air data do not say so",
        ("air",): "by air data alone: the air moved, or the accelerometer is wrong too",
    }[step.outside]
    size = " and ".join(f"{getattr(step, f'{way}_error_n'):+.0f} N" for way in step.outside)
    return f"* {step.flight} at {step.start_s:.0f} s: {size}, outside the 95 % {what}"


def _by_flight(points: Sequence[PerformancePoint]) -> Iterator[tuple[str, list[PerformancePoint]]]:
    for flight in dict.fromkeys(p.flight for p in points):
        yield flight, [p for p in points if p.flight == flight]


def _shown(interval: Interval, digits: int) -> tuple[str, str]:
    return f"{interval.value:.{digits}f}", f"{interval.low:.{digits}f} to {interval.high:.{digits}f}"


def _budget(polar: PolarResult) -> str:
    parts = ", ".join(f"{source} {abs(change):.5f}" for source, change in polar.budget_zero_lift_drag.items())
    return f"{polar.of}: one sigma of C_D0 by source: {parts}; scatter between points {1e3 * polar.scatter_g:.1f} mg"
