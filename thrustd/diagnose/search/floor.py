"""What a fit leaves, beside the least that anything could leave: both with the noise of the reading (`Base.tremble`).

In flight it is there, and what hides in it is not missed.
"""

import numpy as np

from thrustd.diagnose.search.base import Base
from thrustd.diagnose.search.joint import Joint

AT_FLOOR = 1.05  # times the floor
HARDLY = 0.05  # of what is above the floor: who leaves less has explained it
MOST = 0.5  # a cause explains the larger part
ELSEWHERE = 1.5  # times what lasts of a bench's error: so much of it may be on another record
UNLIKE = 2.0  # times the floor: so much left by no known effect is an effect that is not known
EXACTLY = 1e-300  # nothing is divided by nothing
SHOWS = 1.25  # times the floor: so much left says that something else is missing too


def left(fit: Joint, base: Base) -> float:
    """Mean square that is left; without any effect that of the model as it is, where moving its core is no better."""
    return fit.mse if fit.terms else min(fit.mse, base.own_mse, base.as_is_mse)


def before(nothing: Joint, base: Base) -> float:
    """Mean square of the model as it is: what `compare` says. In flight, where no such is known, what is left."""
    return base.as_is_mse if np.isfinite(base.as_is_mse) else left(nothing, base)


def at_floor(fit: Joint, base: Base) -> bool:
    """Nothing is left: the error is that of the instruments, or what the identification left.

    Of a model as it is the error as read, of what was fitted to these records what is white (`explains_all`).
    """
    return explains_all(fit, base) if fit.terms else over(left(fit, base), fit, base) < AT_FLOOR


def explains_all(fit: Joint, base: Base) -> bool:
    """Whether made white nothing is left, and as read no more than noise that lasts may be on another record."""
    whites = np.sqrt((fit.white + base.tremble) / max(white_floor(fit, base) + base.tremble, EXACTLY))
    return bool(whites < AT_FLOOR) and over(fit.mse, fit, base) < SHOWS


def white_floor(fit: Joint, base: Base) -> float:
    """Mean square of white errors that nothing could go below: the white part of what identification left, or less."""
    ratio = base.lasting.ratio if base.lasting else 0.0
    return min(floor_of(fit, base) ** 2, _promised(base) ** 2 / (1.0 + ratio))


def most_at_floor(fit: Joint, base: Base) -> float:
    """Mean square up to which one is at the floor of this fit."""
    return float(AT_FLOOR**2 * (floor_of(fit, base) ** 2 + base.tremble) - base.tremble)


def far_above(fit: Joint, base: Base) -> bool:
    """Whether much more than noise is left."""
    return over(left(fit, base), fit, base) > UNLIKE


def shows(fit: Joint, base: Base) -> bool:
    """Whether more than noise is left."""
    return over(left(fit, base), fit, base) > SHOWS


def something(fit: Joint, base: Base) -> bool:
    """Whether much more than noise is left, or more that a free function of the motion explains (`Base.least`)."""
    explained = left(fit, base) + base.tremble > SHOWS**2 * (base.least**2 + base.tremble)
    return far_above(fit, base) or (explained and shows(fit, base))


def over(mse: float, fit: Joint, base: Base) -> float:
    """So much left, over what nothing could go below beside this fit, as rms."""
    return float(np.sqrt((mse + base.tremble) / max(floor_of(fit, base) ** 2 + base.tremble, EXACTLY)))


def hardly_anything(mse: float, fit: Joint, base: Base) -> bool:
    """Whether so much left is hardly more than noise, or hardly anything of what this fit leaves above it."""
    level = floor_of(fit, base) ** 2
    return over(mse, fit, base) < SHOWS or mse - level < HARDLY * (left(fit, base) - level)


def signed(base: Base) -> bool:
    """Whether no sign is turned: a model that a bench told explains the larger part of these records as it is."""
    return base.benched and base.as_is_mse < MOST


def mostly(nothing: Joint, fit: Joint, base: Base) -> bool:
    """Whether effects explain most of what is left without them: above the floor, or above what the bench left.

    A core that was never exact leaves something on every record; whatever takes a little of it away is not its cause.
    """
    was, floor = left(nothing, base), floor_of(fit, base) ** 2
    bench = base.promised**2 if base.promised is not None else floor
    starts = (floor, AT_FLOOR**2 * floor), (bench, max(usual(fit, base), AT_FLOOR**2 * bench))
    return any(was > from_there and was - fit.mse > MOST * (was - level) for level, from_there in starts)


def usual(fit: Joint, base: Base) -> float:
    """Mean square that a model may leave on another record though nothing is missing; 0 where no bench says so.

    The noise is as it was; what its laws did not say on the bench lasts, and may be half as large again elsewhere. A
    bench that showed itself that something is missing says nothing.
    """
    noise = floor_of(fit, base)
    if base.promised is None or base.promised > SHOWS * noise:
        return 0.0
    return float(noise**2 + ELSEWHERE**2 * (base.promised**2 - noise**2))


def floor_of(fit: Joint, base: Base) -> float:
    """Rms that nothing could go below: the noise, or what no free function of the motion explains (`Base.least`).

    That one as far as identification did not promise less.
    """
    return max(noise_of(fit, base), min(base.least, _promised(base)))


def noise_of(fit: Joint, base: Base) -> float:
    """The residual's fast end, or what identification left, whichever is less."""
    return min(fit.plateau, base.own_plateau, _promised(base))


def only_noise(fit: Joint, base: Base) -> bool:
    """Whether hardly more than noise is left, whatever else no function of the motion explains."""
    return left(fit, base) + base.tremble < SHOWS**2 * (noise_of(fit, base) ** 2 + base.tremble)


def _promised(base: Base) -> float:
    return base.promised if base.promised is not None else np.inf
