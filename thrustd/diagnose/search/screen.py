"""A first look at every candidate: what it would remove if its influence were linear, on rows that are means.

Columns are difference quotients of whole free runs at a typical amplitude, beside the gradient of the core: a candidate
is judged by what it explains that the core cannot absorb under its prior, on blocks held back.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from thrustd.core.columns import Flags, Floats
from thrustd.diagnose.search.library import Rig, modulations
from thrustd.diagnose.search.table import Table
from thrustd.identify.regression.free_run import simulate, simulated
from thrustd.identify.regression.shape import SPECTRUM
from thrustd.identify.regression.terms import Term, added, deformed, turning

SIZES = 1.0, 5.0, 25.0  # of its typical one: a spectrum's common size is told by the data
PROBE = 0.2  # of an amplitude's sigma: typical
TRIED = 3  # effects estimated whole per set
SAYS = 0.01  # of the squared error: who removes less at first look is not estimated whole


@dataclass(frozen=True, slots=True)
class Looked:
    """A candidate and its mean square on held-back blocks, linearised."""

    term: Term
    mse: float
    before: float  # without it
    averaged: float  # beside either, see `Table`

    @property
    def leaves(self) -> float:
        """Mean square of single samples."""
        return self.mse + self.averaged

    @property
    def promises(self) -> float:
        """Mean square that it removes."""
        return self.before - self.mse

    @property
    def removes(self) -> float:
        """Share of the squared error."""
        return 1.0 - self.mse / self.before if self.before > 0.0 else 0.0


@dataclass(frozen=True, slots=True)
class Probe:
    """A candidate's influence beside a fit: thin columns (n, k) of its amplitudes, and which cannot be negative."""

    term: Term
    columns: Floats
    positive: Flags


def probed(table: Table, terms: Iterable[Term]) -> list[Probe]:
    """Of all of them."""
    plain, found = plain_parts(table), []
    for term in terms:
        thin = table.rows(_columns(table, term, plain))
        found.append(Probe(term, thin, np.array(replace(term, shapes=False).positive(), bool)))
    return found


def screened(table: Table, probes: Iterable[Probe]) -> list[Looked]:
    """Best first."""
    before, found = table.mse(), []
    for one in probes:
        sizes, beside = SIZES if one.columns.shape[1] >= SPECTRUM else SIZES[:1], table.beside(one.columns)
        mse = min(table.squares([part.times(size) for part in beside], one.positive) for size in sizes)
        found.append(Looked(one.term, mse, before, table.averaged))
    return sorted(found, key=lambda looked: looked.mse)


def leading(looked: Sequence[Looked], least: float = SAYS, most: int = 2 * TRIED) -> list[Looked]:
    """The best few effects that say anything, and their other laws as far as there is room, each in its best shape.

    A law with a shape held at its bound, which begins there, is another than the same with that shape free.
    """
    laws: dict[tuple[str, ...], Looked] = {}
    for one in looked:
        if one.removes > least:
            laws.setdefault((one.term.effect.name, *(p.name for p in one.term.free)), one)
    words = list(dict.fromkeys(law.term.effect.word for law in laws.values()))[:TRIED]
    first = [next(law for law in laws.values() if law.term.effect.word == word) for word in words]
    further = [law for law in laws.values() if law.term.effect.word in words and law not in first]
    return [law for law in laws.values() if law in [*first, *further[: most - len(first)]]]


def singles(looked: Sequence[Looked], probes: Sequence[Probe]) -> list[Probe]:
    """The best law of each effect."""
    found: dict[str, Term] = {}
    for one in looked:
        found.setdefault(one.term.effect.word, one.term)
    best = {id(term) for term in found.values()}
    return [probe for probe in probes if id(probe.term) in best]


def screened_modulations(table: Table, laws: Iterable[Term], rig: Rig) -> list[Looked]:
    """These laws, which act on the force, in proportion to every channel; best first. One run a law."""
    plain, before = plain_parts(table), table.mse()
    there, found = {term.effect.word for term in table.fit.solution.shape.terms}, []
    for law in laws:
        whole, positive = _columns(table, law, plain), np.array(replace(law, shapes=False).positive(), bool)
        for term, share in modulations(law, rig, table.records):
            if term.effect.word not in there:
                known = [s[record.known, None] for s, record in zip(share, table.records, strict=True)]
                thin = table.rows(s * c for s, c in zip(known, whole, strict=True))
                mse = table.squares(table.beside(thin), positive)
                found.append(Looked(term, mse, before, table.averaged))
    return sorted(found, key=lambda looked: looked.mse)


@dataclass(frozen=True, slots=True)
class Pair:
    """Two candidates together, linearised."""

    terms: tuple[Term, Term]
    removes: float  # share of the squared error on held-back blocks


def screened_pairs(table: Table, probes: Sequence[Probe]) -> list[Pair]:
    """Best first."""
    before, found = table.mse(), []
    for one, other in combinations(probes, 2):
        columns, positive = np.column_stack((one.columns, other.columns)), (*one.positive, *other.positive)
        left = table.squares(table.beside(columns), np.array(positive))
        found.append(Pair((one.term, other.term), 1.0 - left / before))
    return sorted(found, key=lambda pair: -pair.removes)


Parts = list[tuple[Floats, Floats]]  # per record, at its known samples: what the core gives, and what lies beside it


def _columns(table: Table, term: Term, plain: Parts) -> list[Floats]:
    """Columns (n, k) of the amplitudes of a term on every record, at its known samples."""
    still, found = replace(term, shapes=False), table.fit.solution
    nothing, scale = np.zeros(len(still.free)), found.shape.output_scale
    if term.effect.site in ("force", "gain"):
        seen = [deformed(found.shape.terms, found.point.terms, record.seen) for record in table.records]
        if term.effect.site == "force":
            made = [added(still, nothing, s, r.known)[1] / scale for s, r in zip(seen, table.records, strict=True)]
        else:
            turned = [turning(still, nothing, PROBE, s, r.known) for s, r in zip(seen, table.records, strict=True)]
            made = [core[:, None] * own for (core, _), own in zip(plain, turned, strict=True)]
        return [np.nan_to_num(own) for own in made]
    moved = [_outputs(table, still, PROBE * unit) for unit in np.eye(len(still.free))]
    return [
        np.nan_to_num((np.column_stack(outputs) - sum(own)[:, None]) / PROBE)
        for own, *outputs in zip(plain, *moved, strict=True)
    ]


def plain_parts(table: Table) -> Parts:
    """Without another term."""
    found = table.fit.solution
    return [simulated(found.shape, found.point, record, record.known) for record in table.records]


def _outputs(table: Table, term: Term, numbers: Floats) -> list[Floats]:
    """With one term more, at the known samples."""
    found = table.fit.solution
    shape = replace(found.shape, terms=(*found.shape.terms, term))
    point = replace(found.point, terms=np.concatenate((found.point.terms, numbers)))
    return [simulate(shape, point, record, record.known) for record in table.records]
