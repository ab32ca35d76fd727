"""One thrust and one band of several hypotheses: the mixture's median, and a sigma that its tails allow.

    thrust = F^-1(0.5),     sigma = max |F^-1(p) - thrust| / z(p)     p: both ends of 95 % (z 1.96) and of 99.73 % (z 3)

The band covers every hypothesis that is alive: one of 5 % that lies elsewhere is inside the 95 %, one of 0.5 % inside
three sigmas, where a variance would let both vanish. The median is the mean of a single one, and an unlikely one that
is far away does not pull it.

What nobody corrected of an installation is in the band and not in the estimate: it widens every hypothesis that takes
the mounts' word, and none that does not. A hypothesis that the mounts are off is about the same errors; beside the
mixture, as a variance of its own, they were counted twice.

The filter and the bank weigh the same sources by the same hypothesis, one step by step, the other rows at once. Where
they say different thrusts one of both is wrong, and it may be the one that goes out: what they are apart by is in the
band of every hypothesis.
Reference: Bar-Shalom, Li & Kirubarajan, sec. 1.4.16 (mixture equations).
"""

from math import erfc, exp, nan, pi, sqrt
from typing import NamedTuple

from thrustd.core.columns import Floats
from thrustd.core.jit import compiled

P, SHIFT_N, STD_N = range(3)  # of a hypothesis: its probability; thrust minus that of the one that leads; one sigma
TAILS = (0.00134990, 3.0), (0.025, 1.959964)  # of one side, and how many sigmas a Gaussian has there
ALONE = 1e-3  # all others together less likely than this: nothing to mix
NOTHING = 1e-6  # a hypothesis less likely than this is in no tail
STEPS, CLOSE_N = 30, 1e-3
ROOT_2, ROOT_2_PI = sqrt(2.0), sqrt(2.0 * pi)


class Weighed(NamedTuple):
    """What the bank of hypotheses says of an engine."""

    hypotheses: Floats  # (n, 3) P, SHIFT_N, STD_N
    lead: int  # the one that was trusted of what the filter is told
    uncorrected_n: float  # one sigma of what none of them knows
    by_mounts: Floats  # (n,) 1: takes the mounts' word, so its thrust has that, too; else 0
    lead_n: float = nan  # thrust by the one that leads, when it was weighed last; NaN: it was not


@compiled
def _beyond(x_n: float, hypotheses: Floats, sign: float) -> tuple[float, float]:
    """Probability that the thrust is further out than x, from the one that leads, on this side; density there, 1/N."""
    tail = density = 0.0
    for i in range(len(hypotheses)):
        if hypotheses[i, P] > NOTHING:
            sigma_n = hypotheses[i, STD_N]
            out = sign * (x_n - hypotheses[i, SHIFT_N]) / sigma_n
            tail += 0.5 * hypotheses[i, P] * erfc(out / ROOT_2)
            density += hypotheses[i, P] * exp(-0.5 * out * out) / (ROOT_2_PI * sigma_n)
    return tail, density


@compiled
def _end(hypotheses: Floats, std_n: float, sign: float, far_n: float, tail: tuple[float, float]) -> float:
    """Newton's steps, halves of the bracket where one leads out of it; the median may be on either side of 0."""
    inner, outer = -far_n * sign, far_n * sign
    at_n = tail[1] * std_n * sign
    for _ in range(STEPS):
        beyond, density = _beyond(at_n, hypotheses, sign)
        if beyond > tail[0]:
            inner = at_n
        else:
            outer = at_n
        next_n = at_n + sign * (beyond - tail[0]) / max(density, 1e-12)
        if not min(inner, outer) < next_n < max(inner, outer):
            next_n = 0.5 * (inner + outer)
        done = abs(next_n - at_n) < CLOSE_N
        at_n = next_n
        if done:
            break
    return at_n


@compiled
def mix(
    thrust_n: float, std_n: float, weighed: Weighed, off: bool = False, apart_n: float = 0.0
) -> tuple[float, float]:
    """Thrust and sigma of the one that leads, and all others beside it. -> thrust and sigma of the mixture.

    `off`: the engine is, and what was said of it while it ran says nothing. `apart_n`: what the bank says it is, less
    the thrust.
    """
    if off:
        return thrust_n, std_n
    lead, more_n = weighed.lead, weighed.uncorrected_n
    told, wide = weighed.hypotheses.copy(), weighed.hypotheses.copy()
    told[lead, STD_N], far_n = std_n, 0.0
    for i in range(len(told)):
        wide[i, STD_N] = sqrt(told[i, STD_N] ** 2 + (weighed.by_mounts[i] * more_n) ** 2 + apart_n**2)
        if i == lead or told[i, P] > 0.1 * TAILS[0][0] / len(told):
            far_n = max(far_n, abs(told[i, SHIFT_N]) + 6.0 * wide[i, STD_N])
    if told[lead, P] > 1.0 - ALONE:
        return thrust_n, wide[lead, STD_N]
    middle_n, sigma_n = _end(told, std_n, 1.0, far_n, (0.5, 0.0)), 0.0
    for tail in TAILS:
        for sign in (-1.0, 1.0):
            beyond, _ = _beyond(middle_n + sign * tail[1] * sigma_n, wide, sign)
            if beyond > tail[0]:
                end_n = _end(wide, wide[lead, STD_N], sign, far_n, tail)
                sigma_n = max(sigma_n, sign * (end_n - middle_n) / tail[1])
    return thrust_n + middle_n, sigma_n
