"""Diagnose: which absent effect explains what a model leaves, how sure that is, and what else could.

    report = diagnose(spec, [recording])
    report.verdict            ("axial_inertia",) or ("none",) or ("unknown",)

The statistics are explained in docs/diagnosis.md; the steps are selection (rounds), verdict, estimates, look-alikes.
"""

from collections.abc import Sequence

import numpy as np

from thrustd.brochure.deck import Deck
from thrustd.core.aircraft import MountPlace
from thrustd.diagnose.compare.checks import check_length, check_not_own_output, check_recording
from thrustd.diagnose.compare.newtons import newtons
from thrustd.diagnose.compare.reference import referenced
from thrustd.diagnose.search.candidates import NotJudged, judgeable
from thrustd.diagnose.search.dependence import Dependence, channels_of, drawn
from thrustd.diagnose.search.diagnose_report import CandidateReport, DiagnoseReport
from thrustd.diagnose.search.estimates import ParameterEstimate, estimated
from thrustd.diagnose.search.evidence import Evidence, gather
from thrustd.diagnose.search.look_alikes import advice_for, look_alikes
from thrustd.diagnose.search.selection import Progress, Round, Scored
from thrustd.diagnose.search.verdict import Judgement, judge
from thrustd.model.artifact import ModelSpec
from thrustd.model.effect import Effect
from thrustd.model.effects import effect_named, shelf
from thrustd.records.recording import Recording

POOR = 1.5  # squared error over what the artifact promises, from which re-identification is advised


def diagnose(
    spec: ModelSpec,
    recordings: Sequence[Recording],
    *,
    name: str = "",
    against: str = "",
    mount: MountPlace | None = None,
    deck: Deck | None = None,
    extra: Sequence[Effect] = (),
    progress: Progress | None = None,
) -> DiagnoseReport:
    """Judge every effect of the shelf and `extra` ones. `progress(share, what)` is called as it goes."""
    records = referenced(recordings, against, mount, deck, [spec])
    for record in records:
        check_recording(record, spec)
    check_length(records, spec)
    evidence = gather(spec, records)
    check_not_own_output(records[0], evidence.output(spec), evidence.reference_n)
    present = [effect_named(effect.name).word for effect in spec.effects]
    effects, not_judged = judgeable([*shelf().values(), *extra], spec, records, present)
    judgement = judge(spec, evidence, effects, _scaled(progress, 0.0, 0.85))
    reports, after_n = _candidates(judgement, evidence)
    if progress is not None:
        progress(1.0, "done")
    first = judgement.rounds[0]
    return DiagnoseReport(
        name or spec.name,
        tuple(record.name for record in records),
        judgement.verdict,
        tuple(reports),
        tuple(_drawn(judgement, evidence)),
        tuple(not_judged),
        tuple(_advice(judgement, reports, not_judged)),
        first.before.rmse,
        after_n,
        judgement.own_n,
        judgement.promised,
    )


def _candidates(judgement: Judgement, evidence: Evidence) -> tuple[list[CandidateReport], float]:
    """Reports of the effects found, then of the rest as the first look saw them."""
    first = judgement.rounds[0]
    numbers: list[ParameterEstimate] = []
    if judgement.found:
        assert judgement.spec is not None  # whoever found something has a model with it
        _, numbers = estimated(judgement.spec, judgement.added, evidence, rest_too=judgement.deep)
    reports = []
    for i, scored in enumerate(judgement.found):
        own = tuple(n for n in numbers if n.effect == scored.candidate.word)
        reports.append(_report(scored, _seen(judgement, i), judgement, own, True))
    words = {r.effect for r in reports}
    reports += [_report(s, first, judgement, _rough(s), False) for s in first.scored if s.candidate.word not in words]
    return reports, _after_n(judgement)


def _seen(judgement: Judgement, i: int) -> Round:
    """The round in which effect i of the verdict was found."""
    scored = judgement.found[i]
    return next((r for r in judgement.rounds if any(s is scored for s in r.scored)), judgement.rounds[0])


def _after_n(judgement: Judgement) -> float:
    if judgement.deep:
        return judgement.found[0].fit.rmse
    return judgement.rounds[-1].before.rmse if judgement.found else judgement.rounds[0].before.rmse


