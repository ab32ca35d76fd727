"""Which regression: hypotheses compete on blocks of the data that were held back.

    rubber      no curve behind, gains of relaxation and friction >= 0 (`regress`)
    beside      the same with branches that the deformation stretches, not the curve, and that may flow (`friction`)
    general     gains of either sign, a second curve h, records that begin anywhere; hysteresis follows late
    smooth      the same without hysteresis
    settled     they begin at rest; instead, where that flies better: no state at first is known in flight
    ringing     further pairs of complex poles, one by one, where the residual asks for them (`pairs`)
    straight    lines for both curves while poles are looked for; the curves bend afterwards
    even        a curve behind that is the same for x and -x (`even`)
    hold        zero-order in place of ramps, where the input moves between samples

A hypothesis takes the place of a simpler one when it predicts the held-back blocks better by more than CLEARLY standard
errors of the difference from block to block (Hastie, Tibshirani & Friedman 2009, 7.10). Held back means: the model runs
through, the samples carry no weight. The winner is solved on all data.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import NamedTuple

import numpy as np

from thrustd.core.blas import one_thread
from thrustd.core.columns import Floats
from thrustd.identify.first_state import simulated
from thrustd.identify.regression import held
from thrustd.identify.regression.even import before_even_curve, behind_even
from thrustd.identify.regression.free_run import simulate
from thrustd.identify.regression.friction import BESIDE
from thrustd.identify.regression.general import MOUNT, Asked, Kind, anew, fine, general_shape, holds_of, records_of
from thrustd.identify.regression.long import MANY, PASSES, SETTLED, THINNED, few_modes, finer, onto, sparse, with_spare
from thrustd.identify.regression.pairs import with_best_pair
from thrustd.identify.regression.past import counted, places_of
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.reduce import reduced
from thrustd.identify.regression.regress import FIRST, begun_as, linear_point, regress, same_rubber, with_branches
from thrustd.identify.regression.shape import Hold, Point, Shape
from thrustd.identify.regression.solve import NOTHING, Given, Progress, Solution, solve
from thrustd.identify.regression.table import WITHIN
from thrustd.identify.segments import DEFORMATION, Segment, thinned

CLEARLY = 1.0  # standard errors
WORTH_IT = 0.95  # of the error of rubber, from which on something else is believed: physics holds on other records, too
SEEN = (1.0 + WITHIN**2) ** -0.5  # of an error: what is a tenth of the noise does not fly
MOST_PAIRS = 4
MOSTLY = 0.25  # of the output's variance left: no curve that rises or falls is behind
EVEN_PAIRS = (1, 2)  # of the straight model in front of an even curve; gains that it does not need vanish
ITERATIONS = 40  # at most
FREE = {name: strength for name, strength in FIRST.items() if name != "offset"}  # an output of any kind has any zero


class Trial(NamedTuple):
    """A solution of the visible data, and its squared errors (n_blocks,) on what was held back."""

    found: Solution
    held: Floats


Trials = dict[tuple[Kind, Kind, Hold | None, bool], Trial]


@dataclass(frozen=True, slots=True)
class Field:
    """Data on which hypotheses meet."""

    segments: Sequence[Segment]
    asked: Asked
    progress: Progress | None = None
    visible: list[Segment] = field(default_factory=list)
    made: Trials = field(default_factory=dict)
    given: Given = NOTHING

    def searched(self, ramps: Trial | None = None) -> Trial:
        """Hold and pairs that the blocks ask for, gains of either sign; what was searched before is not again."""
        key = self.asked.f, self.asked.h, self.asked.hold, self.asked.friction
        if key not in self.made:
            self.made[key] = _ringing(self, _best_hold(self, ramps or self.general()))
        return self.made[key]

    def rubber(self) -> Trial:
        plain = regress(self.visible, self.progress)
        best = self._judged(plain)
        for law in BESIDE:
            best = _better(best, self._judged(with_branches(plain, self.visible, law, self.progress)), SEEN)
        return best

    def general(self, hold: Hold = "foh") -> Trial:
        shape, records = general_shape(self.visible, self.asked, self.asked.hold or hold)
        return self.solved(shape, linear_point(shape, records), FREE)

    def solved(self, shape: Shape, start: Point, precisions: dict[str, float]) -> Trial:
        records = records_of(shape, self.visible)
        found = solve(
            shape, start, records, precisions, iterations=ITERATIONS, progress=self.progress, given=self.given
        )
        return self._judged(found)

    def with_pair(self, trial: Trial) -> Trial:
        shape, point = with_best_pair(trial.found, records_of(trial.found.shape, self.visible))
        return self.solved(shape, point, FREE | {"f": trial.found.precisions["f"], "h": trial.found.precisions["h"]})

    def bent(self, straight: Trial) -> Trial:
        """With the curves that are asked for, which begin as straight lines."""
        old, point = straight.found.shape, straight.found.point
        curved, _ = general_shape(self.visible, self.asked, old.hold)
        shape = replace(old, f_grid=curved.f_grid, h_grid=curved.h_grid, line=curved.line)
        h = np.zeros(curved.h_grid.n if curved.h_grid else 0)
        return self.solved(shape, replace(point, f=onto(old.f_grid, point.f, curved.f_grid), h=h), FREE)

    def straight(self) -> "Field":
        """The same data with lines in place of curves."""
        return replace(self, asked=replace(self.asked, f="line", h="line"))

    def even(self, hidden: Floats, hold: Hold, pairs: int) -> Trial:
        """A curve behind that is the same for x and -x; hidden: what lies in front of it (`even`)."""
        seen = max(self.visible, key=len)
        inside = [replace(seen, force_n=hidden)]
        straight = Field(inside, Asked("line", "line", hold=hold), self.progress, inside)
        inner = straight.general()
        for _ in range(pairs):
            inner = straight.with_pair(inner)
        shape, point = behind_even(inner.found, seen, hidden)
        return self.solved(replace(shape, begun=len(self.visible)), point, FREE)

    def flown(self, trial: Trial) -> Trial:
        """Judged without what it knows of how records begin: a first stretch shows that, as of any other record."""
        shape, point = anew(trial.found.shape, trial.found.point, 0)

        def run(segment: Segment) -> Floats:
            [record] = records_of(shape, [segment])
            return shape.output_scale * simulate(shape, point, record)

        outs = [simulated(run, segment, run(segment)) / shape.output_scale for segment in self.segments]
        return Trial(trial.found, self._held_back(trial.found, outs))

    def _judged(self, found: Solution) -> Trial:
        records = records_for(found, self.segments)
        return Trial(found, self._held_back(found, [simulate(found.shape, found.point, record) for record in records]))

    def _held_back(self, found: Solution, outs: Sequence[Floats]) -> Floats:
        """Squared errors (n_blocks,) of these outputs, in units of the solution."""
        blocks = []
        for out, whole in zip(outs, self.segments, strict=True):
            missed = whole.force_n / found.shape.output_scale - out[len(out) - len(whole) :]
            blocks += [
                float(np.nanmean(missed[part] ** 2)) for part in held.parts(whole) if np.isfinite(missed[part]).any()
            ]
        return np.array(blocks)


@one_thread()
def explained(
    segments: Sequence[Segment],
    asked: Asked = MOUNT,
    progress: Progress | None = None,
    made: Trials | None = None,
    given: Given = NOTHING,
) -> Solution:
    """The regression that these data speak for, on all of them. `made`: searches on the same data, filled here."""
    made = {} if made is None else made
    if sum(map(len, segments)) > MANY:
        return _of_many(segments, asked, progress, made)
    visible = [held.hidden(segment) for segment in held.spread(segments)]
    competing = Field(segments, asked, progress, visible, made, given)
    general = None
    if asked.friction:
        rubber, general = competing.rubber(), competing.general()
        if _better(rubber, general, WORTH_IT) is rubber:
            return _ordered(same_rubber(rubber.found, segments, progress), segments, asked, progress)
        smooth = replace(competing, asked=replace(asked, friction=False))
        if _better(without := smooth.general(), general, WORTH_IT) is without:
            competing, general = smooth, without
    best = competing.searched(general)
    if (asked.f, asked.h) != ("line", "line"):
        line = competing.straight().searched()
        bent = _better(line, competing.bent(line))
        simple, other = sorted((bent, best), key=lambda trial: len(trial.found.point.pair_gain))
        best = _better(simple, other)
    if asked.h in ("curve", "fine") and float(best.held.mean()) > MOSTLY:
        best = _even(competing, best)
    if len(best.found.point.pair_gain) and best.found.shape.h_straight_from != 0.0:
        best = _leaner(competing, best)
    best = best if given is SETTLED else _flown_better(competing, best)  # means of long records: `few_modes` does so
    return _ordered(resolved(best.found, segments, progress), segments, asked, progress)


def _best_hold(competing: Field, ramps: Trial) -> Trial:
    """Ramps between samples, or steps where these follow the held-back blocks better."""
    if competing.asked.hold is None and "zoh" in holds_of(competing.segments):
        return _better(ramps, competing.general("zoh"))
    return ramps


def _flown_better(competing: Field, best: Trial) -> Trial:
    """As it is, or learnt from records that begin at rest."""
    settled = competing.solved(*anew(best.found.shape, best.found.point, 0), best.found.precisions)
    return settled if _better(competing.flown(best), competing.flown(settled)).found is settled.found else best


def _even(competing: Field, best: Trial) -> Trial:
    seen = max(competing.visible, key=len)
    for hidden in before_even_curve(seen.inputs[DEFORMATION], seen.force_n, seen.dt_s):
        for hold, pairs in product(holds_of(competing.segments), EVEN_PAIRS):
            best = _better(best, competing.even(hidden, hold, pairs))
    return best


def _of_many(segments: Sequence[Segment], asked: Asked, progress: Progress | None, made: Trials) -> Solution:
    thin = thinned(segments, THINNED)
    found = explained(thin, fine(replace(asked, order=None)), progress, made, SETTLED)
    if found.shape.passive:
        return _ordered(same_rubber(found, segments, progress), segments, asked, progress)
    found = few_modes(found, thin, segments[0].dt_s, asked.order, progress)
    shape, point = finer(found, segments)
    if asked.order is None:
        shape, point = with_spare(shape, point, segments[0].dt_s, thin[0].dt_s)
    return resolved(resolved(replace(found, shape=shape, point=point), thin, progress, SETTLED), segments, progress)


def _ordered(found: Solution, segments: Sequence[Segment], asked: Asked, progress: Progress | None) -> Solution:
    """With the number of poles that was asked for, as many of them in pairs as follows the data best."""
    if asked.order is None:
        return found
    least = _reduced(found, asked.order, 0, segments, progress)
    if found.shape.passive:
        return least
    trials, seen = [least], len(found.point.pair_gain)
    for pairs in range(1, asked.order // 2 + 1):
        if pairs <= seen:
            trials.append(_reduced(found, asked.order, pairs, segments, progress))
        else:
            rest = _reduced(found, asked.order - 2, pairs - 1, segments, progress)
            shape, point = with_best_pair(rest, records_for(rest, segments))
            ringing = replace(rest, shape=shape, point=point, precisions=FREE)
            trials.append(resolved(ringing, segments, progress))
    best = least
    for trial in trials[1:]:
        best = trial if trial.mean_square < WORTH_IT**2 * best.mean_square else best
    return best


def _reduced(
    found: Solution, order: int, pairs: int, segments: Sequence[Segment], progress: Progress | None
) -> Solution:
    shape, point = reduced(found.shape, found.point, order, pairs)
    return resolved(replace(found, shape=shape, point=point), segments, progress)


def resolved(
    found: Solution, segments: Sequence[Segment], progress: Progress | None = None, given: Given = NOTHING
) -> Solution:
    """The same hypothesis on other data, from where it stands."""
    shape, point = found.shape, found.point
    if shape.begun:
        shape, point = anew(shape, point, counted(places_of(shape, segments)))
    records = [replace(record, lasting=found.lasting) for record in records_for(found, segments)]
    if not shape.passive and sum(map(len, segments)) > MANY:
        records, given = sparse(shape, point, records), SETTLED
    passes = ITERATIONS if given is NOTHING else PASSES
    return solve(shape, point, records, found.precisions, iterations=passes, progress=progress, given=given)


def records_for(found: Solution, segments: Sequence[Segment]) -> list[Record]:
    """Begun as this solution follows them best."""
    return begun_as(found, records_of(found.shape, segments), segments)


def _ringing(competing: Field, best: Trial) -> Trial:
    """One pair after the other, as long as the held-back blocks are predicted better."""
    for _ in range(MOST_PAIRS):
        longer = competing.with_pair(best)
        if _better(best, longer) is best:
            break
        best = longer
    return best


def _leaner(competing: Field, best: Trial) -> Trial:
    """The fewest real modes with which hardly more is missed."""
    pairs = len(best.found.point.pair_gain)
    for count in range(0, len(best.found.point.gain)):
        shape, point = reduced(best.found.shape, best.found.point, count + 2 * pairs, pairs)
        fewer = competing.solved(shape, point, best.found.precisions)
        if WORTH_IT**2 * float(fewer.held.mean()) < float(best.held.mean()):
            return fewer
    return best


def _better(simple: Trial, other: Trial, worth_it: float = 1.0) -> Trial:
    """The other one where it is clearly better, and by so much that it is worth it."""
    gain = simple.held - other.held
    if not np.isfinite(other.held).all():
        return simple
    if not np.isfinite(simple.held).all():
        return other
    spread = float(gain.std(ddof=1)) / np.sqrt(len(gain)) if len(gain) > 1 else np.inf
    worth = float(other.held.mean()) < worth_it**2 * float(simple.held.mean())
    return other if worth and float(gain.mean()) > CLEARLY * spread else simple
