"""Physical effects beside the core of a regression: their parameters as numbers without dimension, their influence.

An amplitude is its prior's standard deviation times a number with prior N(0, 1); a shape parameter is its start times
e to the power of such a number, or a sum where its card gives a spread. So every effect of the shelf enters the same
regression as the curves do, with columns from differences of whole free runs: an effect that acts on the deformation
goes through the curve and the relaxation.
"""

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thrustd.model.ahead import ahead
from thrustd.model.effect import Effect, Parameter
from thrustd.model.expression import PREFIX
from thrustd.model.stage import DEFORMATION, Floats

Places = NDArray[np.intp] | slice

NUDGE = 1e-3  # of a number without dimension: step of the difference quotient
TINY = 1e-300  # a step that is none
APART = 0.3  # of such a number, to both sides: what reads through a play jumps, and its slope is that of a secant


@dataclass(frozen=True, slots=True)
class Term:
    """One effect with what of it is estimated. `fixed`: parameters as they are or begin; `std`: of each amplitude, and
    of a shape that moves by adding and not as its card says.

    `centre`: means of the amplitudes' priors where they are not neutral; `shapes`: whether shape parameters are free;
    `known`: whether earlier records told its numbers, which then have no N(0, 1) of their own; `sized`: whether physics
    tells the sizes, and the data need not.
    """

    effect: Effect
    fixed: Mapping[str, float]
    std: Mapping[str, float]
    centre: Mapping[str, float] = field(default_factory=dict)
    shapes: bool = True
    known: bool = False
    sized: bool = False
    free: tuple[Parameter, ...] = field(init=False, repr=False, compare=False)  # what is estimated
    straight: tuple[bool, ...] = field(init=False, repr=False, compare=False)  # it goes in proportion to that number

    def __post_init__(self) -> None:
        free = tuple(p for p in self.effect.parameters if p.estimate and (p.amplitude or self._moves(p)))
        written = self.effect.name.startswith(PREFIX)
        object.__setattr__(self, "free", free)
        object.__setattr__(self, "straight", tuple(p.amplitude and not written for p in free))

    def _moves(self, p: Parameter) -> bool:
        """Whether a shape parameter is estimated: one that begins at zero, its bound, has no scale to move by."""
        return self.shapes and not self.fixed[p.name] == p.low == 0.0

    def values(self, numbers: Floats) -> dict[str, float]:
        """Parameters (with units) of numbers without dimension, inside their bounds."""
        found = dict(self.fixed)
        for p, number in zip(self.free, numbers, strict=True):
            if p.amplitude:
                value = self.centre.get(p.name, p.neutral) + self.std[p.name] * float(number)
            elif (sigma := self.std.get(p.name, p.spread)) > 0.0:
                value = self.fixed[p.name] + sigma * float(number)
            elif self.fixed[p.name] > 0.0:
                value = self.fixed[p.name] * float(np.exp(number))
            else:
                value = self.fixed[p.name] + float(number)
            found[p.name] = float(p.low if value <= p.low else p.high if value >= p.high else value)
        return found

    def walls(self) -> Floats:
        """Least and largest number (n, 2) that each may have: its bounds, and of a shape how far it may move."""
        return np.array([self._walls(p) for p in self.free]).reshape(-1, 2)

    def _walls(self, p: Parameter) -> tuple[float, float]:
        ends, begin, sigma = np.array([p.low, p.high]), self.fixed[p.name], self.std.get(p.name, p.spread)
        if p.amplitude:
            return -np.inf, np.inf  # where physics knows a sign, `positive` does
        if sigma > 0.0 or begin <= 0.0:
            low, high = (ends - begin) / (sigma or 1.0)
        else:
            with np.errstate(divide="ignore"):
                low, high = np.clip(np.log(np.maximum(ends, 0.0) / begin), -p.e_folds, p.e_folds)
        return float(low), float(high)

    def positive(self) -> list[bool]:
        """Numbers that cannot be negative: physics knows no such amplitude."""
        return [p.amplitude and (p.passive or p.low == p.neutral) and p.name not in self.centre for p in self.free]

    def steps(self, numbers: Floats, size: float) -> Floats:
        """Steps (n,) of difference quotients: back from an upper wall, behind which every number says the same."""
        return np.where(numbers + size > self.walls()[:, 1], -size, size)

    def sigma(self, numbers: Floats, std: Floats) -> dict[str, float]:
        """One sigma in units, of one sigma without."""
        values = self.values(numbers)
        return {
            p.name: float(s) * (self.std.get(p.name) or p.spread or abs(values[p.name]))
            for p, s in zip(self.free, std, strict=True)
        }