def _report(
    scored: Scored, seen: Round, judgement: Judgement, numbers: tuple[ParameterEstimate, ...], in_verdict: bool
) -> CandidateReport:
    after = scored.fit
    removed = 100 * (1 - after.mse / scored.before.mse) if scored.before.mse > 0 else 0.0
    better = int(np.count_nonzero(after.sse < scored.before.sse))
    alike = look_alikes(scored, seen.scored, judgement.own_n) if scored.gain > 0 else ()
    others = [s.candidate.word for s in judgement.found if s is not scored and seen is not judgement.rounds[0]]
    evidence = (
        f"{scored.candidate.word} removes {removed:.0f} % of the squared error on held-back blocks"
        f" ({newtons(scored.before.rmse)} -> {newtons(after.rmse)} N){_beside(others)},"
        f" better in {better} of {len(after.sse)} blocks,"
        f" {scored.t:.1f} standard errors"
        + (", looking ahead in the record; in flight it can only be extrapolated" if scored.late_s > 0.0 else "")
    )
    return CandidateReport(
        scored.candidate.word,
        scored.candidate.effect.name,
        scored.before.rmse,
        after.rmse,
        numbers,
        alike,
        evidence,
        in_verdict,
    )


def _beside(others: Sequence[str]) -> str:
    return f" beside {' and '.join(others)}" if others else ""


def _rough(scored: Scored) -> tuple[ParameterEstimate, ...]:
    """Amplitudes of the linear fit; their sigma from the gain in standard errors."""
    candidate = scored.candidate
    cards = {p.name: p for p in candidate.effect.parameters}
    values = (
        scored.fit.beta[-len(candidate.amplitudes) :] if len(scored.fit.beta) else [0.0] * len(candidate.amplitudes)
    )
    sure = max(abs(scored.t), 0.5)
    return tuple(
        ParameterEstimate(candidate.word, key, float(v), abs(float(v)) / sure, cards[key].unit, cards[key].expected)
        for key, v in zip(candidate.amplitudes, values, strict=True)
    )


def _drawn(judgement: Judgement, evidence: Evidence) -> list[Dependence]:
    seen = judgement.rounds[-1] if judgement.found else judgement.rounds[0]
    columns = channels_of(evidence, seen.output_n)
    before = seen.before_curves.rmse
    return [drawn(n, columns[n], seen.residual_n, before, seen.curves[n].rmse) for n in judgement.channels]


def _advice(judgement: Judgement, reports: Sequence[CandidateReport], not_judged: Sequence[NotJudged]) -> list[str]:
    advice = []
    for i, scored in enumerate(judgement.found):
        alike = next(r.separable_from for r in reports if r.effect == scored.candidate.word)
        advice += advice_for(scored, alike, _seen(judgement, i).scored)
    if judgement.verdict == ("unknown",):
        advice += [
            f"no known effect explains how the residual follows {name}: look at its picture, then try an expression,"
            f' for example --effect "k * {name}"'
            for name in judgement.channels
        ]
    first = judgement.rounds[0]
    if judgement.verdict == ("none",) and judgement.promised and first.before.mse > POOR * judgement.own_n**2:
        advice.append(
            f"no effect is missing, yet the model is {first.before.rmse:.0f} N wrong where its identification promises"
            f" {judgement.own_n:.0f} N: identify it again with data that cover this operation"
        )
    if judgement.deep:
        advice.append("the effect is in the identification data too: identify again with it in the structure")
    return list(dict.fromkeys(advice + _not_judged(not_judged)))


def _not_judged(not_judged: Sequence[NotJudged]) -> list[str]:
    """One line per reason, with the effects it holds for."""
    reasons: dict[str, list[str]] = {}
    for one in not_judged:
        reasons.setdefault(one.reason, []).append(one.effect)
    return [f"not judged: {', '.join(effects)}: {reason}" for reason, effects in sorted(reasons.items())]


def _scaled(progress: Progress | None, begin: float, end: float) -> Progress | None:
    if progress is None:
        return None
    return lambda share, what: progress(begin + (end - begin) * share, what)
