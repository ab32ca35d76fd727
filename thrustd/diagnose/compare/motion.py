"""How a mount moves at every sample, in measures that its own record gives: nothing here has a unit of its own.

Noise of the deformation (median second difference) and its span say what is a movement: less than `width` is none. The
speed above which half of the way is made is the typical one, a small share of it is holding.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from thrustd.core.columns import Floats
from thrustd.core.jit import compiled

MAD = 1.4826  # median absolute value of normal noise -> sigma
NOISES = 6.0  # sigmas that noise alone does not make in a record
LEAST_TURN = 5e-3  # of the span: a shorter way back is no reversal
HOLDING = 0.05  # of the typical speed


class Motion(NamedTuple):
    """Arrays (n,) of one record with a uniform step; lengths in the unit of the deformation."""

    velocity: Floats  # per second, centred
    moving: NDArray[np.bool_]
    direction: Floats  # +1 or -1: of the last movement; 0 before the first
    since_s: Floats  # since the last reversal
    since_travel: Floats  # travel since the last reversal
    held_s: Floats  # since it moved last
    newest: NDArray[np.bool_]  # at a new extreme
    travel: Floats  # way from the beginning
    typical: float  # speed above which half of the way is made
    stroke: float  # typical way between two reversals


def motion_of(deformation: Floats, dt_s: float) -> Motion:
    noise, span = _noise(deformation), float(np.ptp(deformation))
    width = max(NOISES * noise, LEAST_TURN * span, 1e-300)
    typical = _typical(deformation, dt_s, noise)
    least = NOISES * np.sqrt(2.0) * noise / max(HOLDING * typical * dt_s, 1e-300)
    velocity = _velocity(deformation, int(np.clip(least, 1, max(1, len(deformation) // 20))), dt_s)
    follower, direction = _follow(deformation, width)
    travel = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(follower)))))
    moving = np.abs(velocity) > HOLDING * typical
    index = np.arange(len(deformation))
    turned = _last(np.concatenate(([True], np.diff(direction) != 0)), index)
    since = travel - travel[turned]
    far = np.maximum.accumulate(np.abs(follower))
    strokes = since[np.append(np.flatnonzero(np.diff(turned) > 0), len(index) - 1)]
    return Motion(
        velocity,
        moving,
        direction,
        np.asarray((index - turned) * dt_s, dtype=np.float64),
        since,
        np.asarray((index - _last(moving, index)) * dt_s, dtype=np.float64),
        np.abs(deformation) >= far - width,
        travel,
        typical,
        _middle_of(strokes),
    )


def thinned(motion: Motion, stride: int) -> Motion:
    """Every so many-th sample of it."""
    arrays = {name: part[::stride] for name, part in motion._asdict().items() if isinstance(part, np.ndarray)}
    return Motion(**(motion._asdict() | arrays))


def _noise(column: Floats) -> float:
    second = np.diff(column, 2)
    return MAD * float(np.median(np.abs(second))) / np.sqrt(6.0) if second.size else 0.0


def _typical(column: Floats, dt_s: float, noise: float) -> float:
    """Speed above which half of the way is made, over as few samples as let it stand out of the noise."""
    steps = 1
    while True:
        way = np.abs(column[steps::steps] - column[:-steps:steps])
        middle = _middle_of(way)
        if middle >= NOISES * noise or 20 * steps >= len(column):
            return middle / (steps * dt_s)
        steps *= 2


def _middle_of(ways: Floats) -> float:
    """The one above which half of the sum is made."""
    ordered = np.sort(ways)
    total = np.cumsum(ordered)
    return float(ordered[np.searchsorted(total, total[-1] / 2)]) if total.size and total[-1] > 0 else 0.0


def _velocity(column: Floats, steps: int, dt_s: float) -> Floats:
    before, after = steps // 2, steps - steps // 2
    padded = np.pad(column, (before, after), mode="edge")
    velocity: Floats = (padded[steps:] - padded[:-steps]) / (steps * dt_s)
    return velocity


def _last(found: NDArray[np.bool_], index: NDArray[np.intp]) -> NDArray[np.intp]:
    """Place of the last one that was found, at every sample; the first sample before there is any."""
    places: NDArray[np.intp] = np.maximum.accumulate(np.where(found, index, 0))
    return places


def _follow_loop(column: Floats, width: float, follower: Floats, direction: Floats) -> None:
    place, way = column[0], 0.0
    for i in range(len(column)):
        if column[i] > place + (0.0 if way > 0 else width):
            place, way = column[i], 1.0
        elif column[i] < place - (0.0 if way < 0 else width):
            place, way = column[i], -1.0
        follower[i] = place
        direction[i] = way


_compiled_follow = compiled(_follow_loop)


def _follow(column: Floats, width: float) -> tuple[Floats, Floats]:
    """The way that is made, turning only after `width` back; and the direction of the last movement."""
    follower, direction = np.empty_like(column), np.empty_like(column)
    _compiled_follow(np.ascontiguousarray(column), width, follower, direction)
    return follower, direction