@dataclass(frozen=True, slots=True)
class Seen:
    """What effects read of one record: the deformation and every channel (n,)."""

    d: Floats
    channels: Mapping[str, Floats]
    dt_s: float
    before: float
    kept: dict[Any, Any] | None = None  # of the record, see `Record`
    turned: bool = False  # the deformation is not what the transducer says

    def at(self, d: Floats) -> "Seen":
        """With another deformation."""
        return replace(self, d=d, channels={**self.channels, DEFORMATION: d}, turned=True)


def split(terms: Sequence[Term], numbers: Floats) -> list[Floats]:
    ends = [0, *itertools.accumulate(len(term.free) for term in terms)]
    return [numbers[a:b] for a, b in itertools.pairwise(ends)]


def deformed(terms: Sequence[Term], numbers: Floats, seen: Seen) -> Seen:
    """With the deformation as the rubber has it, from what the transducer says."""
    v = seen.d
    for term, own in zip(terms, split(terms, numbers), strict=True):
        if term.effect.site == "deformation":
            v = through(term, own, seen, v)
    return seen if v is seen.d else seen.at(v)


def through(term: Term, numbers: Floats, seen: Seen, v: Floats) -> Floats:
    """What an effect on the deformation or on the spring makes of this deformation or stiffness (n,)."""
    values, late = term.values(numbers), term.effect.ahead
    if late:  # a record allows to look ahead, which a flight does not
        v, values = ahead(v, values[late] / seen.dt_s), {**values, late: 0.0}
    if late and term.effect.does_nothing(values):
        return v
    return _run(term, values, seen, v, 1.0 if term.effect.site == "spring" else seen.before)


def sprung(terms: Sequence[Term], numbers: Floats, seen: Seen) -> Floats:
    """Relative stiffness of the spring (n,) as effects have it, () without any."""
    if not any(term.effect.site == "spring" for term in terms):
        return np.empty(0)
    spring = np.ones(len(seen.d))
    for term, own in zip(terms, split(terms, numbers), strict=True):
        if term.effect.site == "spring":
            spring = through(term, own, seen, spring)
    return spring


def sprung_before(terms: Sequence[Term], numbers: Floats, seen: Seen) -> float:
    """The same before the record begins."""
    first = 1.0
    for term, own in zip(terms, split(terms, numbers), strict=True):
        if term.effect.site == "spring":
            first *= _before(term, term.values(own), seen)
    return first


def inside(term: Term) -> bool:
    """Whether it adds to the force of the rubber, which gains multiply."""
    return term.effect.site == "linear" and term.effect.lags is None


def turned(term: Term, numbers: Floats, seen: Seen, places: Places) -> Floats:
    """Factor (k,) by which an effect multiplies the force at these samples: whatever that is."""

    def run() -> Floats:
        return _run(term, term.values(numbers), seen, np.ones(len(seen.d)), 1.0)[places]

    return run() if np.any(numbers) else _kept(term, ("gain",), seen, places, run)


def turning(term: Term, numbers: Floats, size: float, seen: Seen, places: Places) -> Floats:
    """Derivatives (k, n) of that factor, by steps of this size."""

    def run() -> Floats:
        own = turned(term, numbers, seen, places)
        steps = term.steps(numbers, size)
        moved = [turned(term, numbers + step, seen, places) for step in np.diag(steps)]
        return (np.array(moved).reshape(len(moved), len(own)).T - own[:, None]) / steps

    if all(term.straight) and term.effect.elements is not None:
        return _kept(term, ("turning",), seen, places, lambda: shares(term, term.values(numbers), seen, places))
    return run() if np.any(numbers) else _kept(term, ("turning", size), seen, places, run)


def shares(term: Term, values: Mapping[str, float], seen: Seen, places: Places) -> Floats:
    """What each number (k, n) of an effect with elements adds by 1."""
    own, wanted = [p for p in term.free if p.amplitude], np.zeros(len(seen.d), bool)
    wanted[places] = True
    table = np.empty((np.count_nonzero(wanted), len(own)))
    stage = term.effect.stage({**values, **{p.name: 1.0 for p in own}}, seen.dt_s)
    term.effect.elements(stage.start(_begin(term, seen), 0.0), stage.c, _read(stage.channels, seen), wanted, table)
    table *= [term.std[p.name] for p in own]
    return table


def pushed(term: Term, numbers: Floats, seen: Seen, places: Places) -> Floats:
    """Force (k,), N, of an effect on the force at these samples: it adds, whatever others do."""
    if seen.kept is not None and all(term.straight):
        return added(term, numbers, seen, places)[0]
    return _run(term, term.values(numbers), seen, np.zeros(len(seen.d)), 0.0)[places]


