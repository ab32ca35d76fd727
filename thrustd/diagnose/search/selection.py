"""Forward selection of absent effects, judged on blocks that were held back.

Each round asks every absent effect for its columns, regresses the residual on them (beside the effects found so far)
with blocks held back in turn, polishes the few that matter, and takes the one that removes most, if that is

    enough        at least `ENOUGH` of the model's own squared error (what it is known to leave when nothing misses);
                  half of that for the first effect when it is very sure, for there the law of another one missed cannot
                  be mistaken for it, and of 33 records with nothing hidden the best gain was 4.1 %
    sure          gain per held-back block over its standard error above `SURE`
    worth it      at least `WORTH` of the squared error that is left

The present parameters stay as identified in this ranking; `absorbed` adds what re-estimating them would do instead.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from thrustd.diagnose.search.candidates import Candidate, candidates, with_effect
from thrustd.diagnose.search.dependence import FreeCurve, curve_fit, free_curves
from thrustd.diagnose.search.evidence import Evidence
from thrustd.diagnose.search.gram import BlockGram, Fit, block_gram, gain_t, held_out_fit
from thrustd.diagnose.search.polish import polished
from thrustd.diagnose.search.pruning import tangents
from thrustd.diagnose.search.start import Start, start_of
from thrustd.model.artifact import EffectSpec, ModelSpec
from thrustd.model.effect import Effect
from thrustd.model.stage import Floats

ENOUGH = 0.30  # of the own squared error
ENOUGH_CLEAR = 0.15  # the same for the first effect, when its gain is ...
CLEAR = 4.0  # standard errors or more
SURE = 2.5  # standard errors
WORTH = 0.12  # of the squared error left
DEEP = 0.4  # of the squared error: an effect that shows only when the present parameters move
SURE_DEEP = 4.0
SHAPE_COST = 0.005  # of the own squared error per free shape parameter: of two alike, the simpler one
POLISH = 6  # candidates polished per round
NEAR = 1.35  # ... whose held-back error is within this factor of the best
VARIANT = 0.97  # another formulation of an effect must be this much better than the effect itself
BESIDE = 1e-6  # ridge of effects found before
RIDGES = (0.003, 0.03, 0.3, 3.0)  # of the re-estimated present parameters; the best on held-back blocks counts
MOST = 3  # effects found at most

Progress = Callable[[float, str], None]  # (share done, what is being done)


@dataclass(frozen=True, slots=True)
class Scored:
    """A candidate with its held-out error."""

    candidate: Candidate
    fit: Fit  # present parameters as identified
    absorbed: Fit | None  # present parameters re-estimated along with it
    before: Fit
    t: float

    @property
    def gain(self) -> float:
        """Mean squared error removed, N^2."""
        return self.before.mse - self.fit.mse

    @property
    def amplitudes(self) -> Floats:
        """As estimated from all blocks, in the order of the candidate's."""
        return self.fit.beta[-len(self.candidate.amplitudes) :]

    def spec(self) -> EffectSpec:
        """The effect at its estimated amplitudes."""
        return EffectSpec(self.candidate.effect.name, self.candidate.with_amplitudes(self.amplitudes))

    @property
    def late_s(self) -> float:
        """How far it looks ahead in the record, s."""
        ahead_s = self.candidate.effect.ahead_s
        return ahead_s(self.spec().parameters) if ahead_s is not None and len(self.fit.beta) else 0.0


@dataclass(frozen=True, slots=True)
class Round:
    """One look at a model: what is left, who explains it."""

    spec: ModelSpec
    output_n: Floats
    residual_n: Floats
    before: Fit  # held-out error of the model as it is
    absorbed: Fit | None  # the same with its present parameters re-estimated; None until `with_absorbed` asks
    scored: tuple[Scored, ...]  # best first, one per effect
    curves: dict[str, Fit]  # free curve of each channel beside the present model, one scheme of holding back
    before_curves: Fit  # the model as it is, same scheme


def look(
    spec: ModelSpec,
    evidence: Evidence,
    effects: Sequence[Effect],
    added: Sequence[EffectSpec],
    progress: Progress | None = None,
) -> Round:
    """Judge every absent effect beside `added` ones that are in `spec` already and may be re-estimated."""
    evidence.remember(spec)
    output_n = evidence.output(spec)
    residual_n = evidence.reference_n - output_n
    present = np.empty((len(output_n), 0))
    start = start_of(spec, evidence)
    beside = tangents(spec, added, evidence, output_n)
    rough: list[Candidate] = []
    for i, effect in enumerate(effects):
        _tell(progress, 0.7 * i / max(1, len(effects)), effect.name)
        rough += candidates(effect, spec, evidence, output_n)
    curves = free_curves(evidence, output_n)
    white_n2 = evidence.white_n2(spec)
    table = _Table.of(evidence, residual_n, present, beside, rough, curves, white_n2, start)
    first = table.scored(rough)
    _tell(progress, 0.75, "polish")
    fine = [
        polished(s.candidate, spec, evidence, output_n, beside, start) if _matters(s, first, i) else s.candidate
        for i, s in enumerate(first)
    ]
    last = _Table.of(evidence, residual_n, present, beside, fine, [], white_n2, start)
    _tell(progress, 1.0, "")
    return Round(
        spec,
        output_n,
        residual_n,
        last.before(),
        None,
        tuple(last.scored(fine)),
        table.curve_fits(curves),
        table.before(schemes=1),
    )


