"""Where a record begins: the state of a model at the first sample, told by the first stretch of the record itself.

Recordings of other people begin anywhere: levels half way down, springs still swinging. A model that starts at rest is
then wrong for as long as its memory lasts, which says nothing about the model. What the state is follows from what came
before, so that is what is estimated: an input before the first sample, at rest at one level and then moving through
others, held for 1, 2, 4, ... samples. It suits every structure, with hysteresis or without; no state has to be known.

Gauss-Newton with finite differences; levels stay near what the record reaches, for rubber never forgets its largest
load, and the residual of the rest of the record is its noise. The start at rest stays unless what the stretch gains is
worth the levels (BIC) and the rest of the record, which they were not fitted to, does not lose it again: a model that
is wrong for minutes would else be given a past, which a slow branch carries through all of the record.

At rest means settled under the first load, or under none until that came, whichever the stretch speaks for: a bench
record often begins when the load does, or some minutes later (`Beginning`). How long that load has stood is one number,
and all that relaxes has it in common.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from thrustd.core.columns import Floats
from thrustd.identify.levenberg import search
from thrustd.identify.segments import DEFORMATION, Segment, head

Simulate = Callable[[Segment], Floats]
Samples = NDArray[np.intp]

SHARE, FEWEST, LONGEST = 0.1, 30, 20_000  # of the record, samples: the stretch that tells the state
HELD = (1, 8192, 2048, 512, 128, 64, 32, 16, 8, 4, 2, 1)  # samples per level, the oldest first: there the model rests
SHORT = 128  # samples; levels held for longer than this serve stretches that are longer
ITERATIONS, DONE = 12, 1e-4  # steps, relative fall of the squares that ends them
REACH = 0.25  # of the input's range: so far beyond it may the past have been
STEP = 1e-3  # of the input's range
SETTLING = 0.05  # of a segment that starts at rest: that is a guess
MEDIAN_SQUARE = 0.455  # of Gaussian noise of mean square 1


UNLOADED = 0.0
BEGUN_BETTER = 0.9  # of the stretch's sum of squares, from which on another beginning is believed
FIRST_S = 1.0  # whose mean is the first level
LOADED = 0.02  # of the input's range: what begins nearer to no load has not stood under any
FINE = 0.03  # of how long it has stood: as fine as is looked for
STOOD, MOST = np.geomspace(1e-3, 1.0, 10), 200_000  # of a record, samples: how long its first load may have stood


class Beginning(NamedTuple):
    """What came before the first sample: rest at `before`, then so many samples at the first level."""

    before: float
    stood: int = 0


def beginning_of(simulate: Simulate, segment: Segment) -> Beginning:
    """After what the segment begins, by its first stretch: settled, unless another past is clearly better."""
    n, d = stretch_of(segment), segment.inputs[DEFORMATION]
    settled, start = Beginning(float(d[0])), head(segment, n)
    if n == 0 or settled.before == UNLOADED:
        return settled

    def missed(beginning: Beginning) -> float:
        return float(np.nansum((start.force_n - run_from(simulate, start, beginning)) ** 2))

    with np.errstate(all="ignore"):
        worst = BEGUN_BETTER * missed(settled)
        loaded = abs(first_level(d, segment.dt_s) - UNLOADED) > LOADED * float(np.ptp(np.append(d, UNLOADED)))
        found = _stood(missed, min(len(d), MOST)) if loaded else Beginning(UNLOADED)
        return found if missed(found) < worst else settled


def _stood(missed: Callable[[Beginning], float], longest: int) -> Beginning:
    """How long the first load has stood after none: the best of all orders of magnitude, and between them."""
    tried = [0, *(round(share * longest) for share in STOOD)]
    squares = [missed(Beginning(UNLOADED, n)) for n in tried]
    k = int(np.argmin(squares))
    near = [n for n in tried[max(k - 1, 0) : k + 2] if n]
    if len(near) < 2:
        return Beginning(UNLOADED, tried[k])

    def at(log: float) -> Beginning:
        return Beginning(UNLOADED, round(np.exp(log)))

    between = minimize_scalar(
        lambda log: missed(at(log)), bounds=np.log(near[:: len(near) - 1]), options={"xatol": FINE}
    )
    return at(between.x) if between.fun < squares[k] else Beginning(UNLOADED, tried[k])


def first_level(d: Floats, dt_s: float) -> float:
    """The input (n,) at which a record begins."""
    return float(d[: max(round(FIRST_S / dt_s), 1)].mean())


Beginnings = Mapping[tuple[str, float], Beginning]  # by record and start of the segment


def beginnings_of(simulate: Simulate, segments: Sequence[Segment]) -> Beginnings:
    """After what segments begin."""
    return {(s.record, s.start_s): beginning_of(simulate, s) for s in segments}


def known_beginning(simulate: Simulate, segment: Segment, known: Beginnings) -> Beginning:
    """As `beginning_of`; where the first stretch is held back, as the same record was known to begin."""
    if stretch_of(segment) == 0 and (segment.record, segment.start_s) in known:
        return known[segment.record, segment.start_s]
    return beginning_of(simulate, segment)


def begun_at(segment: Segment, beginning: Beginning) -> Segment:
    """The segment with this past in front, without reference."""
    front = _front(segment, beginning)
    return _extended(segment, front) if len(front) else segment


def run_from(simulate: Simulate, segment: Segment, beginning: Beginning) -> Floats:
    """Free run (n,) behind this past."""
    past = begun_at(segment, beginning)
    return simulate(past)[len(past) - len(segment) :]


def _front(segment: Segment, beginning: Beginning) -> Floats:
    d = segment.inputs[DEFORMATION]
    if beginning == Beginning(float(d[0])):
        return np.empty(0)
    return np.concatenate(([beginning.before], np.full(beginning.stood, first_level(d, segment.dt_s))))


def of_the_past(simulate: Simulate, segment: Segment) -> Floats:
    """(n, levels): what one sigma of every level before the first sample would add to a run settled at that sample.

    A level may be anything between no load and what the segment reaches: one sigma is its mean distance from the first.
    """
    u, held = segment.inputs[DEFORMATION], _held(len(segment))
    low, high = min(float(u.min()), UNLOADED), max(float(u.max()), UNLOADED)
    middle, rest = (low + high) / 2 - float(u[0]), np.full(len(held), u[0])
    sigma = float(np.hypot((high - low) / np.sqrt(12.0), middle)) * (-1.0 if middle < 0 else 1.0)
    settled = simulate(segment)
    return np.column_stack([_after(simulate, segment, rest + sigma * e, held) - settled for e in np.eye(len(held))])


def simulated(simulate: Simulate, segment: Segment, from_rest: Floats) -> Floats:
    """Free run (n,) over the segment, from the state that its first stretch shows; from_rest: the run from rest."""
    levels = _levels(simulate, segment, segment.force_n - from_rest)
    return from_rest if levels is None else _after(simulate, segment, levels, _held(stretch_of(segment)))


def begun(simulate: Simulate, segments: Sequence[Segment]) -> list[Segment]:
    """With the past that suits this model in front; where none does better, the first samples carry no weight."""
    return [with_past(simulate, segment) or _settling(segment) for segment in segments]


def _settling(segment: Segment) -> Segment:
    known = np.arange(len(segment)) >= SETTLING * len(segment)
    return replace(segment, force_n=np.where(known, segment.force_n, np.nan))


def with_past(simulate: Simulate, segment: Segment) -> Segment | None:
    """The segment with the past in front that its first stretch shows, without reference; None for a start at rest."""
    with np.errstate(all="ignore"):
        beginning = beginning_of(simulate, segment)
        levels = _levels(simulate, segment, segment.force_n - run_from(simulate, segment, beginning))
    if levels is not None:
        return _extended(segment, np.repeat(levels, _held(stretch_of(segment))))
    begun = begun_at(segment, beginning)
    return None if begun is segment else begun


def stretch_of(segment: Segment) -> int:
    """Samples of the stretch that tells the state; 0 where the record has no reference there."""
    n = min(LONGEST, max(int(SHARE * len(segment)), min(FEWEST, len(segment) // 4)))
    return n if np.isfinite(segment.force_n[:n]).sum() > 2 * len(HELD) else 0


def _levels(simulate: Simulate, segment: Segment, rested: Floats) -> Floats | None:
    """Levels of the input before the record (see `_held`), the oldest first; None for a start at rest."""
    n = stretch_of(segment)
    if n == 0 or not np.isfinite(rested[n:]).any():
        return None
    start = head(segment, n)
    u = segment.inputs[DEFORMATION]
    good = np.isfinite(start.force_n)
    reach, held = REACH * float(np.ptp(u)), _held(n)
    low, high = float(u.min()) - reach, float(u.max()) + reach

    def residual(levels: Floats) -> Floats:
        out = _after(simulate, start, levels, held)
        return np.asarray((start.force_n - out)[good], float)

    with np.errstate(all="ignore"):
        noise = _usual_square(rested[n:])
        begins = [np.full(len(held), level) for level in (u[0], u.min(), u.max())]
        found, cost = _searched(residual, begins[0], begins[0], (low, high), noise)
        if cost > noise * good.sum():  # worse than the rest: behind an even curve a state and its opposite look alike
            others = [_searched(residual, begin, begins[0], (low, high), noise) for begin in begins[1:]]
            found, cost = min([(found, cost), *others], key=lambda end: end[1])
        begun = segment.force_n - _after(simulate, segment, found, held)
        gained = [float(np.nansum(rested[:m] ** 2) - np.nansum(begun[:m] ** 2)) for m in (n, len(begun))]
    return found if min(gained) > len(held) * np.log(good.sum()) * noise else None


def _usual_square(missed: Floats) -> float:
    """Mean square of the part that is followed: a wrong start may be wrong for half of a record."""
    squares = missed**2
    return min(float(np.nanmean(squares)), float(np.nanmedian(squares)) / MEDIAN_SQUARE)


def _searched(
    residual: Callable[[Floats], Floats], begin: Floats, rest: Floats, bounds: tuple[float, float], noise: float
) -> tuple[Floats, float]:
    """Levels and the sum of squares there, looked for from `begin`; the nearer to `rest` the better."""
    first = residual(begin)
    spread = bounds[1] - bounds[0] or 1.0
    prior = max(noise, 1e-12 * float(first @ first)) / spread**2
    nudge = STEP * spread

    def cost(levels: Floats) -> float:
        missed = residual(levels)
        total = float(missed @ missed) + prior * float((levels - rest) @ (levels - rest))
        return total if np.isfinite(total) else np.inf

    def normal(levels: Floats) -> tuple[Floats, Floats]:
        missed = residual(levels)
        columns = np.column_stack([(missed - residual(levels + nudge * e)) / nudge for e in np.eye(len(levels))])
        matrix = columns.T @ columns + prior * np.eye(len(levels))
        return matrix, columns.T @ missed - prior * (levels - rest)

    low, high = (np.full(len(begin), bound) for bound in bounds)
    levels = search(begin, cost, normal, (low, high), ITERATIONS, DONE)
    missed = residual(levels)
    return levels, float(missed @ missed)


def _held(stretch: int) -> Samples:
    """Samples per level, the oldest first."""
    return np.array([n for n in HELD if n <= max(stretch, SHORT)])


def _after(simulate: Simulate, segment: Segment, levels: Floats, held: Samples) -> Floats:
    """Free run (n,) over the segment after a past of these levels."""
    before = np.repeat(levels, held)
    return simulate(_extended(segment, before))[len(before) :]


def _extended(segment: Segment, before: Floats) -> Segment:
    """The segment with these inputs in front, other channels as they were at first."""
    inputs = {
        name: np.concatenate((np.full(len(before), column[0]), column)) for name, column in segment.inputs.items()
    }
    inputs[DEFORMATION] = np.concatenate((before, segment.inputs[DEFORMATION]))
    force_n = np.concatenate((np.full(len(before), np.nan), segment.force_n))
    start_s = segment.start_s - len(before) * segment.dt_s
    return replace(segment, start_s=start_s, inputs=inputs, force_n=force_n)
