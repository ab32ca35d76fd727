"""One joint fit: core, friction and chosen effects on the new records, the core under what the bench said of it.

What a fit is worth is told by blocks of time held back (`blocks`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from thrustd.core.columns import Flags, Floats
from thrustd.diagnose.search.base import Base, is_nuisance, plateau, thinned
from thrustd.diagnose.search.blocks import block_equations, from_nothing, held_back, std_over
from thrustd.identify.regression.known import Known
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.regress import FIRST, begun_where
from thrustd.identify.regression.shape import SPECTRUM, Shape
from thrustd.identify.regression.solve import Given, Solution, noise_level, solve
from thrustd.identify.regression.terms import Term, split
from thrustd.identify.regression.walk import walking
from thrustd.model.modulated import BY

BEGIN = 0.02  # of its prior's sigma: where an amplitude begins, so that its shape can move
ITERATIONS = 12
SMOOTH = 1e-6  # roughness of a curve that is as good as straight
REVISIONS = 4  # of where records begin and of the noise
TOLD = 120_000  # samples that count in the fits that are reported
PRIOR = 0.5  # of its prior's sigma: a shape less certain than this is the prior's
SURE = 3.0  # standard errors from nothing: what is told from chance
WORSE = 1.3  # times the bench's noise, or as much less: from there on the noise is that of these records


@dataclass(frozen=True, slots=True)
class Joint:
    """A fit and its error on held-back blocks. Everything in units of the base's output scale."""

    terms: tuple[Term, ...]  # the new ones
    records: tuple[Record, ...]  # each begun where this fit says
    solution: Solution
    block_mse: Floats  # (n_blocks,) held back
    block_white: Floats  # (n_blocks,) the same, made white: what a law is told by
    block_size: Floats  # (n_blocks,) samples
    std: Floats  # (n,) one sigma of every number of the solution
    alone: Floats  # (n,) the same, were the shapes of the new terms known
    moved: float  # by how much the core is less likely than the bench left it: minus twice the log of its prior
    walked: float  # the same of the reference

    @property
    def mse(self) -> float:
        return float(np.sum(self.block_mse * self.block_size) / np.sum(self.block_size))

    @property
    def white(self) -> float:
        """Mean square that is left, made white."""
        return float(np.sum(self.block_white * self.block_size) / np.sum(self.block_size))

    @property
    def plateau(self) -> float:
        """See `base.plateau`."""
        return plateau(self.solution.normal.residuals, [record.step_share for record in self.records])

    @property
    def strain(self) -> float:
        """Minus twice the log of the priors of core, reference and effects: how far all is from what was known."""
        sigmas = self.solution.point.vector(self.solution.shape)[self.new]
        return self.moved + self.walked + float(sigmas @ sigmas)

    @property
    def new(self) -> slice:
        """Where the numbers of the new terms are."""
        last = self.solution.shape.parts()["terms"].stop
        return slice(last - sum(len(term.free) for term in self.terms), last)

    @property
    def words(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(term.effect.word for term in self.terms))

    @property
    def shown(self) -> bool:
        """Whether an amplitude of every new term is told from nothing, by errors that may last (`std_over`).

        Blocks that follow one another share what drifts, and agree on a fit to it. The elements of a spectrum, of
        which none says much alone, are judged by the blocks; in proportion to a channel they claim more than to exist.
        """
        return all(sigmas > SURE for sigmas in self.sigmas)

    @property
    def sigmas(self) -> tuple[float, ...]:
        """How far the amplitudes of every new term are from nothing, all together; infinite for a spectrum.

        As standard errors of one number that is as unlikely to be nothing (Wald, Trans. Am. Math. Soc. 54 (1943) 426):
        what two amplitudes share is told although neither is.
        """
        found, at, sigmas = self.solution, self.new.start, []
        for term in self.terms:
            own = [at + i for i, p in enumerate(term.free) if p.amplitude and not p.beside]
            at += len(term.free)
            spectrum = len(own) >= SPECTRUM and BY not in term.effect.name
            sigmas.append(np.inf if spectrum else from_nothing(found, self.telling, own))
        return tuple(sigmas)

    @property
    def telling(self) -> Floats:
        """One sigma (n,) by which a number is told from nothing.

        A shape that trades with its amplitude leaves neither told: such a law shows were its shape known, by as many
        times more as the data chose the shape themselves.
        """
        return np.minimum(self.std, SURE * self.alone)


