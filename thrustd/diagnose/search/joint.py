"""One joint fit: core, friction and chosen effects on the new records, the core under what the bench said of it.

What a fit is worth is told by blocks of time held back: with the normal equations of every block at hand, the estimate
without a group of blocks and the error on them follow from the linearisation at the optimum, without another pass.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm
from scipy.stats import t as student

from thrustd.core.columns import Flags, Floats
from thrustd.core.measures import held_out_groups
from thrustd.diagnose.search.base import Base, is_nuisance, plateau, thinned
from thrustd.identify.regression.bounds import bounded, inverse
from thrustd.identify.regression.known import Known
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.regress import FIRST, begun_where
from thrustd.identify.regression.shape import SPECTRUM, Point, Shape
from thrustd.identify.regression.solve import Given, Solution, noise_level, prior_of, solve
from thrustd.identify.regression.sweep import columns
from thrustd.identify.regression.terms import Term, split
from thrustd.identify.regression.walk import walking
from thrustd.model.modulated import BY

BLOCKS = 48  # of equal length over all records
TOGETHER = 1, 2, 4, 8, 16  # blocks whose scores are summed before they are compared: up to a third of the records
UPPER = 0.975  # of the distribution: 95 % intervals
FOLDS = 6  # groups of blocks held back in turn
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
    block_size: Floats  # (n_blocks,) samples
    std: Floats  # (n,) one sigma of every number of the solution
    alone: Floats  # (n,) the same, were the shapes of the new terms known
    moved: float  # by how much the core is less likely than the bench left it: minus twice the log of its prior
    walked: float  # the same of the reference

    @property
    def mse(self) -> float:
        return float(np.sum(self.block_mse * self.block_size) / np.sum(self.block_size))

    @property
    def plateau(self) -> float:
        """See `base.plateau`."""
        return plateau(self.solution.normal.residuals)

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
        numbers = self.solution.point.vector(self.solution.shape), self.telling
        parts = zip(self.terms, *(split(self.terms, each[self.new]) for each in numbers), strict=True)
        return all(_shown(*part) for part in parts)

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
        level, revised = noise_level(found.normal.residuals), [begun_where(_stateless(found), each) for each in begun]
        own = promised if _near(level, promised) else None
        same = all(new.before == old.before for new, old in zip(revised, begun, strict=True))
        if own == noise and same:
            break
        point, strengths, there = found.point, found.precisions, found.normal if same else None
        if own is None is not noise:  # the model promised another noise: how smooth it thought its curve is as well
            strengths = strengths | {"f": FIRST["f"]}
        noise = own
    blocks = block_equations(found.shape, found.point, begun)
    mse = held_back(found, blocks, prior)
    std, alone = std_over(found, blocks), std_over(found, blocks, _shapes(found.shape, len(terms)))
    walk = found.point.terms[walking(found.shape.terms)]
    moved = prior.cost(found.point.vector(found.shape)) if base.benched else 0.0
    return Joint(tuple(terms), tuple(begun), found, mse, blocks.size, std, alone, moved, float(walk @ walk))


def _shown(term: Term, size: Floats, std: Floats) -> bool:
    amplitude = np.array([p.amplitude and not p.beside for p in term.free], bool)
    spectrum = amplitude.sum() >= SPECTRUM and BY not in term.effect.name
    return spectrum or bool(np.any(np.abs(size[amplitude]) > SURE * std[amplitude]))


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
    """A fit of few samples by as many as a report is made of."""
    every, few = (sum(len(record.known) for record in each) for each in (records, fit.records))
    return fit if few == every else joint_fit(*counted(base, records, samples), fit.terms, like=fit)


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


@dataclass(frozen=True, slots=True)
class Blocks:
    """Normal equations block by block: J'J (b, n, n), J'r (b, n), r'r (b,), samples (b,)."""

    matrix: Floats
    right: Floats
    squares: Floats
    size: Floats


