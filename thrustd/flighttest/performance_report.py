"""A drag polar as tables, sentences, a picture and a page."""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from thrustd.core.measures import SIGMAS_95
from thrustd.flighttest.answer import Answer, Columns, said
from thrustd.flighttest.flown import LEFT_OUT
from thrustd.flighttest.performance_result import BesideKnown, Interval, Performance, PerformancePoint, PolarResult
from thrustd.flighttest.steps import ThrottleStep

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WORDS = (
    "C_D = C_D0 + C_L^2 / (pi A e), total least squares over steady, straight windows. 95 % intervals: random errors "
    "in the fit, every systematic source shifted by one sigma and fitted again."
)
COLUMNS = (
    "error: thrust minus what polar and excess thrust ask for, with its random 95 %",
    "air-acc: excess thrust by air data minus by accelerometer",
    "counts: weight in the first polar, of the point that counts most; an error in g is more C_D in slow flight",
    "because: what else makes a point count less: thrust and acceleration that move in it (sigma of their mean), or "
    "air data that differ from the accelerometer by more or less than usual in this flight",
    "a step with * has an error outside its random 95 %",
)
POLAR_HEADS = "polar", "points", "C_D0", "95 %", "e", "95 %", "L/D max", "95 %"
POINT_HEADS = ("point", "from\ns", "for\ns", "Mach", "alt\nm", "C_L", "C_D", "thrust\nN", "error\nN", "95 %\nN",
               "air-acc\nN", "counts\n%", "because")  # fmt: skip
STEP_HEADS = ("at\ns", "N1\n%", "thrust\nN", "accel\nN", "air\nN", "minus accel\nN", "95 %\nN", "minus air\nN",
              "95 %\nN")  # fmt: skip


LEAST_SHOWN = 1e-5  # of C_D0; of a scatter in g


def polar_rows(found: Performance) -> list[list[str]]:
    """Under POLAR_HEADS."""
    return [
        [polar.of, f"{polar.points}", *_shown(polar.zero_lift_drag, 4), *_shown(polar.oswald, 3),
         *_shown(polar.best_lift_to_drag, 1)]
        for polar in found.polars
    ]  # fmt: skip


def point_rows(points: Sequence[PerformancePoint]) -> list[list[str]]:
    """Under POINT_HEADS, of one flight."""
    return [
        [p.name, f"{p.start_s:.0f}", f"{p.end_s - p.start_s:.0f}", said(p.mach, ".3f"), said(p.altitude_m, ".0f"),
         said(p.c_l, ".3f"), said(p.c_d, ".4f"), said(p.thrust_n, ".0f"), said(p.thrust_error_n, "+.0f"),
         said(p.thrust_error_n_u95, ".0f"), said(p.energy_minus_accel_n, "+.0f"), f"{p.counts_pct:.0f}",
         p.left_out or p.why]
        for p in points
    ]  # fmt: skip


def step_rows(steps: Sequence[ThrottleStep]) -> list[list[str]]:
    """Under STEP_HEADS, of one flight: changes of thrust, errors by accelerometer and by air data."""
    return [
        [f"{s.start_s:.0f}", f"{s.n1_from_pct:.0f} to {s.n1_to_pct:.0f}", f"{s.thrust_n:+.0f}",
         f"{s.accel_n:+.0f}", f"{s.air_n:+.0f}", _error(s, "accel"), f"{s.accel_error_n_u95:.0f}", _error(s, "air"),
         f"{s.air_error_n_u95:.0f}"]
        for s in steps
    ]  # fmt: skip


def tables(found: Performance) -> list[Columns]:
    """Points and throttle steps of every flight, then the polars of all."""
    each = []
    for flight, points in _by_flight(found.points):
        each.append(Columns(f"Points of {flight}", POINT_HEADS, point_rows(points)))
        steps = [step for step in found.steps if step.flight == flight]
        if steps:
            each.append(Columns(f"Throttle steps of {flight}", STEP_HEADS, step_rows(steps)))
    return [*each, Columns("Polars", POLAR_HEADS, polar_rows(found))]


def sentences(found: Performance) -> list[str]:
    """What has to be said beside the tables."""
    lines = [*COLUMNS[: None if found.steps else -1], *(_budget(polar) for polar in found.polars)]
    lines.append(f"excess thrust, air data against accelerometer: {found.excess_rms_n:.0f} N rms over the points")
    lines += [
        f"{p.flight}, point {p.name}: values missing in {p.missing_s} of {p.end_s - p.start_s:.0f} s, means of the rest"
        for p in found.points if p.missing_s
    ]  # fmt: skip
    lines += [_outside(step) for step in found.steps if step.outside]
    lines += [_gain(found, way, name) for way, name in (("accel", "accelerometer"), ("air", "air data"))]
    for flight, (zero_g, std_g) in found.accelerometer_zero_g.items():
        half_mg = 1e3 * SIGMAS_95 * std_g
        lines.append(f"{flight}: accelerometer zero {1e3 * zero_g:+.2f} +- {half_mg:.2f} mg (95 %), taken out")
    return [*lines, *(_beside(known, found.polars[0]) for known in found.known), *found.notes]