def added(term: Term, numbers: Floats, seen: Seen, places: Places) -> tuple[Floats, Floats]:
    """The same, and its derivatives (k, n)."""
    values, nothing, straight = term.values(numbers), np.zeros(len(seen.d)), np.array(term.straight, bool)
    own = [p for p, is_straight in zip(term.free, straight, strict=True) if is_straight]

    def alone() -> Floats:
        if term.effect.elements is not None:
            return shares(term, values, seen, places)
        table = np.empty((nothing[places].size, len(own)))
        for i, p in enumerate(own):
            size = {q.name: term.std[p.name] if q is p else q.neutral for q in own}
            table[:, i] = _run(term, values | size, seen, nothing, 0.0)[places]
        return table

    columns = _kept(term, ("force",), seen, places, alone) if straight.all() else alone()
    if not term.effect.name.startswith(PREFIX):  # in proportion to every amplitude, whatever its shape is
        force = columns @ [(values[p.name] - p.neutral) / term.std[p.name] for p in own]
    else:
        force = _run(term, values, seen, nothing, 0.0)[places]
    if straight.all():
        return force, columns
    table = np.empty((len(force), len(straight)))
    table[:, straight] = columns
    low, high = np.minimum(term.walls()[:, 0], numbers), np.maximum(term.walls()[:, 1], numbers)
    for i in np.flatnonzero(~straight):
        step = APART * np.eye(len(numbers))[i]
        ends = np.clip(numbers + np.array((step, -step)), low, high)
        moved = [_run(term, term.values(end), seen, nothing, 0.0)[places] for end in ends]
        there = np.isfinite(moved)  # a formula that is a number here need not be one there: from one side, or none
        (up, down), far = np.where(there, moved, force), np.where(there, ends[:, i, None], numbers[i])
        table[:, i] = (up - down) / np.maximum(far[0] - far[1], TINY)
    return force, table


def _kept(term: Term, key: tuple[Any, ...], seen: Seen, places: Places, made: Callable[[], Floats]) -> Floats:
    """What was made before of the same, where a record keeps it."""
    if seen.kept is None or (seen.turned and DEFORMATION in term.effect.channels):
        return made()
    still = tuple(term.fixed[p.name] for p in term.effect.parameters)
    key = (*key, seen.d[places].size, term.effect.name, seen.before, still, term.shapes)
    key += (*term.std.values(), *term.centre.values())
    if key not in seen.kept:
        seen.kept[key] = made()
    found: Floats = seen.kept[key]
    return found


def branches(terms: Sequence[Term], numbers: Floats) -> list[tuple[float, float]]:
    """Time constants, s, and gains that effects add to the relaxation of the core."""
    own = zip(terms, split(terms, numbers), strict=True)
    return [lag for term, part in own if term.effect.lags for lag in term.effect.lags(term.values(part))]


def branched_by(terms: Sequence[Term], numbers: Floats) -> Floats:
    """Derivatives (n_branches, n) of the gains of these branches."""
    gains = np.array([gain for _, gain in branches(terms, numbers)])
    moved = [[gain for _, gain in branches(terms, numbers + NUDGE * unit)] for unit in np.eye(len(numbers))]
    return (np.array(moved).reshape(len(numbers), len(gains)) - gains).T / NUDGE


def _before(term: Term, values: Mapping[str, float], seen: Seen) -> float:
    """What the effect makes of 1 before the record begins."""
    stage, u = term.effect.stage(values, seen.dt_s), _begin(term, seen)
    return stage.once(stage.start(u, 1.0), u, 1.0)


def _begin(term: Term, seen: Seen) -> Floats:
    """Inputs at rest before the first sample."""
    return np.array([seen.before if n == DEFORMATION else seen.channels[n][0] for n in term.effect.channels], float)


def _run(term: Term, values: Mapping[str, float], seen: Seen, v: Floats, first: float) -> Floats:
    stage = term.effect.stage(values, seen.dt_s)
    return stage.run(stage.start(_begin(term, seen), first), _read(stage.channels, seen), v)


def _read(names: Sequence[str], seen: Seen) -> Floats:
    """Channels (n, n_u) as a stage reads them."""
    return np.column_stack([seen.channels[name] for name in names]) if names else np.empty((len(seen.d), 0))


def at_start(effect: Effect, std: Mapping[str, float], shape: Mapping[str, float]) -> Term:
    """A term with its shape parameters at `shape` and everything else neutral."""
    return Term(effect, effect.neutral() | dict(shape), std)


def positives(terms: Sequence[Term]) -> NDArray[np.bool_]:
    return np.array([flag for term in terms for flag in term.positive()], bool)
