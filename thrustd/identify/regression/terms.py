"""Physical effects beside the core of a regression: their parameters as numbers without dimension, their influence.

An amplitude is its prior's standard deviation times a number with prior N(0, 1); a shape parameter is its start times
e to the power of such a number, or a sum where its card gives a spread. So every effect of the shelf enters the same
regression as the curves do, with columns from differences of whole free runs: an effect that acts on the deformation
goes through the curve and the relaxation.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from thrustd.model.effect import Effect, Parameter
from thrustd.model.expression import is_expression
from thrustd.model.stage import DEFORMATION, Floats

NUDGE = 1e-3  # of a number without dimension: step of the difference quotient


@dataclass(frozen=True, slots=True)
class Term:
    """One effect with what of it is estimated. `fixed`: parameters as they are or begin; `std`: of each amplitude.

    `centre`: means of the amplitudes' priors where they are not neutral; `shapes`: whether shape parameters are free.
    """

    effect: Effect
    fixed: Mapping[str, float]
    std: Mapping[str, float]
    centre: Mapping[str, float] = field(default_factory=dict)
    shapes: bool = True

    @property
    def free(self) -> tuple[Parameter, ...]:
        return tuple(p for p in self.effect.parameters if p.estimate and (p.amplitude or self._moves(p)))

    def _moves(self, p: Parameter) -> bool:
        """Whether a shape parameter is estimated: one that begins at zero, its bound, has no scale to move by."""
        return self.shapes and not self.fixed[p.name] == p.low == 0.0

    def values(self, numbers: Floats) -> dict[str, float]:
        """Parameters (with units) of numbers without dimension, inside their bounds."""
        found = dict(self.fixed)
        for p, number in zip(self.free, numbers, strict=True):
            if p.amplitude:
                value = self.centre.get(p.name, p.neutral) + self.std[p.name] * float(number)
            elif p.spread > 0.0:
                value = self.fixed[p.name] + p.spread * float(number)
            elif self.fixed[p.name] > 0.0:
                value = self.fixed[p.name] * float(np.exp(np.clip(number, -p.e_folds, p.e_folds)))
            else:
                value = self.fixed[p.name] + float(number)
            found[p.name] = float(np.clip(value, p.low, p.high))
        return found

    def positive(self) -> list[bool]:
        """Numbers that cannot be negative: physics knows no such amplitude."""
        return [p.amplitude and p.low == p.neutral and p.name not in self.centre for p in self.free]

    def sigma(self, numbers: Floats, std: Floats) -> dict[str, float]:
        """One sigma in units, of one sigma without."""
        values = self.values(numbers)
        return {
            p.name: float(s) * (self.std[p.name] if p.amplitude else p.spread or abs(values[p.name]))
            for p, s in zip(self.free, std, strict=True)
        }


@dataclass(frozen=True, slots=True)
class Seen:
    """What effects read of one record: the deformation and every channel (n,)."""

    d: Floats
    channels: Mapping[str, Floats]
    dt_s: float
    before: float

    def at(self, d: Floats) -> "Seen":
        """With another deformation."""
        return replace(self, d=d, channels={**self.channels, DEFORMATION: d})


def split(terms: Sequence[Term], numbers: Floats) -> list[Floats]:
    ends = np.cumsum([0, *(len(term.free) for term in terms)])
    return [numbers[a:b] for a, b in pairwise(ends)]


def deformed(terms: Sequence[Term], numbers: Floats, seen: Seen) -> Seen:
    """With the deformation as the rubber has it, from what the transducer says."""
    v = seen.d
    for term, own in zip(terms, split(terms, numbers), strict=True):
        if term.effect.site != "deformation":
            continue
        values = term.values(own)
        if term.effect.ahead_s is not None:  # a record allows to look ahead, which a flight does not
            index = np.arange(len(v), dtype=float)
            v = np.interp(index + term.effect.ahead_s(values) / seen.dt_s, index, v)
        else:
            v = _run(term, values, seen, v, seen.before)
    return seen.at(v)


def sprung(terms: Sequence[Term], numbers: Floats, seen: Seen) -> tuple[Floats, float]:
    """Relative stiffness of the spring (n,) as effects have it, () without any, and before the record begins."""
    if not any(term.effect.site == "spring" for term in terms):
        return np.empty(0), 1.0
    spring, first = np.ones(len(seen.d)), 1.0
    for term, own in zip(terms, split(terms, numbers), strict=True):
        if term.effect.site == "spring":
            values = term.values(own)
            spring = _run(term, values, seen, spring, 1.0)
            first *= _before(term, values, seen)
    return spring, first


def pushed(terms: Sequence[Term], numbers: Floats, seen: Seen, force: Floats, rubbed: Floats, rest: float) -> Floats:
    """Force (n,) with the gains applied, then friction `rubbed` and every effect that adds; `rest`: force before."""
    parts = list(zip(terms, split(terms, numbers), strict=True))
    for site in ("gain", "force"):
        if site == "force":
            force = force + rubbed
        for term, own in parts:
            if term.effect.site == site:
                force = _run(term, term.values(own), seen, force, rest)
    return force


def added(term: Term, numbers: Floats, seen: Seen) -> Floats:
    """Derivatives (n, k), N, of an effect on the force: it adds, whatever others do, in proportion to amplitudes."""
    nothing, values = np.zeros(len(seen.d)), term.values(numbers)
    straight = [p.amplitude and not is_expression(term.effect.name) for p in term.free]
    own = nothing if all(straight) else _run(term, values, seen, nothing, 0.0)
    table = np.empty((len(seen.d), len(term.free)))
    for i, p in enumerate(term.free):
        if straight[i]:
            alone = {q.name: term.std[p.name] if q is p else q.neutral for q in term.free if q.amplitude}
            table[:, i] = _run(term, values | alone, seen, nothing, 0.0)
        else:
            there = term.values(numbers + NUDGE * np.eye(len(numbers))[i])
            table[:, i] = (_run(term, there, seen, nothing, 0.0) - own) / NUDGE
    return table


def branches(terms: Sequence[Term], numbers: Floats) -> list[tuple[float, float]]:
    """Time constants, s, and gains that effects add to the relaxation of the core."""
    parts = [
        term.effect.lags(term.values(own))
        for term, own in zip(terms, split(terms, numbers), strict=True)
        if term.effect.lags
    ]
    return [branch for part in parts for branch in part]


def _before(term: Term, values: Mapping[str, float], seen: Seen) -> float:
    """What the effect makes of 1 before the record begins."""
    stage = term.effect.stage(values, seen.dt_s)
    u = _begin(term, seen)
    return stage.once(stage.start(u, 1.0), u, 1.0)


def _begin(term: Term, seen: Seen) -> Floats:
    """Inputs at rest before the first sample."""
    level = {DEFORMATION: seen.before}
    return np.array([level.get(name, seen.channels[name][0]) for name in term.effect.channels], float)


def _run(term: Term, values: Mapping[str, float], seen: Seen, v: Floats, first: float) -> Floats:
    stage = term.effect.stage(values, seen.dt_s)
    names = stage.channels
    u = np.column_stack([seen.channels[name] for name in names]) if names else np.empty((len(v), 0))
    return stage.run(stage.start(_begin(term, seen), first), u, v)


def at_start(effect: Effect, std: Mapping[str, float], shape: Mapping[str, float]) -> Term:
    """A term with its shape parameters at `shape` and everything else neutral."""
    return Term(effect, effect.neutral() | dict(shape), std)


def positives(terms: Sequence[Term]) -> NDArray[np.bool_]:
    return np.array([flag for term in terms for flag in term.positive()], bool)
