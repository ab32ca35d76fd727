"""Gauss-Newton on the posterior, the strengths of its priors by evidence (MacKay, Neural Comput. 4 (1992) 415).

    minimise  |y - model|^2 / (2 s2) + sum_k lambda_k / 2 (t - t0)' R_k (t - t0),   t_j >= 0 where physics says so
    lambda_k = gamma_k / (t - t0)' R_k (t - t0),   gamma_k = rank R_k - lambda_k trace(C R_k),   C: posterior covariance

gamma_k is how many numbers of group k the data determine. Nothing is chosen by hand: a group that the data do not need
gets a large lambda and vanishes.

s2 is not the variance of the residual but the level of its spectrum where it is highest: what is estimated is slow, and
slow errors do not average out as white ones do (Klein & Morelli, Aircraft System Identification, 2006, 5.3.3). Of a
residual made white where records say what lasts in their noise (`noise`).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_solve

from thrustd.core.columns import Flags, Floats
from thrustd.identify.regression.bounds import factor, within_reach
from thrustd.identify.regression.free_run import simulate
from thrustd.identify.regression.known import Known
from thrustd.identify.regression.noise import Lasting, whitened
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.shape import Point, Shape
from thrustd.identify.regression.sweep import Normal, normal_equations
from thrustd.identify.regression.walk import HOURS

WIDEST = {
    "gain": 1e-8,
    "pair_gain": 1e-8,
    "h": 1e-4,
    "f": 1e-12,
    "stops": 1e-4,
    "offset": 1e-6,
    "begin": 1e-4,
}  # least precision
WIDEST_TERM = 1e-3  # of a spectrum, in units of its typical size
WALKS = 1.0  # no cell walks further than `walk.SIZE`
FLAT = 1e-9  # precision of what no prior holds, in units of the output scale
GROWTH_STD = 1.0  # of friction that grows with the deformation: by as much again at the largest radius
POLE_STD = 0.5  # of the distance of neighbouring time constants: so far may a pole move
LONGEST = 64  # blocks of a record at least, for the level of slow errors
DONE = 0.5  # fall of the cost, in units of one half sigma^2: less is no progress
DONE_MOVING = 0.02  # where poles may move or a curve follows: valleys are long there
LEAST_ITERATIONS = 3  # before it may stop: strengths of priors follow slowly at first
DAMPINGS, LEAST = 12, 1e-6  # how often a step is tried, and its first damping in units of the diagonal of J'J

Progress = Callable[[int, float], None]


@dataclass(frozen=True, slots=True)
class Solution:
    """Where the search ended. All in units of the shape's output scale."""

    shape: Shape
    point: Point
    precisions: dict[str, float]
    noise_variance: float  # s2
    mean_square: float  # of the residual
    information: Floats  # (n, n) posterior precision: J'J / s2 + priors
    free: Flags  # (n,): not held at zero by its bound
    iterations: int
    normal: Normal
    lasting: Lasting | None = None  # of the noise, beside what is white


@dataclass(frozen=True, slots=True)
class _Posterior:
    """What is minimised, with s2 and the strengths of the priors as they stand."""

    s2: float
    level: float  # the same of the white residual
    middle: Floats  # (n,) means of the groups' priors
    groups: Floats  # (n, n) their precision
    prior: Known | None  # beside them

    def cost(self, squares: float, vector: Floats) -> float:
        away = vector - self.middle
        cost = squares / self.s2 + float(away @ self.groups @ away)
        return cost if self.prior is None else cost + self.prior.cost(vector)

    def information(self, normal: Normal, vector: Floats) -> Floats:
        information: Floats = normal.matrix / self.s2 + self.groups
        return information if self.prior is None else information + self.prior.information(vector)

    def downhill(self, normal: Normal, vector: Floats) -> Floats:
        gradient: Floats = normal.right / self.s2 - self.groups @ (vector - self.middle)
        return gradient if self.prior is None else gradient + self.prior.downhill(vector)

    def progress(self, fall: float) -> float:
        """What is such a fall of the cost under the noise that the residual shows, where s2 is told and is less."""
        return fall * max(1.0, self.level / self.s2)


@dataclass(frozen=True, slots=True)
class _Step:
    point: Point
    normal: Normal  # there
    free: Flags
    cost: float
    damping: float  # that it took