def answer(found: Performance) -> Answer:
    return Answer(found, "Drag polar", WORDS, tables(found), sentences(found), partial(figure, found))


def figure(found: Performance) -> "Figure":
    """C_D over C_L^2 with the polars; thrust error and excess thrust check over thrust."""
    from matplotlib import rcParams
    from matplotlib.figure import Figure

    ink = rcParams["text.color"]  # of a light or a dark page
    drawn = Figure(figsize=(12, 6), layout="constrained")
    left, right = drawn.subplots(1, 2)
    for number, (flight, points) in enumerate(_by_flight(found.points)):
        used = [p for p in points if not p.left_out]
        bars = [p.c_d_u95 for p in used]
        mark: Any = {"fmt": "o", "ms": 4, "lw": 0.8, "color": f"C{number}"}
        left.errorbar([p.c_l**2 for p in used], [p.c_d for p in used], bars, **mark, label=f"{flight}, bars: 95 %")
        errors, bars = [p.thrust_error_n for p in used], [p.thrust_error_n_u95 for p in used]
        thrusts = [p.thrust_n for p in used]
        right.errorbar(thrusts, errors, bars, **mark, label=f"{flight}: thrust minus what the polar asks for")
        right.plot(thrusts, [p.energy_minus_accel_n for p in used], "x", ms=5, color="#777777")
    top = max((p.c_l**2 for p in found.points if not p.left_out), default=1.0)
    for why, cross in zip(LEFT_OUT[1:], "x+1", strict=True):
        out = [p for p in found.points if p.left_out == why and np.isfinite(p.c_d)]
        if out:
            left.plot([p.c_l**2 for p in out], [p.c_d for p in out], cross, color="#777777", label=f"left out: {why}")
    grid = np.linspace(0.0, 1.05 * top, 50)
    for polar, line in zip(found.polars, ("-", "--", ":"), strict=False):
        c_d0, ratio = polar.zero_lift_drag.value, polar.best_lift_to_drag.value
        left.plot(grid, c_d0 + grid / (4 * c_d0 * ratio**2), line, color=ink, lw=1.2, label=f"polar: {polar.of}")
    highest = max((p.c_d + p.c_d_u95 for p in found.points if not p.left_out), default=None)
    left.set(xlabel="$C_L^2$", ylabel="$C_D$", xlim=(0, 1.05 * top), ylim=(0, highest))
    right.plot([], [], "x", color="#777777", label="excess thrust: air data minus accelerometer")
    right.axhline(0.0, color=ink, lw=0.5)
    right.set(xlabel="net thrust of all engines, N", ylabel="difference, N")
    for axis in (left, right):
        axis.grid(alpha=0.3, lw=0.5)
        axis.legend(fontsize=8, loc="lower left", bbox_to_anchor=(0.0, 1.0), frameon=False)
    return drawn


def _gain(found: Performance, way: str, name: str) -> str:
    gain = found.gains[way]
    if gain.steps < 2:
        return f"throttle steps against {name}: {gain.steps}; two or more are needed, 15 s of rest on both sides"
    much = f"{100 * gain.error:+.1f} +- {100 * gain.u95:.1f} % (95 %)"
    return f"throttle steps against {name}: error of the thrust's changes {much}, {gain.steps} steps"


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
    parts = ", ".join(
        f"{source} {abs(change):.5f}" if abs(change) >= LEAST_SHOWN else f"{source} below {LEAST_SHOWN:.5f}"
        for source, change in polar.budget_zero_lift_drag.items()
    )
    scatter = (
        f"scatter between points {1e3 * polar.scatter_g:.1f} mg" if polar.scatter_g >= LEAST_SHOWN else "no scatter"
    )
    return f"{polar.of}: one sigma of C_D0 by source: {parts}; {scatter} beyond what each point says of itself"


def _beside(known: BesideKnown, polar: PolarResult) -> str:
    """A published polar against the first one's intervals."""
    c_d0 = _inside(f"C_D0 {known.zero_lift_drag:g}", known.zero_lift_drag_inside, polar.zero_lift_drag, 4)
    return f"known: {c_d0}; {_inside(f'e {known.oswald:g}', known.oswald_inside, polar.oswald, 3)}: {known.source}"


def _inside(number: str, inside: bool, interval: Interval, digits: int) -> str:
    return f"{number}, inside" if inside else f"{number}, outside {_shown(interval, digits)[1]}"
