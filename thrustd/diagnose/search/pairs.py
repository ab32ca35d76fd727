"""Two effects at once, where selection one by one goes astray.

Forward selection takes first what helps most alone. Two effects that hide each other show nothing alone (rubber that
hardens while it creeps), and a third may imitate the sum of two (Payne for a wrong scale with rectification). So where
something is left unexplained, every two effects are asked together, at all their starting shapes; the best few pairs
are polished, each effect beside the other, and judged on held-back blocks like everything else.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from thrustd.diagnose.search.candidates import Candidate, candidates
from thrustd.diagnose.search.evidence import Evidence
from thrustd.diagnose.search.gram import BlockGram, Fit, block_gram, gain_t, held_out_fit
from thrustd.diagnose.search.polish import polished
from thrustd.diagnose.search.selection import BESIDE, ENOUGH, SURE, Round, Scored
from thrustd.diagnose.search.start import start_of
from thrustd.model.effect import Effect
from thrustd.model.stage import Floats

POLISHED = 3  # pairs of effects that are polished
PRICE = 0.15  # of the own squared error: what one effect more must be worth where the pair shares none with those found
BETTER = 0.05  # of the own squared error: as many other effects must at least be better by this

Pair = tuple[Scored, Scored]


@dataclass(frozen=True, slots=True)
class _Column:
    candidate: Candidate
    at: tuple[int, ...]  # its columns in the Gram table


def best_pair(first: Round, evidence: Evidence, effects: Sequence[Effect], own_n: float) -> Pair | None:
    """The two effects that leave least together, if each is surely missed without the other."""
    columns, gram = _table(first, evidence, effects)
    rough = sorted(((_fit(gram, a.at + b.at), a, b) for a, b in _pairs(columns)), key=lambda found: found[0].mse)
    best: dict[frozenset[str], Pair] = {}
    for fit, a, b in rough:
        words = frozenset((a.candidate.word, b.candidate.word))
        if words not in best and _possible(fit, a.candidate, b.candidate):
            best[words] = _polished(a.candidate, b.candidate, first, evidence)
        if len(best) == POLISHED:
            break
    sure = [pair for pair in best.values() if _missed(pair, own_n)]
    return min(sure, key=lambda pair: pair[0].fit.mse, default=None)


def preferred(pair: Pair, found: Sequence[Scored], left_n2: float, own_n: float) -> bool:
    """Whether the pair explains better, for its number of effects, than those found one by one, which leave `left_n2`.

    Of two sets the one of which contains the other, the rule of the rounds decides: an effect more must remove enough.
    """
    now, then = {s.candidate.word for s in found}, {s.candidate.word for s in pair}
    if now == then:
        return False
    price = ENOUGH if now < then or then < now else PRICE
    margin = price * (len(then) - len(now)) if len(then) != len(now) else BETTER
    return pair[0].fit.mse <= left_n2 - margin * own_n**2


def _table(first: Round, evidence: Evidence, effects: Sequence[Effect]) -> tuple[list[_Column], BlockGram]:
    """Every effect at every starting shape, and the products of all of them with one another."""
    every = [c for effect in effects for c in candidates(effect, first.spec, evidence, first.output_n)]
    every = [c for c in every if np.all(np.any(c.columns != 0.0, axis=0))]
    ends = 1 + np.cumsum([0, *(c.columns.shape[1] for c in every)])
    columns = [_Column(c, tuple(range(i, j))) for c, i, j in zip(every, ends[:-1], ends[1:], strict=True)]
    return columns, _gram(first, evidence, [c.columns for c in every])


def _gram(first: Round, evidence: Evidence, columns: Sequence[Floats]) -> BlockGram:
    white_n2, start = evidence.white_n2(first.spec), start_of(first.spec, evidence)
    return block_gram(evidence, first.residual_n, np.column_stack(columns), [], white_n2, start)


def _pairs(columns: Sequence[_Column]) -> Iterator[tuple[_Column, _Column]]:
    return ((a, b) for a, b in combinations(columns, 2) if a.candidate.word != b.candidate.word)


def _fit(gram: BlockGram, at: Sequence[int]) -> Fit:
    return held_out_fit(gram, at, [BESIDE] * len(at))


def _possible(fit: Fit, a: Candidate, b: Candidate) -> bool:
    cut = len(a.amplitudes)
    return not (a.impossible(fit.beta[:cut]) or b.impossible(fit.beta[cut:]))


def _polished(a: Candidate, b: Candidate, first: Round, evidence: Evidence) -> Pair:
    """Both at their best beside the other, each against the other alone."""
    start = start_of(first.spec, evidence)
    for _ in range(2):
        a = polished(a, first.spec, evidence, first.output_n, b.columns, start)
        b = polished(b, first.spec, evidence, first.output_n, a.columns, start)
    count = len(a.amplitudes) + len(b.amplitudes)
    fit = _fit(_gram(first, evidence, [a.columns, b.columns]), range(1, 1 + count))
    if not _possible(fit, a, b):
        fit = first.before
    alone = {s.candidate.word: min(s.fit, first.before, key=lambda f: f.mse) for s in first.scored}
    cut = len(a.amplitudes)
    return (
        _scored(a, fit, fit.beta[:cut], alone.get(b.word, first.before)),
        _scored(b, fit, fit.beta[cut:], alone.get(a.word, first.before)),
    )


def _missed(pair: Pair, own_n: float) -> bool:
    return all(scored.gain >= ENOUGH * own_n**2 and scored.t >= SURE for scored in pair)


def _scored(candidate: Candidate, fit: Fit, beta: Floats, before: Fit) -> Scored:
    return Scored(candidate, Fit(beta, fit.sse, fit.counts, fit.white_n2), None, before, gain_t(before, fit))
