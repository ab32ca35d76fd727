"""The estimator: records -> posterior of a mount model (spline curve, one relaxation, friction, output curve).

    w = f(d);   x = w + sum_i g_i (w - L_i w);   F = h(x) + offset + (1 + kappa |d|) sum_i c_i stop_i(d) + F_f z(d)

with f and h splines under a prior on their roughness, L_i first-order lags on a fixed log-spaced set of time
constants from two samples to four times the longest record, sixteen friction stops, and one friction that yields
(`friction`). Strengths of all priors and the level of the noise by evidence (`solve`); g_i >= 0 and c_i >= 0, because
a mount dissipates.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import reduce
from itertools import compress

import numpy as np

from thrustd.core.blas import one_thread
from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError
from thrustd.identify.first_state import Beginning
from thrustd.identify.regression.curve import beyond
from thrustd.identify.regression.few import SURE, by_few
from thrustd.identify.regression.free_run import simulate
from thrustd.identify.regression.friction import (
    YIELDING,
    begun,
    branched,
    branches_beside,
    by_law,
    law_of,
    yielding,
)
from thrustd.identify.regression.noise import likeliest
from thrustd.identify.regression.past import LONG_H, SWINGS, as_begun, missed_less, remembering
from thrustd.identify.regression.record import Record, head_of
from thrustd.identify.regression.shape import Point, Shape
from thrustd.identify.regression.solve import Progress, Solution, noise_level, solve, surprise
from thrustd.identify.regression.stops import radii_of
from thrustd.identify.regression.sweep import normal_equations
from thrustd.identify.regression.walk import NAMES, SIZE, hours_of, lasts_h, walks
from thrustd.identify.segments import DEFORMATION, Segment
from thrustd.model.effect import Effect

KNOTS, MANY = 24, 300_000  # coefficients of a curve; twice as many for longer data
LAGS = 20
SLOWEST = 4.0  # times the longest record: slower is a constant
FIRST = {"f": 1e-3, "gain": 30.0, "pair_gain": 30.0, "h": 1e-2, "stops": 30.0, "offset": 1.0, "begin": 1.0}
AGAIN = 2  # a mount in the noise that it leaves
YIELDS = 0.05  # of the squared error: a mount that leaves more to its noise has no laws for what lasts
RIDGE = 1e-7  # of the size of every column
TINY = 1e-3  # of the largest weight: a system that hardly answers at rest still gets a slope of this
BEGUN_BETTER = 0.9  # of the squares of the first tenth, from which on another beginning is believed


@one_thread()
def regress(
    segments: Sequence[Segment],
    progress: Progress | None = None,
    laws: Sequence[Effect] = YIELDING,
    *,
    loose: bool = True,
    settled: bool = False,
) -> Solution:
    """The most probable mount, yielding by the best of these laws; `loose`: its joints may be. No law: it does not rub.

    `settled`: no record begins with a past (`past`). RecordingError when the data tell nothing.
    """
    shape, records = prepared(segments)
    none = np.zeros(0)
    plain = replace(shape, terms=()) if laws else replace(shape, terms=(), radii=none, grows=False)  # see `begun_where`
    found, records = _unyielding(plain, segments, records, progress)
    if not settled:
        found, records = remembering(found, segments, records, progress)
    plain, shape = found.shape, replace(found.shape, terms=shape.terms)
    counts = sum(len(record.known) for record in records)

    def tried(shape: Shape, point: Point) -> Solution:
        return solve(shape, point, records, found.precisions, progress=progress)

    def best(trials: Sequence[Solution]) -> Solution:
        return reduce(lambda one, other: other if _surely(one, other, counts) else one, trials)

    if not laws:
        return tried(plain, found.point)
    begin = first_point(shape, records)
    stopless = replace(shape, radii=none, grows=False)
    alone = [replace(stopless, terms=(term,)) for law in laws for term in by_law(shape.terms[0], law, loose)]
    bare = replace(found.point, stops=none, growth=none)
    single = best([tried(one, replace(bare, terms=begun(one.terms))) for one in alone])
    whole = replace(shape, terms=single.shape.terms)
    starts = [
        replace(single.point, stops=begin.stops, growth=begin.growth),
        replace(found.point, terms=begun(whole.terms)),
    ]
    return best([tried(whole, start) for start in starts])


def _unyielding(
    plain: Shape, segments: Sequence[Segment], records: Sequence[Record], progress: Progress | None
) -> tuple[Solution, list[Record]]:
    """A mount of this shape, and the records each begun where it says."""
    found = solve(plain, first_point(plain, records), records, FIRST, progress=progress)
    settled = [replace(record, before=float(record.d[0])) for record in records]
    other = solve(plain, found.point, settled, FIRST, progress=progress)
    if other.mean_square < found.mean_square:
        found, records = other, settled
    records = [begun_where(found, record) for record in records]
    return by_few(found, segments, records, progress), records


def _surely(one: Solution, other: Solution, counts: int) -> bool:
    """Whether these data, so many of which count, are clearly likelier by the other law."""
    return counts * (one.mean_square - other.mean_square) > 2.0 * SURE * one.noise_variance


@one_thread()
def with_branches(
    found: Solution, segments: Sequence[Segment], law: Effect, progress: Progress | None = None
) -> Solution:
    """The same mount with branches of this law beside the spring, as slow as its own lags, or as these records show."""
    all_lags, records = prepared(segments)
    taus_s = found.shape.taus_s if len(found.shape.taus_s) else all_lags.taus_s
    shape = replace(found.shape, terms=(*found.shape.terms, branches_beside(found.shape, law, taus_s)))
    point = replace(found.point, terms=np.concatenate((found.point.terms, begun(shape.terms[-1:]))))
    return solve(shape, point, begun_as(found, records, segments), found.precisions, progress=progress)


def with_walk(found: Solution, segments: Sequence[Segment], progress: Progress | None = None) -> Solution:
    """The same mount, measured by a cell that walks, where these data are likelier so and miss clearly less.

    In less than LONG_H a walk looks like the memory of a mount; there it is taken for that. Begun at what the memory
    has been taken for, and at no memory with a walk of SIZE, which no large residual of the first steps can talk out
    of existence: of these two ends the likelier.

    Judged beside errors as large as those that last as long as a walk's fastest swing: what no relaxation and no stop
    says of a mount lasts for levels, and twelve modes follow a newton of it with twenty of a walk that slow memory
    takes back. A walk's own part of them is counted against it, so to be likelier is enough.
    """
    size_n = SIZE * found.shape.output_scale
    long = [lasts_h(term) >= LONG_H for term in walks(segments, size_n)]
    if not any(long):
        return found
    records = begun_as(found, prepared(segments)[1], segments)

    def ended(point: Point, *, sized: bool) -> Solution:
        walking = list(compress(walks(segments, size_n, sized), long))
        shape = replace(found.shape, terms=(*found.shape.terms, *walking))
        strengths = found.precisions | ({} if sized else {term.effect.name: 1.0 for term in walking})
        return solve(shape, point, records, strengths, progress=progress)

    still = replace(found.point, terms=np.concatenate((found.point.terms, np.zeros(sum(long) * len(NAMES)))))
    far = ended(replace(still, gain=np.zeros_like(still.gain)), sized=True)
    trials = [ended(begin, sized=False) for begin in (still, far.point)]

    lasting = noise_level(found.normal.residuals, SWINGS)

    def unlikely(one: Solution) -> float:
        return surprise(one, lasting)

    other = min(trials, key=unlikely)
    return other if unlikely(other) < unlikely(found) and missed_less(other, found) else found


def begun_as(found: Solution, records: Sequence[Record], segments: Sequence[Segment]) -> list[Record]:
    """Records of these segments with the past that the solution has of them, or rubber follows best."""
    if not found.shape.passive:
        return list(records)
    return as_begun(found, [begun_where(found, record) for record in records], segments)


def same_rubber(rubber: Solution, segments: Sequence[Segment], progress: Progress | None = None) -> Solution:
    """By the same law, with the same branches or without, on other data; what their cell walked is told here."""
    found = regress(segments, progress, [law_of(rubber.shape)])
    law = branched(rubber.shape)
    found = with_branches(found, segments, law, progress) if law is not None else found
    return in_its_noise(found, segments, progress)


def in_its_noise(found: Solution, segments: Sequence[Segment], progress: Progress | None = None) -> Solution:
    """The same mount, by a cell that walks where it does, in noise as its residual shows it: white, and what lasts.

    Only as far as the mount explains no less: what its laws miss lasts too, and noise would take over from them.
    """
    found = with_walk(found, segments, progress)
    records = begun_as(found, prepared(segments)[1], segments)
    most = (1.0 + YIELDS) * found.mean_square
    for _ in range(AGAIN):
        lasting = likeliest(found.normal.residuals, [record.dt_s for record in records])
        white = [replace(record, lasting=lasting) for record in records]
        other = solve(found.shape, found.point, white, found.precisions, progress=progress)
        if other.mean_square > most:
            break
        found = other
    return found


def prepared(segments: Sequence[Segment]) -> tuple[Shape, list[Record]]:
    """Shape and records for these data, every record begun unloaded."""
    d = [segment.inputs[DEFORMATION] for segment in segments]
    low, high = min(float(x.min()) for x in d), max(float(x.max()) for x in d)
    y = np.concatenate([segment.force_n for segment in segments])
    scale = float(np.nanstd(y))
    if not scale > 0.0 or not high > low:
        raise RecordingError(f"{segments[0].record}: nothing moves; expected records in which input and output vary")
    span = high - low
    zero = float(np.clip(0.0, low - span, high + span))  # unloaded, where that is near
    low, high = min(low, zero), max(high, zero)
    dt_s = min(segment.dt_s for segment in segments)
    longest_s = max(len(segment) * segment.dt_s for segment in segments)
    taus_s = np.geomspace(*lags_of([longest_s], dt_s), LAGS)
    knots = KNOTS * (2 if len(y) > MANY else 1)
    friction = yielding(d, scale)
    radii = radii_of(high - low, friction.fixed["deadband_mm"])
    shape = Shape(beyond(low, high, knots), zero, taus_s, radii, scale, grows=True, terms=(friction,))
    records = [
        Record(x, s.force_n / scale, s.dt_s, zero, hours_of(segments, s)) for x, s in zip(d, segments, strict=True)
    ]
    return shape, records


def lags_of(lasts_s: Sequence[float], dt_s: float) -> tuple[float, float]:
    """The fastest and the slowest time constant that records so long, sampled so, can tell."""
    return 2 * dt_s, max(SLOWEST * max(lasts_s), 8 * dt_s)


def first_point(shape: Shape, records: Sequence[Record]) -> Point:
    """A straight line through the data, no memory."""
    d = np.concatenate([record.d for record in records])
    y = np.concatenate([record.y for record in records])
    good = np.isfinite(y)
    slope, offset = np.polyfit(d[good] - shape.zero, y[good], 1)
    nothing = np.zeros
    m, p = len(shape.taus_s), len(shape.poles)
    f: Floats = slope * (shape.f_grid.centres() - shape.zero)
    return Point(
        f,
        nothing(m),
        np.log(shape.taus_s),
        nothing((p, 2)),
        shape.poles.copy(),
        nothing(shape.h_grid.n if shape.h_grid else 0),
        float(offset),
        nothing(len(shape.radii)),
        begun(shape.terms),
        nothing(shape.sizes["growth"]),
        nothing(shape.sizes["begin"]),
    )


def linear_point(shape: Shape, records: Sequence[Record]) -> Point:
    """y = offset + slope (w + sum g (w - L w) + pairs), w the deformation: linear in slope and slope times gains."""
    line: Floats = shape.f_grid.centres() - shape.zero
    point = replace(first_point(shape, records), f=line, offset=0.0)
    normal, where = normal_equations(shape, point, records), shape.parts()
    free = np.concatenate([np.arange(shape.n)[where[name]] for name in ("gain", "pair_gain", "offset")])
    basis = np.zeros((shape.n, len(free) + 1))
    basis[where["f"], 0] = line
    basis[free, 1 + np.arange(len(free))] = 1.0
    matrix = basis.T @ normal.matrix @ basis
    right = basis.T @ normal.right + matrix[:, 0]  # of y itself: the residual plus the straight line without memory
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    scaled = matrix / np.outer(size, size) + RIDGE * np.eye(len(size))
    found = np.linalg.solve(scaled, right / size) / size
    least = TINY * float(np.abs(found[:-1]).max())
    slope = float(found[0]) if abs(found[0]) > least else float(np.copysign(least, found[0] or 1.0))
    m = len(point.gain)
    return replace(
        point,
        f=slope * line,
        gain=found[1 : 1 + m] / slope,
        pair_gain=(found[1 + m : -1] / slope).reshape(-1, 2),
        offset=float(found[-1]),
    )


def begun_where(found: Solution, record: Record) -> Record:
    """As it was, or the other of unloaded and settled where the first tenth follows that clearly better.

    A load that has stood for some time is kept: fits of one record are compared sample by sample.
    """
    if record.stood:
        return record
    n, unloaded, settled = max(2, len(record) // 10), found.shape.zero, float(record.d[0])

    def missed(before: float) -> float:
        trial = head_of(record, n).after(Beginning(before))
        return float(np.nansum((trial.y - simulate(found.shape, found.point, trial)) ** 2))

    other = unloaded if record.before == settled else settled
    return replace(record, before=other) if missed(other) < BEGUN_BETTER * missed(record.before) else record
