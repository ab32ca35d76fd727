"""Effects weighed against what mount and brochure may be wrong by: the most probable sizes, and the evidence of a set.

    minimise  z' C^-1 z + |u|^2 + |p|^2,   z = mount(p) and brochure + unknowns u      (sizes p, u: one sigma each)
    ln evidence = -(that minimum) / 2 s2 - ln det P / 2,    P = J' C^-1 J + 1,   s2 = max(1, z' C^-1 z / rows)

by Gauss-Newton on free runs of the model with the effects in it (Laplace; MacKay, Neural Comput. 4 (1992) 415). Of two
sets the one is better that makes the readings likelier, and a size that a prior spreads over much costs its spread. The
mount's curve and all that its rubber remembers stay as the bench left them: no deck knows them better. How large the
errors of a deck's surface are is told by the evidence, too.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import msgspec
import numpy as np

from thrustd.core.columns import Flags, Floats
from thrustd.diagnose.search.brochure_sources import NUDGE_MM, SURFACE, Sources, sources_of
from thrustd.diagnose.search.evidence import simulate
from thrustd.diagnose.search.question import Given, Question
from thrustd.identify.first_state import of_the_past
from thrustd.identify.regression.terms import Term, split
from thrustd.identify.segments import DEFORMATION, Segment
from thrustd.model.artifact import EffectSpec, ModelSpec

STEP = 0.05  # of a number's sigma, for the influence
BEGIN = 0.1  # of an amplitude's sigma, so that its shape can move
ITERATIONS, DONE = 8, 0.02  # sigmas
OWN_N = 10.0  # one sigma of a model that promises none
SURE = 20.0  # times likelier: 95 %
SURFACES = 1.0, 2.0, 4.0  # times as wrong as its prior says may a deck's surface be


@dataclass(frozen=True, slots=True)
class Flown:
    """A model and what was flown with it: what does not change while effects are weighed."""

    spec: ModelSpec
    sources: tuple[Sources, ...]
    unknowns: Floats  # white columns of what reference and zero do not know
    of_brochure: Floats  # its readings alone, white

    def forces_n(self, spec: ModelSpec) -> list[Floats]:
        """Free runs of a model over every stretch, settled at its first sample."""
        return [simulate(spec, source.segment) for source in self.sources]

    def of_mount(self, forces_n: Sequence[Floats]) -> Floats:
        """The mount's readings alone, white."""
        pairs = zip(self.sources, forces_n, strict=True)
        return np.concatenate([s.white(s.of_mount(s.means(force))) for s, force in pairs])

    def scaled(self, size: float) -> Floats:
        """The unknowns with a surface so many times as wrong."""
        found = self.unknowns.copy()
        found[:, SURFACE] *= size
        return found

    def only(self, name: str) -> "Flown":
        """What one recording says alone."""
        return _flown(self.spec, [source for source in self.sources if source.segment.record == name])

    def without(self, rows: Sequence[Flags]) -> "Flown":
        """With these rows of every stretch held back."""
        return _flown(self.spec, [source.without(flags) for source, flags in zip(self.sources, rows, strict=True)])

    @property
    def recordings(self) -> list[str]:
        return list(dict.fromkeys(s.segment.record for s in self.sources))


def _flown(spec: ModelSpec, sources: Sequence[Sources]) -> Flown:
    unknowns, brochure = ([s.white(table) for s, table in zip(sources, tables, strict=True)]
                          for tables in ([s.unknowns for s in sources], [s.said for s in sources]))  # fmt: skip
    return Flown(spec, tuple(sources), np.concatenate(unknowns), np.concatenate(brochure))


def flown(spec: ModelSpec, question: Question, given: Given) -> Flown:
    """From what was asked; the deck and the mount are there."""
    assert given.deck is not None and given.mount is not None  # `referenced` asked for them

    def run(segment: Segment) -> Floats:
        return simulate(spec, segment)

    segments = question.segments
    plain, past = [run(segment) for segment in segments], [of_the_past(run, segment) for segment in segments]
    nudged = [replace(s, inputs={**s.inputs, DEFORMATION: s.inputs[DEFORMATION] + NUDGE_MM}) for s in segments]
    slopes = [(run(segment) - own) / NUDGE_MM for segment, own in zip(nudged, plain, strict=True)]
    own_n = float(np.median(spec.error.std_n)) if spec.error is not None else OWN_N
    return _flown(spec, sources_of(segments, plain, slopes, past, own_n, given.deck, given.mount))


