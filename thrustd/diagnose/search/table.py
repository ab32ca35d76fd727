"""Thin rows of a fit, by the groups of blocks that are held back in turn: what the linear look is taken on.

What a step of the core absorbs is told by rows made white (`noise`); what is missed behind it is that of rows as read.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thrustd.core.columns import Flags, Floats
from thrustd.core.measures import held_out_groups
from thrustd.diagnose.search.absorbed import Absorbed, Columns
from thrustd.diagnose.search.base import Base
from thrustd.diagnose.search.blocks import BLOCKS, FOLDS
from thrustd.diagnose.search.joint import Joint, prior_from
from thrustd.identify.regression.noise import Lasting, Whitener
from thrustd.identify.regression.record import Record
from thrustd.identify.regression.solve import prior_of
from thrustd.identify.regression.sweep import columns
from thrustd.identify.regression.walk import walking

ROWS = 12_000  # of the table at most
HOLDS = 1e8  # precision of what a reference is held at


@dataclass(frozen=True, slots=True)
class Part:
    """Thin rows that are held back together, gradient of the core (n, p) and what is missed (n,), and their sums."""

    gradient: Floats
    residual: Floats
    matrix: Floats  # (p, p)
    right: Floats  # (p,)
    squares: float

    @classmethod
    def of(cls, gradient: Floats, residual: Floats) -> "Part":
        squares = float(residual @ residual)
        return cls(gradient, residual, gradient.T @ gradient, gradient.T @ residual, squares)

    def beside(self, rows: Floats) -> Columns:
        """Sums with further columns (n, k)."""
        return Columns(self.gradient.T @ rows, rows.T @ rows, rows.T @ self.residual)

    def missed(self, beside: Columns, step: Floats, numbers: Floats) -> float:
        """Sum of squares behind a step of the core and with these numbers of the columns beside it."""
        towards = self.right @ step + beside.right @ numbers
        moved = step @ self.matrix @ step + numbers @ (2.0 * beside.across.T @ step + beside.among @ numbers)
        return max(float(self.squares - 2.0 * towards + moved), 0.0)


@dataclass(frozen=True, slots=True)
class Beside:
    """Further columns beside the rows of one part."""

    read: Columns
    white: Columns

    def times(self, size: float) -> "Beside":
        """Of columns so many times larger."""
        return Beside(self.read.times(size), self.white.times(size))


@dataclass(frozen=True, slots=True)
class Table:
    """Thin rows of one fit, by the groups of blocks that are held back in turn."""

    parts: tuple[Part, ...]
    white: tuple[Part, ...]  # the same made white
    others: tuple[Absorbed, ...]  # the core by the rows of all other parts
    places: tuple[NDArray[np.intp], ...]  # of every part's rows in the records one after the other
    width: int
    fit: Joint
    records: Sequence[Record]
    averaged: float  # mean square that the means leave out: nothing of it is seen here

    def mse(self) -> float:
        """Mean square on held-back blocks as it is."""
        return self.squares(self.beside(np.empty((sum(map(len, self.places)), 0))), np.zeros(0, bool))

    def rows(self, columns: Iterable[Floats]) -> Floats:
        """Of whole columns (n, k), one a record."""
        return np.concatenate([means(each, self.width) for each in columns])

    def beside(self, rows: Floats) -> list[Beside]:
        """Thin rows (n, k) of further columns, summed part by part."""
        white = white_means(rows, self.records, self.width)
        return [
            Beside(read.beside(rows[at]), own.beside(white[at]))
            for read, own, at in zip(self.parts, self.white, self.places, strict=True)
        ]

    def squares(self, beside: Sequence[Beside], positive: Flags) -> float:
        """Mean square on held-back blocks with these columns of prior N(0, 1)."""
        noise, missed = self.fit.solution.noise_variance / self.width, 0.0
        whole = [one.white for one in beside]
        a, b, c = (sum(getattr(one, name) for one in whole) for name in ("across", "among", "right"))
        for part, core, own in zip(self.parts, self.others, beside, strict=True):
            w = own.white
            others = Columns((a - w.across) / noise, (b - w.among) / noise, (c - w.right) / noise)
            missed += part.missed(own.read, *core.steps(others, positive))
        return missed / sum(map(len, self.places))


def table_of(base: Base, fit: Joint, *, still: bool = False) -> Table:
    """Of a fit; `still`: beside a reference that keeps its zero and does not walk."""
    records = fit.records
    width = max(1, -(-sum(len(record.known) for record in records) // ROWS))
    shape, point = fit.solution.shape, fit.solution.point
    gradients, residuals, squares = [], [], 0.0
    for record in records:
        parts_of = [(rows.copy(), missed) for _, rows, missed in columns(shape, point, record)]
        gradients.append(means(np.concatenate([rows for rows, _ in parts_of]), width))
        missed = np.concatenate([missed for _, missed in parts_of])
        residuals.append(means(missed, width))
        squares += float(np.sum(missed[: len(residuals[-1]) * width] ** 2)) / width
    gradient, residual = np.concatenate(gradients), np.concatenate(residuals)
    group = held_out_groups(BLOCKS, FOLDS)[np.arange(len(residual)) * BLOCKS // len(residual)]
    places = tuple(np.flatnonzero(group == fold) for fold in range(FOLDS))
    parts = tuple(Part.of(gradient[at], residual[at]) for at in places)
    both = white_means(np.column_stack((gradient, residual)), records, width)
    white = tuple(Part.of(both[at, :-1], both[at, -1]) for at in places)
    averaged = (squares - float(residual @ residual)) / len(residual)
    others = _others(base, fit, white, fit.solution.noise_variance / width, still=still)
    return Table(parts, white, others, places, width, fit, records, averaged)


def white_means(rows: Floats, records: Sequence[Record], width: int) -> Floats:
    """Means (n, k) of so many neighbouring known samples of these records, made white: noise that lasts for longer."""
    white, begin = rows.copy(), 0
    for record in records:
        own = white[begin : begin + len(record.known) // width]
        begin += len(own)
        if record.lasting is not None and len(own):
            lasts = Lasting(width * record.lasting.ratio, record.lasting.tau_s)
            Whitener(lasts, record.dt_s).whiten(own, record.known[: len(own) * width : width])
    return white


def _others(base: Base, fit: Joint, parts: Sequence[Part], noise: float, *, still: bool) -> tuple[Absorbed, ...]:
    """The core by the rows of all parts but one, for each, under its priors."""
    shape = fit.solution.shape
    vector, groups = fit.solution.point.vector(shape), prior_of(shape, fit.solution.precisions)
    if still:
        walks = np.arange(shape.n)[shape.parts()["terms"]][walking(shape.terms)]
        held = np.append(walks, shape.parts()["offset"].start)
        groups[held, held] = HOLDS
    before = prior_from(base, shape)
    prior, pull = groups + before.information(vector), groups @ vector - before.downhill(vector)
    matrix, right = sum(part.matrix for part in parts), sum(part.right for part in parts)
    return tuple(
        Absorbed.of((matrix - p.matrix) / noise + prior, (right - p.right) / noise - pull, vector, shape.positive())
        for p in parts
    )


def means(table: Floats, width: int) -> Floats:
    """Of so many neighbouring rows."""
    m = len(table) // width * width
    thin: Floats = table[:m].reshape(-1, width, *table.shape[1:]).mean(axis=1)
    return thin