def with_absorbed(round_: Round, evidence: Evidence) -> Round:
    """The first look once more with the present parameters re-estimated along: slow, asked only when nothing shows."""
    spec, chosen = round_.spec, [s.candidate for s in round_.scored]
    present, none = evidence.jacobian(spec), np.empty((len(round_.output_n), 0))
    white_n2, start = evidence.white_n2(spec), start_of(spec, evidence)
    table = _Table.of(evidence, round_.residual_n, present, none, chosen, [], white_n2, start)
    scored = tuple(
        replace(s, absorbed=table.absorbed(columns)) for s, columns in zip(round_.scored, table.candidates, strict=True)
    )
    return replace(round_, absorbed=table.absorbed([]), scored=scored)


def _matters(scored: Scored, first: Sequence[Scored], place: int) -> bool:
    return place < POLISH and scored.gain > 0 and scored.fit.rmse <= NEAR * first[0].fit.rmse


def acceptable(scored: Scored, own_n: float, first: bool = False) -> bool:
    """Enough, sure and worth it."""
    enough = ENOUGH_CLEAR if first and scored.t >= CLEAR else ENOUGH
    return scored.gain >= enough * own_n**2 and scored.t >= SURE and scored.gain >= WORTH * scored.before.mse


def rank(scored: Scored, own_n: float) -> float:
    """Held-back squared error with a small charge for every shape parameter that was free to fit."""
    free = sum(not p.amplitude and p.estimate for p in scored.candidate.effect.parameters)
    return scored.fit.mse + SHAPE_COST * own_n**2 * free


def buried(first: Round) -> Round | None:
    """The first look with everything re-estimated along, when that shows an effect that is in the identification too.

    The present parameters have absorbed part of such an effect, so little shows while they stay; together with them it
    must remove much more than they can alone. Best first; None when no effect does.
    """
    if first.absorbed is None:
        return None
    reference = min(first.before, first.absorbed, key=lambda fit: fit.mse)
    together = [
        replace(s, fit=s.absorbed, before=reference, t=gain_t(reference, s.absorbed))
        for s in first.scored
        if s.absorbed is not None
    ]
    together = sorted((s for s in together if not s.candidate.impossible(s.amplitudes)), key=lambda s: s.fit.mse)
    if not together or together[0].fit.mse > (1 - DEEP) * reference.mse or together[0].t < SURE_DEEP:
        return None
    return replace(first, before=reference, scored=tuple(together))


def taken(spec: ModelSpec, scored: Scored) -> tuple[ModelSpec, EffectSpec]:
    """The model with the candidate at its estimated amplitude."""
    effect = scored.spec()
    return with_effect(spec, effect), effect


@dataclass(frozen=True, slots=True)
class _Table:
    """Column numbers in one Gram table: residual 0, present parameters, effects beside, candidates, free curves."""

    gram: BlockGram
    present: list[int]
    beside: list[int]
    candidates: list[list[int]]
    curves: list[list[int]]

    @staticmethod
    def of(
        evidence: Evidence,
        residual_n: Floats,
        present: Floats,
        beside: Floats,
        chosen: Sequence[Candidate],
        curves: Sequence[FreeCurve],
        white_n2: float,
        start: Start,
    ) -> "_Table":
        groups = [*(c.columns for c in chosen), *(c.columns for c in curves)]
        ends = np.cumsum([1] + [g.shape[1] for g in (present, beside, *groups)])
        places = [list(range(a, b)) for a, b in pairwise(ends)]
        gram = block_gram(evidence, residual_n, np.column_stack((present, beside)), groups, white_n2, start)
        n = len(chosen)
        return _Table(gram, places[0], places[1], places[2 : 2 + n], places[2 + n :])

    def before(self, schemes: int = 2) -> Fit:
        return held_out_fit(self.gram, self.beside, [BESIDE] * len(self.beside), schemes)

    def absorbed(self, extra: Sequence[int]) -> Fit:
        """With the present parameters re-estimated, held back by the ridge that predicts best."""
        at = [*self.present, *self.beside, *extra]
        free = len(self.beside) + len(extra)
        fits = [held_out_fit(self.gram, at, [ridge] * len(self.present) + [BESIDE] * free) for ridge in RIDGES]
        return min(fits, key=lambda fit: fit.mse)

    def scored(self, chosen: Sequence[Candidate]) -> list[Scored]:
        """Best shape of each effect, best effect first."""
        before = self.before()
        best: dict[str, Scored] = {}
        for candidate, columns in zip(chosen, self.candidates, strict=True):
            if not float(self.gram.size[columns].min()) > 0:
                continue
            fit = held_out_fit(self.gram, [*self.beside, *columns], [BESIDE] * len(self.beside) + [0.0] * len(columns))
            if candidate.impossible(fit.beta[len(self.beside) :]):
                fit = before
            scored = Scored(candidate, fit, None, before, gain_t(before, fit))
            known = best.get(candidate.word)
            if known is None or _better(scored, known):
                best[candidate.word] = scored
        return sorted(best.values(), key=lambda s: s.fit.mse)

    def curve_fits(self, curves: Sequence[FreeCurve]) -> dict[str, Fit]:
        return {
            curve.channel: curve_fit(self.gram, columns, self.beside)
            for curve, columns in zip(curves, self.curves, strict=True)
        }


def _better(scored: Scored, known: Scored) -> bool:
    """A variant replaces the plain effect only when it is clearly better."""
    plain, other = (e.candidate.effect.variant_of == "" for e in (known, scored))
    factor = VARIANT if plain and not other else 1 / VARIANT if other and not plain else 1.0
    return scored.fit.mse < factor * known.fit.mse


def _tell(progress: Progress | None, share: float, what: str) -> None:
    if progress is not None:
        progress(share, what)
