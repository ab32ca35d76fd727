"""A solution as the artifact keeps it, and back: what was learnt on the bench is the prior of the next record."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import compress

import numpy as np
from scipy.linalg import block_diag

from thrustd.core.columns import Flags, Floats
from thrustd.identify.regression import walk
from thrustd.identify.regression.curve import Grid, travel
from thrustd.identify.regression.noise import Lasting
from thrustd.identify.regression.shape import Point, Shape
from thrustd.identify.regression.solve import Solution
from thrustd.identify.regression.stops import radii_of
from thrustd.identify.regression.terms import Term, split
from thrustd.model.artifact import Estimated, Posterior
from thrustd.model.effects import effect_named
from thrustd.model.effects.hysteresis_stops import EFFECT as STOPS
from thrustd.model.effects.hysteresis_stops import GROWTH, USUAL, WEIGHTS
from thrustd.model.stage import DEFORMATION

WALK = "walk"  # among the strengths of a posterior
GIVEN = 1e8  # information on a number that was given: as good as known


def kept(found: Solution, effects: Sequence[str] = ()) -> Posterior:
    """Mean and information of the core, and of those of these effects that read nothing but the deformation: what one
    does the other could, and data tell their sum.

    Other terms, where poles may lie and how each record began are integrated out.
    """
    shape, where = found.shape, found.shape.parts()
    beside = [term.effect.name in effects and set(term.effect.channels) <= {DEFORMATION} for term in shape.terms]
    own = np.arange(shape.n) < where["terms"].start
    own[where["log_tau"]] = own[where["log_pole"]] = False
    own[where["terms"]] = np.repeat(beside, [len(term.free) for term in shape.terms])
    base = _over(found.information, own)
    grid, h_grid = shape.f_grid, shape.h_grid
    lower = base[np.tril_indices(len(base))]
    return Posterior(
        (grid.low, grid.high, grid.n),
        shape.zero,
        [float(tau) for tau in np.exp(found.point.log_tau)],
        shape.output_scale,
        [float(value) for value in found.point.vector(shape)[own]],
        [float(value) for value in lower],
        float(np.sqrt(found.noise_variance)) * shape.output_scale,
        float(np.sqrt(found.mean_square)) * shape.output_scale,
        _strengths(found),
        [(float(a), float(b)) for a, b in found.point.log_pole],
        (h_grid.low, h_grid.high, h_grid.n) if h_grid else None,
        "zoh" if shape.hold == "zoh" else "foh",
        shape.passive,
        max(len(shape.radii) - len(USUAL), 0),
        [_estimated(term) for term in compress(shape.terms, beside)],
        (found.lasting.ratio, found.lasting.tau_s) if found.lasting else None,
    )


def _strengths(found: Solution) -> dict[str, float]:
    """Of the groups, and of the walk of the reference: of an hour's."""
    sizes = found.shape.sizes
    kept = {name: float(value) for name, value in found.precisions.items() if name in sizes and name != "begin"}
    size_n = walk.told(found.shape.terms, found.precisions)
    return kept if not size_n else kept | {WALK: (found.shape.output_scale / size_n) ** 2}


def walk_n(posterior: Posterior) -> float:
    """One sigma of an hour's walk of the reference, N."""
    strength = posterior.strengths.get(WALK)
    return posterior.output_scale / strength**0.5 if strength else 0.0


def lasting_of(posterior: Posterior) -> Lasting | None:
    """Of the noise."""
    return Lasting(*posterior.lasting) if posterior.lasting else None


def _estimated(term: Term) -> Estimated:
    fixed, std, centre = ({name: float(x) for name, x in one.items()} for one in (term.fixed, term.std, term.centre))
    return Estimated(term.effect.name, fixed, std, centre, term.shapes)


