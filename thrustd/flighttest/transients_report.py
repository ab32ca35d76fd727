"""Transients as a table, a picture and a page."""

from functools import partial
from typing import TYPE_CHECKING

from thrustd.flighttest.answer import COLOURS, Answer, Columns, said
from thrustd.flighttest.flight import Flight, absent
from thrustd.flighttest.transients import Transients

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WORDS = (
    "N1 moved by the throttle: time to 95 % of the change, overshoot, largest rate. Candidates are places to look at."
)
HEADS = "at s", "engine", "event", "N1 from", "to %", "s", "overshoot %", "%/s", "thrust N"
AROUND_S = 15.0
MOST_DRAWN = 12


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
        lines.append(f"of the flight: {absent(found.missing_s)}: no event is found there")
    return Answer(found, f"Transients of {found.flight}", WORDS, [table], lines, draw)


def figure(flight: Flight, found: Transients) -> "Figure":
    """N1 of all engines around every candidate, then around the largest movements."""
    from matplotlib.figure import Figure

    largest = sorted(found.events, key=lambda e: (e not in found.candidates, -abs(e.n1_to_pct - e.n1_from_pct)))
    shown = sorted(largest[:MOST_DRAWN], key=lambda e: e.start_s)
    down = max(-(-len(shown) // 4), 1)
    drawn = Figure(figsize=(14, 2.8 * down), layout="constrained")
    axes = drawn.subplots(down, 4, squeeze=False).ravel().tolist()
    record = flight.record
    for axis in axes:
        axis.set_visible(False)
    for axis, event in zip(axes, shown, strict=False):
        part = record.window(event.start_s - AROUND_S / 3, event.start_s + AROUND_S)
        axis.set_visible(True)
        for engine, colour in zip(flight.engines, COLOURS, strict=False):
            axis.plot(part.time_s, part[f"n1_pct_{engine}"], color=colour, lw=1.2, label=engine)
        thrust = axis.twinx()
        thrust.plot(part.time_s, part[f"thrust_N_{event.engine}"] / 1000, color="#888888", lw=0.8, ls=":")
        axis.axvline(event.start_s, color="#888888", lw=0.6, ls="--")
        axis.set_title(f"{event.engine}: {event.kind}", fontsize=8)
        for each in (axis, thrust):
            each.tick_params(labelsize=7)
        axis.grid(alpha=0.3, lw=0.5)
        axis.locator_params(axis="x", nbins=4)
    drawn.legend(*axes[0].get_legend_handles_labels(), loc="outside upper right", ncols=4, fontsize=8)
    drawn.supylabel("N1, % (left scale); dotted: thrust of the engine, kN (right scale)", fontsize=8)
    drawn.supxlabel("time, s", fontsize=8)
    return drawn