@dataclass(frozen=True, slots=True)
class Weighed:
    """A set of effects at its most probable sizes."""

    terms: tuple[Term, ...]
    numbers: Floats  # of the terms
    unknowns: Floats  # of reference and zero, in sigmas of their priors
    covariance: Floats  # of the numbers
    forces_n: tuple[Floats, ...]  # of the model with them, by stretch
    squares: float  # z' C^-1 z + |u|^2 + |p|^2
    log_det: float
    rows: int

    @property
    def words(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(term.effect.word for term in self.terms))

    @property
    def s2(self) -> float:
        """By how much the readings scatter more than they should, as a variance."""
        return max(1.0, self.squares / self.rows)

    def likelier(self, other: "Weighed") -> float:
        """ln of how much likelier this larger set is than the other one, once the readings are known."""
        return (other.squares - self.squares) / (2 * self.s2) - (self.log_det - other.log_det) / 2

    @property
    def std(self) -> Floats:
        return np.asarray(np.sqrt(self.s2 * np.diag(self.covariance)))


def with_terms(spec: ModelSpec, terms: Sequence[Term], numbers: Floats, std: Floats | None = None) -> ModelSpec:
    """The model with effects of these sizes; one that it has is given its new size."""
    effects = list(spec.effects)
    for term, own, sure in zip(
        terms, split(terms, numbers), split(terms, numbers if std is None else std), strict=True
    ):
        found = EffectSpec(term.effect.name, term.values(own), {} if std is None else term.sigma(own, sure))
        where = [i for i, effect in enumerate(effects) if effect.name == found.name]
        if where:
            effects[where[0]] = found
        else:
            effects.append(found)
    return msgspec.structs.replace(spec, effects=effects, witness=None)


def begin_at(terms: Sequence[Term]) -> Floats:
    return np.array([BEGIN if p.amplitude else 0.0 for term in terms for p in term.free])


def weigh(given: Flown, terms: Sequence[Term], iterations: int = ITERATIONS, begin: Floats | None = None) -> Weighed:
    """The most probable sizes of these effects together, beside the likeliest size of a surface's errors."""
    numbers = begin_at(terms) if begin is None else begin
    positive = np.array([flag for term in terms for flag in term.positive()], bool)
    for _ in range(iterations if terms else 1):
        mount = given.of_mount(given.forces_n(with_terms(given.spec, terms, numbers)))
        columns = _columns(given, terms, numbers, mount)
        left = mount + given.of_brochure - columns @ numbers
        solved = {size: _solved(np.column_stack((given.scaled(size), columns)), left) for size in SURFACES}
        size = max(solved, key=lambda one: solved[one].log_evidence)
        found = solved[size].found[-len(numbers) :] if terms else numbers
        moved = np.where(positive, np.maximum(found, 0.0), found) - numbers
        numbers = numbers + moved
        if np.all(np.abs(moved) < DONE):
            break
    forces = given.forces_n(with_terms(given.spec, terms, numbers))
    scaled, left = given.scaled(size), given.of_mount(forces) + given.of_brochure
    core = _solved(scaled, left)
    information = solved[size].information
    n = len(information) - len(numbers)
    unknowns = core.found.copy()
    unknowns[SURFACE] *= size
    variance = np.asarray(np.linalg.inv(information)[n:, n:], np.float64)
    log_det = float(np.linalg.slogdet(information)[1])
    squares = core.squares + float(numbers @ numbers)
    return Weighed(tuple(terms), numbers, unknowns, variance, tuple(forces), squares, log_det, len(left))


class _Solved(NamedTuple):
    found: Floats
    information: Floats
    squares: float  # with those of what was found

    @property
    def log_evidence(self) -> float:
        return -(self.squares + float(np.linalg.slogdet(self.information)[1])) / 2


def _solved(table: Floats, left: Floats) -> _Solved:
    """Minimum of |left + table x|^2 + |x|^2."""
    information = table.T @ table + np.eye(table.shape[1])
    found = -np.linalg.solve(information, table.T @ left)
    missed = left + table @ found
    return _Solved(np.asarray(found, np.float64), information, float(missed @ missed + found @ found))


def _columns(given: Flown, terms: Sequence[Term], numbers: Floats, mount: Floats) -> Floats:
    """Influence (rows, n) of every number on the white readings."""
    found = np.empty((len(mount), len(numbers)))
    for i, nudge in enumerate(STEP * np.eye(len(numbers))):
        moved = given.forces_n(with_terms(given.spec, terms, numbers + nudge))
        found[:, i] = (given.of_mount(moved) - mount) / STEP
    return found