def joint_fit(
    base: Base, records: Sequence[Record], terms: Sequence[Term], start: Floats | None = None, like: Joint | None = None
) -> Joint:
    """Everything together. `start`: numbers of the new terms to begin with; `like`: a fit whose core, and whose terms
    where none are told, to begin at.
    """
    shape = replace(base.shape, terms=(*base.shape.terms, *terms))
    count, before = sum(len(term.free) for term in terms), base.shape.sizes["terms"]
    point, strengths = base.point, _strengths(base, shape)
    begin = start if start is not None else np.full(count, BEGIN)
    if like is not None:
        point = like.solution.point
        begin = start if start is not None else point.terms[before:]
        strengths |= {name: like.solution.precisions[name] for name in strengths if name in like.solution.precisions}
    point = replace(point, terms=np.concatenate((point.terms[:before], begin)))
    prior = prior_from(base, shape)
    revised: Sequence[Record] = records
    promised = base.noise_variance
    noise = promised if like is None or _near(like.solution.noise_variance, promised) else None
    there = None  # the normal equations where it begins
    for _ in range(REVISIONS):
        begun, given = revised, Given(prior, noise, least=1, normal=there)
        found = solve(shape, point, begun, strengths, iterations=ITERATIONS, given=given)
        level, revised = noise_level(found.normal.white), [begun_where(_stateless(found), each) for each in begun]
        own = promised if _near(level, promised) else None
        same = all(new.before == old.before for new, old in zip(revised, begun, strict=True))
        if own == noise and same:
            break
        point, strengths, there = found.point, found.precisions, found.normal if same else None
        if own is None is not noise:  # the model promised another noise: how smooth it thought its curve is as well
            strengths = strengths | {"f": FIRST["f"]}
        noise = own
    read, blocks = block_equations(found.shape, found.point, begun)
    mse, white = held_back(found, read, blocks, prior)
    std, alone = std_over(found, blocks), std_over(found, blocks, _shapes(found.shape, len(terms)))
    walk = found.point.terms[walking(found.shape.terms)]
    moved = prior.cost(found.point.vector(found.shape)) if base.benched else 0.0
    return Joint(tuple(terms), tuple(begun), found, mse, white, blocks.size, std, alone, moved, float(walk @ walk))


def _near(level: float, promised: float) -> bool:
    """Whether it is the noise that the model promised."""
    return promised / WORSE < level < WORSE * promised


def counted(base: Base, records: Sequence[Record], samples: int) -> tuple[Base, list[Record]]:
    """At most so many samples count, all over the records, in pairs of neighbours; what remembers runs through all.

    An error that lasts says as much of itself in few samples: for each of them it is so much less of a noise.
    """
    every = -(-sum(map(len, records)) // samples)
    few = [replace(record, y=thinned(record.y, every), kept={}) for record in records]
    white = min(base.noise_variance, np.inf if base.promised is None else base.promised**2)
    return replace(base, noise_variance=max(white, base.noise_variance / every)), few


def told(base: Base, records: Sequence[Record], fit: Joint, samples: int = TOLD) -> Joint:
    """A fit of few samples, or of readings less their noise, by as many as a report is made of, as they were read."""
    read = [(len(one.known), one.d[one.stood :]) for one in records]
    searched = [(len(one.known), one.d[one.stood :]) for one in fit.records]
    if all(n == m and np.array_equal(d, e) for (n, d), (m, e) in zip(read, searched, strict=True)):
        return fit
    return joint_fit(*counted(base, records, samples), fit.terms, like=fit)


def _strengths(base: Base, shape: Shape) -> dict[str, float]:
    rough = float(base.point.f @ shape.prior_matrix("f") @ base.point.f)
    return {"f": len(base.point.f) / max(rough, SMOOTH)} | dict.fromkeys(shape.spectra(), 1.0)


def unmoved(base: Base, records: Sequence[Record], nothing: Joint) -> Joint:
    """Core and reference as known before these records, on them: they have taken on nothing of an effect."""
    solution = replace(
        nothing.solution,
        shape=base.shape,
        point=base.point,
        precisions=_strengths(base, base.shape),
        noise_variance=base.noise_variance or nothing.solution.noise_variance,
    )
    return replace(nothing, records=tuple(records), solution=solution)


def without(fit: Joint, member: Term) -> Joint:
    """As if one of its effects were neutral, all else as it was."""
    whole = fit.solution
    numbers = zip(whole.shape.terms, split(whole.shape.terms, whole.point.terms), strict=True)
    rest = [(term, own) for term, own in numbers if term is not member]
    shape = replace(whole.shape, terms=tuple(term for term, _ in rest))
    point = replace(whole.point, terms=np.concatenate([np.zeros(0), *(own for _, own in rest)]))
    left_over = tuple(term for term in fit.terms if term is not member)
    return replace(fit, terms=left_over, solution=replace(whole, shape=shape, point=point))


def _stateless(found: Solution) -> Solution:
    """As if every record began at rest: states would hide that one began elsewhere."""
    mask = np.concatenate([[0.0 if is_nuisance(term) else 1.0] * len(term.free) for term in found.shape.terms] or [[]])
    return replace(found, point=replace(found.point, terms=found.point.terms * mask))


def prior_from(base: Base, shape: Shape) -> Known:
    """What is known of everything: the base's own, nothing about new terms beyond their sigma."""
    n = base.shape.n
    mean, matrix = np.zeros(shape.n), np.zeros((shape.n, shape.n))
    mean[:n], matrix[:n, :n] = base.point.vector(base.shape), base.information
    return Known.of(shape, mean, matrix)


def _shapes(shape: Shape, new: int) -> Flags:
    """Which numbers (n,) are shapes of the last `new` terms."""
    found = np.zeros(shape.n, bool)
    last = shape.parts()["terms"].stop
    own = [not p.amplitude for term in shape.terms[len(shape.terms) - new :] for p in term.free]
    found[last - len(own) : last] = own
    return found


def unlikely(fit: Joint, noise: float) -> float:
    """Minus twice the log of the held-back likelihood times all priors (`strain`), but for a constant."""
    return fit.white * float(np.sum(fit.block_size)) / noise + fit.strain


def numbers_of(fit: Joint) -> int:
    """How many it takes: a shape that is known but for a spread is none, nor one that the data say nothing of."""
    free = [p for term in fit.terms for p in term.free]
    told = fit.std[fit.new] < PRIOR
    return sum(p.amplitude or (p.spread == 0.0 and bool(known)) for p, known in zip(free, told, strict=True))
