"""A few time constants that lie where the data put them, where these are surely likelier than a smooth spectrum."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from thrustd.identify.regression.past import missed_less, walked
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.shape import Point, Shape
from thrustd.identify.regression.solve import Progress, Solution, solve, surprise
from thrustd.identify.segments import Segment

SURE = float(np.log(20.0))  # of the likelihood, by which a law takes the place of the usual one: 95 %
TOGETHER = 0.5  # of the distance at which lags begin: nearer ones are one


def by_few(
    found: Solution, segments: Sequence[Segment], records: Sequence[Record], progress: Progress | None
) -> Solution:
    """The same mount with a few lags that lie where the data put them, where these are surely likelier so.

    A power law is a smooth spectrum; a rubber of a few modes is not, and two neighbours of a dense set follow a lag
    between them but for an error that lasts, which is then taken for friction, or for a walk of the cell. A cell that
    surely does walk (`with_walk`) is no cause to leave the spectrum.
    """
    if not found.point.gain.any():
        return found
    ends = float(found.shape.taus_s[0]), float(found.shape.taus_s[-1])
    loose = replace(found.shape, move=True, limits_s=ends)
    moved = solve(loose, found.point, records, found.precisions, progress=progress)
    few = solve(*_gathered(moved.shape, moved.point), records, moved.precisions, progress=progress)

    def unlikely(one: Solution) -> float:
        return surprise(one, few.noise_variance)

    least = unlikely(few) + 2.0 * SURE
    if unlikely(found) <= least:
        return found
    walking = walked(found, segments, records, progress)
    if walking is not None and missed_less(walking, found) and unlikely(walking) <= least:
        return found
    return few


def _gathered(shape: Shape, point: Point) -> tuple[Shape, Point]:
    """Without lags that do nothing; those that have come together are one, at their mean by gain."""
    logs, gain = (each[np.argsort(point.log_tau)] for each in (point.log_tau, point.gain))
    logs, gain = logs[gain != 0.0], gain[gain != 0.0]
    spacing = float(np.diff(np.log(shape.taus_s)).mean())
    groups = np.cumsum(np.diff(logs, prepend=logs[:1]) > TOGETHER * spacing)
    sums = np.bincount(groups, gain).astype(np.float64)
    means = np.bincount(groups, gain * logs) / sums
    return replace(shape, taus_s=np.exp(means)), replace(point, log_tau=means, gain=sums)