def block_equations(shape: Shape, point: Point, records: Sequence[Record], n_blocks: int = BLOCKS) -> Blocks:
    total = sum(len(record) - record.stood for record in records)
    edges = np.arange(1, n_blocks) * total // n_blocks
    n = shape.n
    found = Blocks(np.zeros((n_blocks, n, n)), np.zeros((n_blocks, n)), np.zeros(n_blocks), np.zeros(n_blocks))
    passed = 0
    for record in records:
        for known, rows, missed in columns(shape, point, record):
            lies_in = np.searchsorted(edges, passed + known - record.stood, side="right")
            for b in np.unique(lies_in):
                own, left = rows[lies_in == b], missed[lies_in == b]
                found.matrix[b] += own.T @ own
                found.right[b] += own.T @ left
                found.squares[b] += float(left @ left)
                found.size[b] += len(left)
        passed += len(record) - record.stood
    return found


def _shapes(shape: Shape, new: int) -> Flags:
    """Which numbers (n,) are shapes of the last `new` terms."""
    found = np.zeros(shape.n, bool)
    last = shape.parts()["terms"].stop
    own = [not p.amplitude for term in shape.terms[len(shape.terms) - new :] for p in term.free]
    found[last - len(own) : last] = own
    return found


def std_over(found: Solution, blocks: Blocks, held: Flags | None = None) -> Floats:
    """One sigma (n,): the posterior's, or what the blocks disagree by where that is more; 0 where a bound holds.

    held: numbers that are as they are, as if they were known.

    Scores of blocks of time scatter by all that the noise of the likelihood leaves out: errors that last, laws that
    do not hold exactly (White, Econometrica 50 (1982) 1; blocks: Kuensch, Ann. Statist. 17 (1989) 1217). What drifts
    for longer than a block shows in several of them together.
    """
    free = found.free if held is None else found.free & ~held
    scores = (blocks.right / found.noise_variance)[:, free]
    scores = scores - scores.mean(axis=0)
    covariance = inverse(found.information[np.ix_(free, free)])
    moved, std = scores @ covariance, np.zeros(len(free))
    std[free] = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    for width in TOGETHER:
        groups = moved.reshape(-1, width, moved.shape[1]).sum(axis=1)
        count = len(groups)
        unsure = student.ppf(UPPER, count - 1) / norm.ppf(UPPER)  # a scatter that few groups tell
        std[free] = np.maximum(std[free], unsure * np.sqrt((groups**2).sum(axis=0) * count / (count - 1)))
    return std


def held_back(found: Solution, blocks: Blocks, prior: Known) -> Floats:
    """Mean square error (n_blocks,) of every block when its group is left out of the estimate."""
    vector = found.point.vector(found.shape)
    groups = prior_of(found.shape, found.precisions)
    matrix, pull = groups + prior.information(vector), groups @ vector - prior.downhill(vector)
    squares = held_back_squares(blocks, vector, matrix, pull, found.noise_variance, found.shape.positive())
    return squares / np.maximum(blocks.size, 1.0)


def held_back_squares(
    blocks: Blocks, vector: Floats, prior: Floats, pull: Floats, noise: float, positive: Flags
) -> Floats:
    """Sum of squares per block, by the linearisation at `vector`; pull: gradient of the prior there."""
    squares = np.empty(len(blocks.size))
    whole, right = blocks.matrix.sum(axis=0), blocks.right.sum(axis=0)
    for fold in range(FOLDS):
        mine = held_out_groups(len(squares), FOLDS) == fold
        matrix, towards = blocks.matrix[mine], blocks.right[mine]
        information = (whole - matrix.sum(axis=0)) / noise + prior
        gradient = (right - towards.sum(axis=0)) / noise - pull
        new, _ = bounded(information, gradient + information @ vector, positive)
        step = new - vector
        squares[mine] = blocks.squares[mine] - 2 * towards @ step + matrix @ step @ step
    return np.maximum(squares, 0.0)


def unlikely(fit: Joint, noise: float) -> float:
    """Minus twice the log of the held-back likelihood times all priors (`strain`), but for a constant."""
    return fit.mse * float(np.sum(fit.block_size)) / noise + fit.strain


def numbers_of(fit: Joint) -> int:
    """How many it takes: a shape that is known but for a spread is none, nor one that the data say nothing of."""
    free = [p for term in fit.terms for p in term.free]
    told = fit.std[fit.new] < PRIOR
    return sum(p.amplitude or (p.spread == 0.0 and bool(known)) for p, known in zip(free, told, strict=True))
