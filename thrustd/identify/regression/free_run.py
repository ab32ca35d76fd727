"""Free runs of the model at one point: the core with what effects make of it, and what lies beside it."""

from collections.abc import Sequence

import numpy as np

from thrustd.core.columns import Floats
from thrustd.identify.regression.kernel import run
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.rows import BLOCK, begun_at, blocks
from thrustd.identify.regression.shape import Point, Shape, core_of
from thrustd.identify.regression.stops import at_rest as stops_at_rest
from thrustd.identify.regression.stops import run_stops
from thrustd.identify.regression.terms import Places, Seen, Term, deformed, inside, pushed, split, sprung, turned

ALL = slice(None)


def gain_of(parts: Sequence[tuple[Term, Floats]], seen: Seen, places: Places) -> Floats:
    """By which effects multiply the force of the core (k,)."""
    gain = np.ones(seen.d[places].size)
    for term, own in parts:
        if term.effect.site == "gain":
            gain *= turned(term, own, seen, places)
    return gain


def core_run(shape: Shape, point: Point, record: Record, seen: Seen) -> Floats:
    """Output of curves, relaxation, offset and what effects add there (n,)."""
    core, out = core_of(shape, point, record.dt_s), np.empty(len(record))
    spring = sprung(shape.terms, point.terms, seen)
    run(core, begun_at(shape, point, core, record, seen), seen.d, spring, out)
    out += point.offset
    for term, own in zip(shape.terms, split(shape.terms, point.terms), strict=True):
        if inside(term):
            out += pushed(term, own, seen, ALL) / shape.output_scale
    return out


def friction(shape: Shape, point: Point, record: Record, seen: Seen) -> Floats:
    """Of the core (n,)."""
    state, out = stops_at_rest(shape.radii, record.before), np.zeros(len(record))
    if not np.any(point.stops):
        return out
    rub = np.empty((BLOCK, len(shape.radii)))
    for part in blocks(len(record)):
        m = part.stop - part.start
        run_stops(shape.radii, state, seen.d[part], rub[:m])
        out[part] = rub[:m] @ point.stops
    return out * (1.0 + point.growth[0] * np.abs(seen.d) / shape.radii[-1]) if shape.grows else out


def simulate(shape: Shape, point: Point, record: Record, places: Places = ALL) -> Floats:
    """Free run in units of the shape's scale, at these samples (k,)."""
    turned_core, beside = simulated(shape, point, record, places)
    return turned_core + beside


def simulated(shape: Shape, point: Point, record: Record, places: Places = ALL) -> tuple[Floats, Floats]:
    """The core's part, with the gains applied, and friction with every effect that adds: (k,) each."""
    seen = deformed(shape.terms, point.terms, record.seen)
    parts = list(zip(shape.terms, split(shape.terms, point.terms), strict=True))
    beside = friction(shape, point, record, seen)[places]
    for term, own in parts:
        if term.effect.site == "force":
            beside = beside + pushed(term, own, seen, places) / shape.output_scale
    return gain_of(parts, seen, places) * core_run(shape, point, record, seen)[places], beside
