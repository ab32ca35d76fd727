"""The health of engines and mounts as a table, sentences and a page with its trends."""

from datetime import UTC, datetime
from functools import partial
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from thrustd.flighttest.answer import CHANGED, COLOURS, Answer, Columns
from thrustd.flighttest.fleet_health import FleetHealth, Health
from thrustd.flighttest.trend import FEWEST

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WORDS = (
    "Each flight at equal conditions (corrected N1, Mach, pressure), against the deck at the same N1. Change over all "
    "hours; slope with its 95 % interval. In the order of their dates, or as given where a log has none."
)
HEADS = "of", "quantity", "flights", "change", "unit", "slope\nper h", "95 %\nper h", "verdict"
SPOKEN = {
    "thrust_at_n1_pct": "thrust at equal N1", "fuel_at_n1_pct": "fuel flow at equal N1",
    "n2_at_n1_pct": "N2 at equal N1", "load_share": "upper mount's share", "zero_mm": "zero",
}  # fmt: skip
ACROSS = 4  # drawings in a row
SHORT_H = 10.0  # told to a tenth


def table_rows(found: FleetHealth) -> list[list[str]]:
    """Under HEADS."""
    return [
        [one.of, SPOKEN[one.quantity], f"{one.trend.flights}", *_numbers(one), _verdict(one)]
        for one in found.health
        if one.trend.flights
    ]


def lines(found: FleetHealth) -> list[str]:
    """What changed, and when what has to be calibrated again."""
    said = [_changed(one) for one in found.changed]
    if not said:
        n = len(found.flights)
        said = [
            f"nothing changed over {n} flights" if n >= FEWEST else f"{_flights(n)}; {FEWEST} or more tell a change"
        ]
    without = len(found.without_mounts)
    if without:
        said.append(f"no mounts in {without} of {_flights(len(found.flights))}: nothing measures the thrust there")
    if taken := len(found.without_zeros):
        said.append(f"no zeros of mounts in {taken} of {_flights(len(found.flights))}: exported without; give the log")
    for one in found.health:
        if isfinite(one.recalibrate_in_h):
            hours = one.recalibrate_in_h
            by = f"{hours:.{int(hours < SHORT_H)}f} h of flight after the first{_date(one)}"
            said.append(f"{one.of}, {SPOKEN[one.quantity]}: recalibrate by {by}")
    return said


def _flights(number: int) -> str:
    return f"{number} flight{'s' * (number != 1)}"


def answer(found: FleetHealth) -> Answer:
    table = Columns("What changed", HEADS, table_rows(found))
    title = f"Health over {_flights(len(found.flights))}"
    return Answer(found, title, WORDS, [table], lines(found), partial(figure, found))


def figure(found: FleetHealth) -> "Figure":
    """One small drawing per quantity, with its trend or step."""
    from matplotlib.figure import Figure

    series = [one for one in found.health if one.trend.flights]
    down = max(-(-len(series) // ACROSS), 1)
    drawn = Figure(figsize=(14, 2.6 * down), layout="constrained")
    axes = drawn.subplots(down, ACROSS, squeeze=False).ravel().tolist()
    for axis in axes:
        axis.set_visible(False)
    for axis, one in zip(axes, series, strict=False):
        hours, values = np.array(one.hours), np.array(one.values)
        axis.set_visible(True)
        axis.plot(hours, values, "o", ms=3, color=CHANGED if one.trend.changed else COLOURS[0])
        if one.trend.kind == "step":
            axis.axvline(one.hours[one.trend.since_flight - 1], color=CHANGED, lw=1)
        elif isfinite(one.trend.slope):
            axis.plot(hours, np.nanmean(values) + one.trend.slope * (hours - hours.mean()), color="#888888", lw=1)
        axis.set_title(f"{one.of}: {_verdict(one)}", fontsize=8, color=CHANGED if one.trend.changed else "#888888")
        axis.set_ylabel(f"{SPOKEN[one.quantity]}, {one.unit}", fontsize=7)
        axis.tick_params(labelsize=7)
        axis.grid(alpha=0.3, lw=0.5)
    drawn.suptitle("Each point a flight, minus the mean of all", x=0.01, ha="left", fontsize=10)
    drawn.supxlabel("hours flown", fontsize=8)
    return drawn


def _changed(one: Health) -> str:
    by = "" if one.engine in ("", one.of) else f", by {one.of}"
    size = f"{one.trend.change:+.2g} {one.unit}".removesuffix(" -")
    return f"{one.engine or one.of}: {SPOKEN[one.quantity]} changed by {size}{by}: {_since(one)}"


def _numbers(one: Health) -> tuple[str, str, str, str]:
    trend = one.trend
    if not isfinite(trend.slope):
        return "-", one.unit, "-", "-"
    return f"{trend.change:+.3g}", one.unit, f"{trend.slope:+.3g}", f"{trend.slope_low:+.2g} to {trend.slope_high:+.2g}"


def _verdict(one: Health) -> str:
    return _since(one) if one.trend.changed else "too few flights" if not isfinite(one.trend.slope) else "steady"


def _since(one: Health) -> str:
    return f"step at flight {one.trend.since_flight}" if one.trend.kind == "step" else "trend"


def _date(one: Health) -> str:
    if not isfinite(one.recalibrate_utc_s) or one.recalibrate_utc_s > 7e9:
        return ""
    return f", {datetime.fromtimestamp(one.recalibrate_utc_s, UTC):%Y-%m-%d} at the present use"
