"""Two effects that hide each other: the one takes away what the other adds, and neither helps alone.

Forward selection is blind to them, for its first step sees only their difference. So before `unknown` is said, every
two effects are asked together, at all their starting shapes. They are taken when they explain what the best free curve
of any channel does, and each of them is missed without the other.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from thrustd.diagnose.candidates import Candidate, candidates
from thrustd.diagnose.evidence import Evidence
from thrustd.diagnose.gram import BlockGram, Fit, block_gram, gain_t, held_out_fit
from thrustd.diagnose.selection import BESIDE, Round, Scored
from thrustd.diagnose.start import start_of
from thrustd.model.effect import Effect


@dataclass(frozen=True, slots=True)
class _Column:
    candidate: Candidate
    at: tuple[int, ...]  # its columns in the Gram table


def hidden_pair(
    first: Round, evidence: Evidence, effects: Sequence[Effect], least_n2: float, most_n2: float
) -> tuple[Scored, Scored] | None:
    """The two effects that leave least, if that is at most `most_n2` and each removes `least_n2` beside the other."""
    columns, gram = _table(first, evidence, effects)
    alone = {id(c): _fit(gram, c.at) for c in columns}
    pairs = ((_fit(gram, a.at + b.at), a, b) for a, b in _pairs(columns))
    possible = [(fit, a, b) for fit, a, b in pairs if fit.mse <= most_n2 and _possible(fit, a, b)]
    for fit, a, b in sorted(possible, key=lambda found: found[0].mse):
        without_a, without_b = (min(first.before, alone[id(c)], key=lambda f: f.mse) for c in (b, a))
        if min(without_a.mse, without_b.mse) - fit.mse >= least_n2:
            cut = len(a.at)
            return _scored(a, fit, fit.beta[:cut], without_a), _scored(b, fit, fit.beta[cut:], without_b)
    return None


def _table(first: Round, evidence: Evidence, effects: Sequence[Effect]) -> tuple[list[_Column], BlockGram]:
    """Every effect at every starting shape, and the products of all of them with one another."""
    every = [c for effect in effects for c in candidates(effect, first.spec, evidence, first.output_n)]
    every = [c for c in every if np.all(np.any(c.columns != 0.0, axis=0))]
    ends = 1 + np.cumsum([0, *(c.columns.shape[1] for c in every)])
    columns = [_Column(c, tuple(range(i, j))) for c, i, j in zip(every, ends[:-1], ends[1:], strict=True)]
    core = np.column_stack([c.columns for c in every])
    white_n2, start = evidence.white_n2(first.spec), start_of(first.spec, evidence)
    return columns, block_gram(evidence, first.residual_n, core, [], white_n2, start)


def _pairs(columns: Sequence[_Column]) -> Iterator[tuple[_Column, _Column]]:
    return ((a, b) for a, b in combinations(columns, 2) if a.candidate.word != b.candidate.word)


def _fit(gram: BlockGram, at: tuple[int, ...]) -> Fit:
    return held_out_fit(gram, at, [BESIDE] * len(at))


def _possible(fit: Fit, a: _Column, b: _Column) -> bool:
    cut = len(a.at)
    return not (a.candidate.impossible(fit.beta[:cut]) or b.candidate.impossible(fit.beta[cut:]))


def _scored(column: _Column, fit: Fit, beta: np.ndarray, before: Fit) -> Scored:
    own = Fit(beta, fit.sse, fit.counts, fit.white_n2)
    return Scored(column.candidate, own, None, before, gain_t(before, fit))
