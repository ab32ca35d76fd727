"""What a mount remembers when a record begins under load: rest, a first load that has stood for a while, or anything.

Three hypotheses of one record, and beside them a cell that walks, which looks alike for as long as a memory fades. The
evidence says which. In a load that has stood, all lags have one number in common, and how they go on forgetting tells
their gains; where several loads came before, every lag has a number of its own.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import logsumexp

from thrustd.identify.first_state import LOADED, MOST, STOOD, Beginning, first_level
from thrustd.identify.regression.curve import travel
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.shape import Shape
from thrustd.identify.regression.solve import Progress, Solution, noise_level, solve, surprise
from thrustd.identify.regression.walk import NAMES, SIZE, lasts_h, walks
from thrustd.identify.segments import DEFORMATION, Segment

WALK_WORTH = 0.03  # of the squared error: a walk that removes less is left out
LONG_H = 0.5  # of a recording that tells a walk
SWINGS = 2 * len(NAMES)  # blocks of a recording, two of every half swing of its fastest mode
FINER = 2  # times that how long a load has stood is looked for at half the distance
PAST = float(np.log(1e4))  # of the likelihood, by which a past under load takes the place of rest, or of a walk

Begun = tuple[Solution, list[Record]]  # a mount, and the records with the past that it gives them


def remembering(
    found: Solution, segments: Sequence[Segment], records: Sequence[Record], progress: Progress | None
) -> Begun:
    """The same mount, remembering a past under load, where these data are surely likelier so.

    The first load may have stood for some time after none, or others before it, of which every lag may remember
    anything. Likelier than from rest, and than by a cell that walks, which looks alike for as long as a memory fades.
    """
    places = places_of(found.shape, segments)
    if not counted(places):
        return found, list(records)
    lasting = noise_level(found.normal.residuals, SWINGS)

    def unlikely(one: Solution) -> float:
        return surprise(one, lasting)

    shape, rows = _placed(found.shape, records, places)
    point = replace(found.point, begin=np.zeros(shape.sizes["begin"]))
    begun = solve(shape, point, rows, found.precisions | {"begin": 1.0}, progress=progress)
    walking = walked(found, segments, records, progress)
    least = min(unlikely(one) for one in (found, walking) if one is not None) - 2.0 * PAST
    stood = {share: _stood(found, records, places, share, progress) for share in STOOD.tolist()}
    tried = [one for one, _ in stood.values()]
    likeliest = min(map(unlikely, tried))
    any_time = likeliest - 2.0 * logsumexp([0.5 * (likeliest - unlikely(one)) for one in tried])
    any_time += 2.0 * np.log(len(tried))
    if min(unlikely(begun), any_time) > least:
        return found, list(records)
    if unlikely(begun) < any_time:
        return begun, rows
    return _likeliest(stood, lambda share: _stood(found, records, places, share, progress))


def _likeliest(stood: dict[float, Begun], tried: Callable[[float], Begun]) -> Begun:
    """By how long the first load has stood, as shares of the records; looked for between these as well.

    In the noise of the one that leaves least: what lasts from rest would hide which of them is right.
    """
    least = min((one for one, _ in stood.values()), key=lambda one: one.mean_square)
    left, apart = noise_level(least.normal.residuals, SWINGS), STOOD[1] / STOOD[0]

    def best() -> float:
        return min(stood, key=lambda share: surprise(stood[share][0], left))

    for _ in range(FINER):
        share, apart = best(), np.sqrt(apart)
        stood = stood | {one: tried(one) for one in (share / apart, share * apart)}
    return stood[best()]


def _stood(
    found: Solution, records: Sequence[Record], places: Sequence[int | None], share: float, progress: Progress | None
) -> Begun:
    """The same mount, the first load of loaded records there for such a share of their time before, after none."""
    stood = tuple(
        0 if place is None else round(share * min(len(record), MOST))
        for place, record in zip(places, records, strict=True)
    )
    rows = _after(records, found.shape.zero, stood)
    return solve(replace(found.shape, stood=stood), found.point, rows, found.precisions, progress=progress), rows


def _after(records: Sequence[Record], zero: float, stood: Sequence[int]) -> list[Record]:
    return [one.after(Beginning(zero, n)) if n else one for one, n in zip(records, stood, strict=True)]


def _placed(shape: Shape, records: Sequence[Record], places: Sequence[int | None]) -> tuple[Shape, list[Record]]:
    """With numbers for what these records remember when they begin."""
    rows = [replace(record, place=place) for record, place in zip(records, places, strict=True)]
    return replace(shape, begun=counted(places)), rows


def walked(
    found: Solution, segments: Sequence[Segment], records: Sequence[Record], progress: Progress | None
) -> Solution | None:
    """The same mount, measured by a cell that walks; None in recordings that are too short to tell."""
    terms = [term for term in walks(segments, SIZE * found.shape.output_scale) if lasts_h(term) >= LONG_H]
    if not terms:
        return None
    shape = replace(found.shape, terms=(*found.shape.terms, *terms))
    point = replace(found.point, terms=np.concatenate((found.point.terms, np.zeros(len(terms) * len(NAMES)))))
    strengths = found.precisions | {term.effect.name: 1.0 for term in terms}
    return solve(shape, point, records, strengths, progress=progress)


def missed_less(walking: Solution, found: Solution) -> bool:
    """Whether a walk takes away so much that it is believed."""
    return walking.mean_square < (1.0 - WALK_WORTH) * found.mean_square


def as_begun(found: Solution, records: Sequence[Record], segments: Sequence[Segment]) -> list[Record]:
    """With the past that the solution has of them."""
    if found.shape.begun:
        return _placed(found.shape, records, places_of(found.shape, segments))[1]
    stood = found.shape.stood
    return _after(records, found.shape.zero, stood) if len(stood) == len(records) else list(records)


def places_of(shape: Shape, segments: Sequence[Segment]) -> list[int | None]:
    """Of records among those of which a point knows how they begin: of rubber, those that begin under a load."""
    least, found = LOADED * travel(shape.f_grid), list[int | None]()
    for segment in segments:
        loaded = abs(first_level(segment.inputs[DEFORMATION], segment.dt_s) - shape.zero) > least
        found.append(counted(found) if loaded or not shape.passive else None)
    return found


def counted(places: Sequence[int | None]) -> int:
    """How many have one."""
    return sum(place is not None for place in places)
