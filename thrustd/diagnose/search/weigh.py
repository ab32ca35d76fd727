"""Effects weighed against what mount and brochure may be wrong by: the most probable sizes, and the evidence of a set.

    minimise  z' C^-1 z + |u|^2 + |p|^2,   z = mount(p) and brochure + unknowns u      (sizes p, u: one sigma each)
    ln evidence = -(that minimum) / 2 s2 - ln det P / 2,    P = J' C^-1 J + 1,   s2 = max(1, z' C^-1 z / rows)

by Gauss-Newton on free runs of the model with the effects in it (Laplace; MacKay, Neural Comput. 4 (1992) 415). Of two
sets the one is better that makes the readings likelier, and a size that a prior spreads over much costs its spread. The
mount's curve and all that its rubber remembers stay as the bench left them: no deck knows them better.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from thrustd.core.columns import Flags, Floats
from thrustd.diagnose.search.aboard import Aboard, Placed, beside, spec_with
from thrustd.diagnose.search.brochure_sources import Sources, sources_of
from thrustd.diagnose.search.question import Given, Question
from thrustd.model.artifact import ModelSpec

STEP = 0.05  # of a number's sigma, for the influence
BEGIN = 0.1  # of an amplitude's sigma, so that its shape can move
ITERATIONS, DONE = 8, 0.02  # sigmas
SURE = 20.0  # times likelier: 95 %
NO_NUMBERS: Floats = np.empty(0)


Runs = tuple[Floats, ...]  # of the mounts over one stretch, the judged one first


@dataclass(frozen=True, slots=True)
class Flown:
    """Mounts and what was flown with them: what does not change while effects are weighed."""

    mounts: tuple[Aboard, ...]  # the one that is judged first
    sources: tuple[Sources, ...]
    unknowns: Floats  # white columns of what reference and zeros do not know
    of_brochure: Floats  # its readings alone, white

    def runs(self, placed: Sequence[Placed] = (), numbers: Floats = NO_NUMBERS) -> list[Runs]:
        """Free runs of all mounts over every stretch, settled at its first sample, with these effects."""
        specs = [spec_with(mount, self.mounts[0], placed, numbers) for mount in self.mounts]
        same = [spec is mount.spec for spec, mount in zip(specs, self.mounts, strict=True)]
        return [
            tuple(
                plain if kept else mount.run(spec, segment)
                for kept, mount, spec, plain, segment in zip(
                    same, self.mounts, specs, source.plain_n, source.segments, strict=True
                )
            )
            for source in self.sources
        ]

    def of_mounts(self, runs: Sequence[Runs]) -> Floats:
        """The mounts' readings alone, white."""
        return np.concatenate([s.white(s.of_mounts(run)) for s, run in zip(self.sources, runs, strict=True)])

    def only(self, name: str) -> "Flown":
        """What one recording says alone."""
        return _flown(self.mounts, [source for source in self.sources if source.segment.record == name])

    def without(self, rows: Sequence[Flags]) -> "Flown":
        """With these rows of every stretch held back."""
        return _flown(self.mounts, [source.without(flags) for source, flags in zip(self.sources, rows, strict=True)])

    @property
    def recordings(self) -> list[str]:
        return list(dict.fromkeys(s.segment.record for s in self.sources))


def _flown(mounts: tuple[Aboard, ...], sources: Sequence[Sources]) -> Flown:
    unknowns, brochure = ([s.white(table) for s, table in zip(sources, tables, strict=True)]
                          for tables in ([s.unknowns for s in sources], [s.said for s in sources]))  # fmt: skip
    return Flown(mounts, tuple(sources), np.concatenate(unknowns), np.concatenate(brochure))


def flown(spec: ModelSpec, question: Question, given: Given) -> Flown:
    """From what was asked; the deck and the mount are there."""
    assert given.deck is not None and given.mount is not None  # `referenced` asked for them
    others = [beside(question.segments, *other) for other in given.others]
    judged = Aboard(given.mount, spec, tuple(question.segments))
    mounts = judged, *(other for other in others if other is not None)
    return _flown(mounts, sources_of(mounts, given.deck))


@dataclass(frozen=True, slots=True)
class Weighed:
    """A set of effects at its most probable sizes."""

    placed: tuple[Placed, ...]
    numbers: Floats  # of the effects
    unknowns: Floats  # of reference and zero, in sigmas of their priors
    covariance: Floats  # of the numbers
    runs: tuple[Runs, ...]  # of the models with them, by stretch
    squares: float  # z' C^-1 z + |u|^2 + |p|^2
    log_det: float
    rows: int

    @property
    def words(self) -> tuple[str, ...]:
        """Of the mount that is judged."""
        return tuple(dict.fromkeys(one.word for one in self.placed if one.here))

    @property
    def elsewhere(self) -> tuple[str, ...]:
        """Of the other mount alone."""
        return tuple(dict.fromkeys(one.word for one in self.placed if not one.here))

    @property
    def forces_n(self) -> list[Floats]:
        """Of the mount that is judged, by stretch."""
        return [run[0] for run in self.runs]

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


def begin_at(placed: Sequence[Placed]) -> Floats:
    return np.array([BEGIN if p.amplitude else 0.0 for one in placed for p in one.term.free])


def weigh(given: Flown, placed: Sequence[Placed], iterations: int = ITERATIONS, begin: Floats | None = None) -> Weighed:
    """The most probable sizes of these effects together, beside what reference and zeros do not know."""
    numbers = begin_at(placed) if begin is None else begin
    positive = np.array([flag for one in placed for flag in one.term.positive()], bool)
    for _ in range(iterations if placed else 1):
        mount = given.of_mounts(given.runs(placed, numbers))
        columns = _columns(given, placed, numbers, mount)
        left = mount + given.of_brochure - columns @ numbers
        solved = _solved(np.column_stack((given.unknowns, columns)), left)
        found = solved.found[-len(numbers) :] if placed else numbers
        moved = np.where(positive, np.maximum(found, 0.0), found) - numbers
        numbers = numbers + moved
        if np.all(np.abs(moved) < DONE):
            break
    runs = given.runs(placed, numbers)
    left = given.of_mounts(runs) + given.of_brochure
    core = _solved(given.unknowns, left)
    n = len(solved.information) - len(numbers)
    variance = np.asarray(np.linalg.inv(solved.information)[n:, n:], np.float64)
    log_det = float(np.linalg.slogdet(solved.information)[1])
    squares = core.squares + float(numbers @ numbers)
    return Weighed(tuple(placed), numbers, core.found, variance, tuple(runs), squares, log_det, len(left))


class _Solved(NamedTuple):
    found: Floats
    information: Floats
    squares: float  # with those of what was found


def _solved(table: Floats, left: Floats) -> _Solved:
    """Minimum of |left + table x|^2 + |x|^2."""
    information = table.T @ table + np.eye(table.shape[1])
    found = -np.linalg.solve(information, table.T @ left)
    missed = left + table @ found
    return _Solved(np.asarray(found, np.float64), information, float(missed @ missed + found @ found))


def _columns(given: Flown, placed: Sequence[Placed], numbers: Floats, mount: Floats) -> Floats:
    """Influence (rows, n) of every number on the white readings."""
    found = np.empty((len(mount), len(numbers)))
    for i, nudge in enumerate(STEP * np.eye(len(numbers))):
        found[:, i] = (given.of_mounts(given.runs(placed, numbers + nudge)) - mount) / STEP
    return found
