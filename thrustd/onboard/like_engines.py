"""Before a flight: what the sensors of engines that run say of each other, and one engine against the other.

    x_fuel = ln w,   x_N1 = H(N1),   x_N2 = H(N2)        w: corrected fuel flow, H: the deck's lines of that engine

of one engine        x_fuel - x_N1,  x_fuel - x_N2       sigma: its appetite and that line's own error
                     x_N1 - x_N2                         both lines' own errors: the appetite is common to both
of two engines       x_fuel - (x_N1 + x_N2) / 2, left minus right: like engines burn alike at like speeds, whatever
                     deck, altitude and temperature say of both

Sigmas are the bank's (`sensors.errors`), the gate is the filter's: one false alarm in 10 000. What the throttle moved
by while it was heard is no contradiction: a fuel flow leads its spools.
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from math import hypot, isfinite, nan, sqrt
from typing import NamedTuple

from thrustd.brochure.deck import Deck
from thrustd.brochure.deck_curves import DeckInputs
from thrustd.core.signals import RUNS_PCT
from thrustd.fusion.settings import FusionSettings
from thrustd.sensors.errors import APPETITE, LINE
from thrustd.sensors.monitor_inputs import ENGINE_SIGNALS, Sensor

GATE = sqrt(FusionSettings().gate_chi2)
NAMES = ("fuel flow", "N1", "N2")
PAIRS = ((0, 1, hypot(APPETITE, LINE[0])), (0, 2, hypot(APPETITE, LINE[1])), (1, 2, hypot(*LINE)))
LIKE = sqrt(2.0) * hypot(APPETITE, hypot(*LINE) / 2.0)
Middle = Mapping[Sensor, float]


class Heard(NamedTuple):
    """Medians of the readings: of all that was heard, of its first and of its second half."""

    middle: Middle
    begin: Middle
    end: Middle


def running_engines(heard: Heard, deck: Deck, engines: Sequence[str]) -> Iterator[str]:
    """Contradictions of their fuel flow and spools, a line each."""
    appetites: dict[str, tuple[float, float]] = {}
    for number, name in enumerate(engines):
        if not max(heard.middle.get((spool, number), nan) for spool in ENGINE_SIGNALS[1:]) > RUNS_PCT:
            continue
        x, begin, end = (deck.log_flows(_inputs(medians, number), number) for medians in heard)
        moved = [abs(b - a) for a, b in zip(begin, end, strict=True)]
        for i, j, std in PAIRS:
            yield from _said(f"{name}: {NAMES[i]} against {NAMES[j]}", x[i] - x[j], GATE * std + moved[i] + moved[j])
        appetites[name] = x[0] - (x[1] + x[2]) / 2.0, max(moved)
    for (one, (more, moved_one)), (other, (less, moved_other)) in combinations(appetites.items(), 2):
        limit = GATE * LIKE + moved_one + moved_other
        yield from _said(f"{one} against {other}: fuel flow at the speed of the spools", more - less, limit)


def _inputs(medians: Middle, engine: int) -> DeckInputs:
    air = [medians.get((name, 0), nan) for name in ("mach", "pressure_altitude_m", "sat_degC")]
    return DeckInputs._make([*(medians.get((name, engine), nan) for name in ENGINE_SIGNALS), *air, 0.0])


def _said(what: str, off: float, limit: float) -> Iterator[str]:
    if isfinite(off) and abs(off) > limit:
        yield f"{what}: off by {off:.3g} in ln of the fuel flow, expected within {limit:.2g}"
