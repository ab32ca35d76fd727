"""What a transducer reads less its noise: which law is missing is asked of the motion, not of the tremble.

Noise of the reading reaches the force through a stiff mount, and no law of the mount explains it. But an element that
swallows small motions, or looks a little ahead, smooths it, and leaves less than the true law does. A record may look
both ways: what smooths it without a law leaves still less. In flight nothing can, so sizes and errors are of the
reading as it is. So is the search where what it found leaves clearly less of that: friction forgets by motion as small
as noise.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import convolve1d, uniform_filter1d

from thrustd.core.columns import Floats
from thrustd.diagnose.search.base import SEARCHED, Base
from thrustd.diagnose.search.better import gained
from thrustd.diagnose.search.joint import Joint, counted, joint_fit
from thrustd.diagnose.search.past import Found, by_past
from thrustd.diagnose.search.question import Question, of_segments
from thrustd.identify.regression.free_run import simulate
from thrustd.identify.regression.friction import noise_of
from thrustd.identify.regression.record import Record
from thrustd.identify.segments import DEFORMATION

SPLINE = np.array([1.0, 4.0, 6.0, 4.0, 1.0]) / 16.0
SCALES = 5  # octaves of time, from one sample
AROUND = 32  # coefficients that tell the power of the motion at a place
HALF = 0.5  # of what was taken away that the force follows
LEAST = 0.05  # of a variance: so much of a promise is not the reading's


def without_noise(d: Floats) -> Floats:
    """The reading (n,) less white noise, as far as motion can be told from it: Wiener's filter, place by place.

    In every octave what is there is kept by the share of its local power that is not noise's; the octaves are those of
    an undecimated spline transform, which needs no phase (Starck & Murtagh, Astronomical Image and Data Analysis, 2006;
    Wiener's shrinkage by local power: Mihcak et al., IEEE Signal Process. Lett. 6 (1999) 300).
    """
    noise = noise_of(d)
    if not noise > 0.0:
        return d
    tick = np.zeros(8 * 2**SCALES)
    tick[len(tick) // 2] = 1.0
    slow, kept = d, np.zeros(len(d))
    for k in range(SCALES):
        spread = np.zeros(4 * 2**k + 1)
        spread[:: 2**k] = SPLINE
        slower, later = (convolve1d(one, spread, mode="nearest") for one in (slow, tick))
        own, noises = slow - slower, noise**2 * float(np.sum((tick - later) ** 2))
        power = uniform_filter1d(own**2, AROUND * 2**k + 1, mode="nearest")
        kept += own * np.maximum(0.0, 1.0 - noises / np.maximum(power, noises))
        slow, tick = slower, later
    return slow + kept


def without_tremble(question: Question) -> Question:
    """The same question of readings less their noise; what was promised, or is left, is less by the force of that.

    Where the force follows what was taken away, that is motion, and the question stays as it is.
    """
    segments = [
        replace(s, inputs={**s.inputs, DEFORMATION: without_noise(s.inputs[DEFORMATION])}) for s in question.segments
    ]
    calm = of_segments(question, segments)
    calm = replace(calm, rows=[one.after(own.beginning) for own, one in zip(question.rows, calm.rows, strict=True)])
    base = calm.base
    without = [simulate(base.shape, base.point, record) for record in calm.rows]
    pairs = zip(question.rows, without, strict=True)
    taken = [simulate(base.shape, base.point, record) - other for record, other in pairs]
    missed = [record.y - force for record, force in zip(calm.rows, without, strict=True)]
    if followed_by(taken, missed) > HALF:
        return question
    steps = np.concatenate([np.diff(one) for one in taken])  # friction that noise moves on differs slowly, and is none
    tremble = min(float(np.nanvar(np.concatenate(taken))), float(np.nanmean(steps**2)) / 2.0)

    def less(variance: float) -> float:
        return max(variance - tremble, LEAST * variance)

    promised = None if base.promised is None else less(base.promised**2) ** 0.5
    known = replace(base, promised=promised, noise_variance=less(base.noise_variance), tremble=tremble)
    return replace(calm, base=known)


def followed_by(taken: Sequence[Floats], missed: Sequence[Floats]) -> float:
    """Which share of the forces `taken` away (n,) is in what records miss (n,): 1 of motion, 0 of noise or less.

    Less, because what was kept has some of the noise. By steps from one sample to the next, in which there is little
    of what a missing effect leaves.
    """
    steps = np.concatenate([np.diff(one) for one in taken]), np.concatenate([np.diff(one) for one in missed])
    force, rest = (each[np.isfinite(steps[0] + steps[1])] for each in steps)
    return float(force @ rest / max(force @ force, np.finfo(float).tiny))


def searched(
    question: Question,
    search: Callable[[Base, Sequence[Record]], Found],
    best_of: Callable[[Found], Joint],
    said: Callable[[Base, Found], bool] = lambda base, found: False,
) -> tuple[Base, Sequence[Record], Found, Base]:
    """On few samples: base and rows that it was found with, what (`by_past`), and that base of the reading as it is."""
    for one in (without_tremble(question), question):
        few, rows = counted(one.base, one.rows, SEARCHED)
        known, found = by_past(few, rows, one.segments, search, best_of, said)
        as_is = replace(question.base, shape=known.shape, point=known.point, information=known.information)
        best = best_of(found)
        last = one is question or not best.terms
        if last or not gained(best, joint_fit(*counted(as_is, question.rows, SEARCHED), best.terms)):
            break
    return known, rows, found, as_is
