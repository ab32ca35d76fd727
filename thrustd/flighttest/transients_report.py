"""Transients as a table, a picture and a page."""

from functools import partial
from typing import TYPE_CHECKING

from thrustd.flighttest.answer import COLOURS, Answer, Columns, said
from thrustd.flighttest.flight import Flight, absent
from thrustd.flighttest.transients import Transient, Transients

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WORDS = (
    "N1 moved by the throttle: time to 95 % of the change, overshoot, largest rate. Candidates are places to look at."
)
HEADS = "at\ns", "engine", "event", "N1 from\n%", "to\n%", "for\ns", "overshoot\n%", "rate\n%/s", "thrust\nN"
AROUND_S = 15.0
TOGETHER_S = 2.0
MOST_DRAWN, ACROSS = 12, 4


def table_rows(found: Transients) -> list[list[str]]:
    """Under HEADS."""
    return [
        [f"{e.start_s:.1f}", e.engine, e.kind, f"{e.n1_from_pct:.1f}", f"{e.n1_to_pct:.1f}", said(e.seconds, ".1f"),
         said(e.overshoot_pct, ".2f"), said(e.largest_rate_pct_s, ".1f"), said(e.thrust_change_n, "+.0f")]
        for e in found.events
    ]  # fmt: skip


def words(found: Transients) -> str:
    """How many of each, in one sentence."""
    kinds = dict.fromkeys(event.kind for event in found.events)
    counts = ", ".join(f"{sum(e.kind == kind for e in found.events)} x {kind}" for kind in kinds)
    return f"{found.flight}: {counts or 'no event'}; {len(found.candidates) or 'no'} candidates to look at"


def answer(flight: Flight, found: Transients) -> Answer:
    table = Columns("Events", HEADS, table_rows(found))
    draw = partial(figure, flight, found)
    lines = [words(found)]
    if found.missing_s:
        lines.append(f"of the flight: {absent(found.missing_s)}: an event there may be missed")
    return Answer(found, f"Transients of {found.flight}", WORDS, [table], lines, draw)


def manoeuvres(found: Transients) -> list[list[Transient]]:
    """Events of the same kind that begin together, in order of time: the pilot moves both throttles."""
    together: list[list[Transient]] = []
    for event in found.events:
        mine = [g for g in together if g[0].kind == event.kind and event.start_s - g[-1].start_s < TOGETHER_S]
        if mine and event.engine not in {one.engine for one in mine[-1]}:
            mine[-1].append(event)
        else:
            together.append([event])
    return together


def figure(flight: Flight, found: Transients) -> "Figure":
    """N1 and thrust of all engines around every candidate, then around the largest movements."""
    from matplotlib.figure import Figure

    each = manoeuvres(found)
    largest = sorted(each, key=lambda events: min(_order(found, event) for event in events))
    shown = sorted(largest[:MOST_DRAWN], key=lambda events: events[0].start_s)
    down = max(-(-len(shown) // ACROSS), 1)
    drawn = Figure(figsize=(14, 2.4 * down + 1.2), layout="constrained")
    axes = drawn.subplots(down, ACROSS, squeeze=False).ravel().tolist()
    for axis in axes[len(shown) :]:
        axis.set_visible(False)
    thrusts = [_panel(axis, flight, events) for axis, events in zip(axes, shown, strict=False)]
    for number, (axis, thrust) in enumerate(zip(axes, thrusts, strict=False)):
        if number % ACROSS == 0:
            axis.set_ylabel("N1, %", fontsize=8)
        if number % ACROSS == ACROSS - 1 or number == len(shown) - 1:
            thrust.set_ylabel("net thrust, kN", fontsize=8)
    drawn.legend(*axes[0].get_legend_handles_labels(), loc="outside upper right", ncols=4, fontsize=8)
    which = "all" if len(shown) == len(each) else f"the {len(shown)} largest of"
    title = f"{found.flight}: {which} {len(each)} manoeuvres; lines: N1, dotted: thrust"
    drawn.suptitle(title, x=0.01, ha="left", fontsize=10)
    drawn.supxlabel("time, s", fontsize=8)
    return drawn


def _order(found: Transients, event: Transient) -> tuple[bool, float]:
    return event not in found.candidates, -abs(event.n1_to_pct - event.n1_from_pct)


def _panel(axis: "Axes", flight: Flight, events: list[Transient]) -> "Axes":
    """N1 on the axis, thrust on another one over it, which is handed back."""
    begin_s = events[0].start_s
    part = flight.record.window(begin_s - AROUND_S / 3, begin_s + AROUND_S)
    thrust = axis.twinx()
    for engine, colour in zip(flight.engines, COLOURS, strict=False):
        axis.plot(part.time_s, part[f"n1_pct_{engine}"], color=colour, lw=1.2, label=engine)
        thrust.plot(part.time_s, part[f"thrust_N_{engine}"] / 1000, color=colour, lw=1.0, ls=":")
    axis.axvline(begin_s, color="#888888", lw=0.6, ls="--")
    axis.set_title(f"{' and '.join(event.engine for event in events)}: {events[0].kind}", fontsize=8)
    for each in (axis, thrust):
        each.tick_params(labelsize=7)
    axis.grid(alpha=0.3, lw=0.5)
    axis.locator_params(axis="x", nbins=4)
    return thrust