class Given(NamedTuple):
    """What is known beside the groups' priors."""

    prior: Known | None = None  # of the whole vector
    noise_variance: float | None = None  # s2; None: it follows from the residual as that falls
    least: int = LEAST_ITERATIONS
    share: float = 0.0  # of the cost: a smaller fall is no progress
    normal: Normal | None = None  # where the search begins, if they are known


NOTHING = Given()


def solve(
    shape: Shape,
    start: Point,
    records: Sequence[Record],
    precisions: Mapping[str, float],
    *,
    iterations: int = 25,
    progress: Progress | None = None,
    given: Given = NOTHING,
) -> Solution:
    """The most probable point."""
    strengths, point, middle = dict(precisions), start, _middle(shape)
    normal = given.normal or normal_equations(shape, point, records)
    done, damping = 0, 0.0

    def posterior() -> _Posterior:
        level = noise_level(normal.white)
        return _Posterior(given.noise_variance or level, level, middle, prior_of(shape, strengths), given.prior)

    for done in range(1, iterations + 1):
        now = posterior()
        cost = now.cost(normal.squares, point.vector(shape))
        progressed = now.progress(max(DONE_MOVING if not shape.passive else DONE, given.share * cost))
        step = _step(now, shape, point, records, normal, damping, progressed if done > given.least else 0.0)
        if step is None:
            break
        point, normal = step.point, step.normal
        damping, vector = step.damping / 10 if step.damping > LEAST else 0.0, point.vector(shape)
        strengths = _strengths(shape, strengths, posterior().information(normal, vector), step.free, vector - middle)
        if progress is not None:
            progress(done, float(np.sqrt(normal.squares / _count(normal))))
        if done > given.least and cost - step.cost < progressed:
            break
    now, vector = posterior(), point.vector(shape)
    free, information = ~(shape.positive() & (vector <= 0.0)), now.information(normal, vector)
    mean_square = sum(float(np.nansum(r * r)) for r in normal.residuals) / _count(normal)
    lasting = records[0].lasting
    return Solution(shape, point, strengths, now.s2, mean_square, information, free, done, normal, lasting)


def _step(
    now: _Posterior, shape: Shape, point: Point, records: Sequence[Record], normal: Normal, damping: float, worth: float
) -> _Step | None:
    """Gauss-Newton's, damped as Levenberg's only where the whole step is not downhill.

    None: no way down, or none that promises a fall of the cost by `worth`.
    """
    vector = point.vector(shape)
    information = now.information(normal, vector)
    cost, downhill = now.cost(normal.squares, vector), now.downhill(normal, vector)
    for _ in range(DAMPINGS):
        heavy = information + damping * np.diag(np.diag(normal.matrix)) / now.s2
        target, free = within_reach(heavy, downhill + heavy @ vector, shape.positive(), shape.reach(vector))
        step = target - vector
        if 2.0 * downhill @ step - step @ information @ step < worth:
            return None
        new = point.at(shape, target)
        with np.errstate(all="ignore"):
            there = None if damping else normal_equations(shape, new, records)  # a whole step mostly is downhill
            squares = there.squares if there else _squares(shape, new, records)
        new_cost = now.cost(squares, target)
        if new_cost <= cost:  # a number that is none is not
            return _Step(new, there or normal_equations(shape, new, records), free, new_cost, damping)
        damping = max(10 * damping, LEAST)
    return None


def _squares(shape: Shape, point: Point, records: Sequence[Record]) -> float:
    """None, where a formula is no number."""
    total = 0.0
    for record in records:
        missed = record.y - simulate(shape, point, record)
        if record.lasting is not None:
            missed = whitened(missed, record.lasting, record.dt_s)
        total += float(np.sum(missed[record.known] ** 2))
    return total


def _count(normal: Normal) -> int:
    return max(1, sum(int(np.isfinite(r).sum()) for r in normal.residuals))


def _middle(shape: Shape) -> Floats:
    """Means of the priors: zero, and for poles where they begin."""
    middle, where = np.zeros(shape.n), shape.parts()
    if shape.move:
        middle[where["log_tau"]] = np.log(shape.taus_s)
        middle[where["log_pole"]] = shape.poles.ravel()
    return middle