def with_own_stops(found: Solution) -> Solution:
    """The same mount, stops that came as an effect among its own: what is known is known of their sum."""
    shape, where = found.shape, found.shape.parts()
    places = split(shape.terms, np.arange(where["terms"].start, where["terms"].stop))
    parts = list(zip(shape.terms, places, strict=True))
    term, at = next(((term, at) for term, at in parts if term.effect is STOPS), (None, None))
    if term is None or at is None:
        return found
    values = term.values(found.point.terms[at - where["terms"].start])
    weights, own = np.array([p.amplitude for p in term.free], bool), len(shape.radii)
    came, grew = at[weights], at[~weights]  # an estimated growth: there are no own stops then
    vector, free, information = found.point.vector(shape), found.free, found.information
    if values[GROWTH.name] != 0.0 and not len(grew) and not shape.grows:  # a growth that the effect was given
        grew, vector, free = np.array([shape.n]), np.append(vector, 0.0), np.append(free, False)
        information = block_diag(information, GIVEN)
    others = np.concatenate([at for one, at in parts if one is not term] or [came[:0]])
    before, behind = np.arange(where["stops"].start), np.arange(where["begin"].start, shape.n)
    order = np.concatenate((before, grew, came, others, behind)).astype(int)  # of the new numbers, in the old vector
    there = slice(len(before) + len(grew), len(before) + len(grew) + len(came))
    unit, scale = np.array([term.std[name] for name in WEIGHTS]) / shape.output_scale, np.ones(len(order))
    scale[there], scale[len(before) : there.start] = 1.0 / unit, 1.0 / GROWTH.spread
    first = len(came) - own  # finer ones, which the mount did not have before
    last = slice(there.start + first, there.stop)
    new, freed = vector[order] / scale, free[order]
    new[len(before) : there.start] = values[GROWTH.name]
    # an effect that the model had lies about its own values
    new[there] = [values[p.name] / shape.output_scale for p in term.free if p.amplitude]
    new[last] += vector[where["stops"]]
    freed[last] |= free[where["stops"]]
    turn = np.zeros((len(vector), len(order) + own))  # old numbers of the new and, last, of the own stops as they were
    turn[order, np.arange(len(order))], turn[where["stops"], len(order) :] = scale, np.eye(own)
    turn[came[first:], len(order) :] = -np.diag(1.0 / unit[first:])
    information = _over(turn.T @ information @ turn, np.arange(turn.shape[1]) < len(order))
    gathered = _gathered(shape, term, values["travel_mm"], shape.grows or len(grew) > 0)
    return replace(found, shape=gathered, point=found.point.at(gathered, new), information=information, free=freed)


def _gathered(shape: Shape, stops: Term, travel_mm: float, grows: bool) -> Shape:
    """With these stops as the mount's own, on the radii of those that it has, or on theirs."""
    reach = travel(shape.f_grid) if len(shape.radii) else travel_mm
    terms = tuple(one for one in shape.terms if one is not stops)
    return replace(shape, radii=radii_of(reach), grows=grows, terms=terms)


def _over(information: Floats, own: Flags) -> Floats:
    """Information of these numbers, whatever the others are."""
    across, others = information[np.ix_(own, ~own)], information[np.ix_(~own, ~own)]
    unit = 1.0 / np.sqrt(np.maximum(np.diag(others), 1e-300))  # a walk that is none is known a million times better
    across = across * unit
    share = np.linalg.lstsq(others * np.outer(unit, unit), across.T, rcond=None)[0]
    known: Floats = information[np.ix_(own, own)] - across @ share
    return known


def shape_of(posterior: Posterior) -> Shape:
    """The fixed side; poles stay where the bench put them."""
    low, high, n = posterior.input_grid
    terms = tuple(Term(effect_named(e.name), e.fixed, e.std, e.centre, e.shapes, known=True) for e in posterior.effects)
    others = sum(len(term.free) for term in terms) + n + len(posterior.tau_s) + 2 * len(posterior.log_pole) + 1
    others += posterior.output_grid[2] if posterior.output_grid else 0
    stops = len(USUAL) + posterior.finer_stops
    return Shape(
        Grid(low, high, n),
        posterior.zero_mm,
        np.array(posterior.tau_s),
        radii_of(travel(Grid(low, high, n)))[-stops:] if len(posterior.mean) > others else np.zeros(0),
        posterior.output_scale,
        Grid(*posterior.output_grid) if posterior.output_grid else None,
        np.array(posterior.log_pole).reshape(-1, 2),
        posterior.hold,
        posterior.passive,
        grows=len(posterior.mean) > others + stops,
        terms=terms,
    )


def point_of(posterior: Posterior) -> Point:
    """The mean."""
    shape = shape_of(posterior)
    empty = np.zeros(0)
    p = len(shape.poles)
    blank = Point(
        empty, empty, np.log(shape.taus_s), np.zeros((p, 2)), shape.poles.copy(), empty, 0.0, empty, empty
    )  # fmt: skip
    return blank.at(shape, np.array(posterior.mean))


def information_of(posterior: Posterior) -> Floats:
    """Inverse covariance (n, n) of the mean's numbers."""
    n = len(posterior.mean)
    matrix = np.zeros((n, n))
    matrix[np.tril_indices(n)] = posterior.information
    full: Floats = matrix + np.tril(matrix, -1).T
    return full