def prior_of(shape: Shape, strengths: Mapping[str, float]) -> Floats:
    """Precision matrix (n, n) of all groups."""
    matrix = FLAT * np.eye(shape.n)
    for name, where in shape.parts().items():
        if name in strengths and where.stop > where.start:
            matrix[where, where] += strengths[name] * shape.prior_matrix(name)
    for name in ("log_tau", "log_pole"):
        where = shape.parts()[name]
        if where.stop > where.start:
            spacing = float(np.diff(np.log(shape.taus_s)).mean()) if len(shape.taus_s) > 1 else 1.0
            std = POLE_STD * spacing if name == "log_tau" else 1.0
            matrix[where, where] += np.eye(where.stop - where.start) / std**2
    if shape.h_grid is not None:  # a straight part of h would be a scale of f
        where = shape.parts()["h"]
        at = np.linspace(max(shape.h_grid.low, shape.h_straight_from), shape.h_grid.high, 4 * shape.h_grid.n)
        line = shape.h_grid.values(at).T @ np.column_stack((np.ones(len(at)), at))
        matrix[where, where] += 1e6 * line @ np.linalg.solve(line.T @ line, line.T)
    matrix[shape.parts()["growth"], shape.parts()["growth"]] += 1.0 / GROWTH_STD**2
    where = shape.parts()["terms"]
    matrix[where, where] += np.diag([0.0 if term.known else 1.0 for term in shape.terms for _ in term.free])
    for name, own in shape.spectra().items():
        matrix[own, own] += (strengths.get(name, 1.0) - 1.0) * np.eye(own.stop - own.start)
    if shape.line:
        where = shape.parts()["f"]
        bends = np.diff(np.eye(shape.f_grid.n), 2, axis=0)
        matrix[where, where] += 1e9 * bends.T @ bends
    return matrix


def _strengths(
    shape: Shape, old: Mapping[str, float], information: Floats, free: Flags, away: Floats
) -> dict[str, float]:
    """MacKay's fixed point for every group."""
    covariance = np.zeros_like(information)
    covariance[np.ix_(free, free)] = _inverse(information[np.ix_(free, free)])
    new, groups = {}, shape.parts() | shape.spectra()
    for name, strength in old.items():
        where = groups[name]
        if where.stop == where.start or (name == "f" and shape.line):  # a line is held straight, not smooth
            new[name] = strength
            continue
        matrix = shape.prior_matrix(name) if name in shape.sizes else np.eye(where.stop - where.start)
        rank = where.stop - where.start - 3 if name in ("f", "h") else int(free[where].sum())
        counted = max(rank - strength * float(np.trace(covariance[where, where] @ matrix)), 0.1)
        size = max(float(away[where] @ matrix @ away[where]), 1e-300)
        least = WIDEST.get(name, WIDEST_TERM) if not name.startswith(HOURS) else WALKS
        new[name] = float(np.clip(counted / size, least, 1e12))
    return new


def surprise(found: Solution, noise_variance: float) -> float:
    """Minus twice the log of the evidence (Laplace) under this noise, but for what models of the same data share."""
    away, free = found.point.vector(found.shape) - _middle(found.shape), found.free
    groups = prior_of(found.shape, found.precisions)
    told = found.normal.matrix / noise_variance + groups
    volume = [float(np.linalg.slogdet(one[np.ix_(free, free)])[1]) for one in (told, groups)]
    return found.normal.squares / noise_variance + float(away @ groups @ away) + volume[0] - volume[1]


def _inverse(matrix: Floats) -> Floats:
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    inverse = cho_solve(factor(matrix * np.outer(scale, scale)), np.eye(len(matrix)))
    result: Floats = inverse * np.outer(scale, scale)
    return result


def noise_level(residuals: Sequence[Floats], blocks: int = LONGEST) -> float:
    """Largest of n times the variance of means of n samples, n = 1, 2, 4, ...: the level of slow errors.

    Of means so long that the residuals are so many `blocks` at least.
    """
    missed = np.concatenate([r[np.isfinite(r)] for r in residuals])
    level, width = float(np.mean(missed**2)), 2
    while width * blocks <= len(missed):
        means = missed[: len(missed) // width * width].reshape(-1, width).mean(axis=1)
        level, width = max(level, width * float(np.mean(means**2))), 2 * width
    return max(level, 1e-20)
