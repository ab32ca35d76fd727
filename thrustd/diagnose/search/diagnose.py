"""Diagnose: which absent effect explains what a model leaves, how sure that is, and what else could.

    report = diagnose(spec, [recording])
    report.verdict            ("axial_inertia",) or ("none",) or ("unknown",)

Core, friction and effects are estimated together, the core under what its bench said of it (`joint`); sets of effects
compete on blocks of time held back (`ranking`), and so do free curves of every channel, which know no physics: where
one of these leaves less than every known law, the verdict is `unknown`.
"""

import shlex
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from thrustd.core.blas import one_thread
from thrustd.core.types import Progress
from thrustd.diagnose.compare.loop_energy import loop_energy
from thrustd.diagnose.compare.newtons import newtons
from thrustd.diagnose.compare.reference import BROCHURE
from thrustd.diagnose.search.base import Base
from thrustd.diagnose.search.better import WORTH, likely, stands
from thrustd.diagnose.search.candidates import NotJudged, by_other_temperatures, judgeable, not_judged_lines
from thrustd.diagnose.search.curves import nearly
from thrustd.diagnose.search.dependence import dependences
from thrustd.diagnose.search.diagnose_report import REMOVES, CandidateReport, DiagnoseReport
from thrustd.diagnose.search.explained import explained
from thrustd.diagnose.search.floor import at_floor, before, floor_of, left, signed, something
from thrustd.diagnose.search.joint import Joint, told
from thrustd.diagnose.search.library import laws
from thrustd.diagnose.search.plain import alike, undisputed
from thrustd.diagnose.search.question import NOTHING, Given, Question, asked, asked_for
from thrustd.diagnose.search.ranking import Ranked, curve_says_it, rank
from thrustd.diagnose.search.reading import searched
from thrustd.diagnose.search.screen import Looked
from thrustd.diagnose.search.told import estimates_of
from thrustd.diagnose.search.unexplained import unexplained
from thrustd.diagnose.search.verdict import Verdict, grade_of, judge, more_left
from thrustd.identify.regression.friction import GROWS
from thrustd.identify.regression.record import Record
from thrustd.model.artifact import ModelSpec
from thrustd.model.effect import Effect
from thrustd.model.effects import effect_named, shelf
from thrustd.records.offer import advised
from thrustd.records.recording import Recording


@one_thread()
def diagnose(
    spec: ModelSpec,
    recordings: Sequence[Recording],
    *,
    name: str = "",
    given: Given = NOTHING,
    extra: Sequence[Effect | str] = (),
    beside: bool = False,
    progress: Progress | None = None,
) -> DiagnoseReport:
    """Judge every effect of the shelf and `extra` ones. `progress(share, what)` is called as it goes.

    `beside`: with the two best explanations sample by sample, for pictures.
    """
    question = asked(spec, recordings, given)
    if given.against == BROCHURE:
        from thrustd.diagnose.search.in_flight import diagnosed_in_flight  # it compiles what flies: seconds

        return diagnosed_in_flight(name or spec.name, spec, question, given, extra, progress)
    records, rows = question.records, question.rows
    present = [effect_named(effect.name).word for effect in spec.effects if effect.name not in GROWS]
    possible = [one for one in shelf().values() if one.word not in question.rig.priors.without]
    others = by_other_temperatures([law for law in laws(possible) if law.word not in present], records)
    known, not_judged = judgeable(possible, records, present)
    more, not_there = judgeable(asked_for(extra, records), records, present)
    effects, judged = [*known, *more, *others], {law.word for law in others}
    not_judged = [*(one for one in not_judged if one.effect not in judged), *not_there]
    question, ranked, verdict = _searched(question, effects, progress)
    base = question.base
    energy = loop_energy(records)
    turned = [energy.sentence(records)] if energy.delivers and not given.against else []
    if base.benched and base.opposes:
        turned.append("the force pulls against that of the model: sign of force or of deformation?")
    if turned and not at_floor(verdict.fit, base) and not signed(base):  # no passive law explains it, whichever fits
        verdict = Verdict(("unknown",), ranked.nothing, ())
    ranked, verdict = _told(base, rows, ranked, verdict)
    report = _report(name or spec.name, question, ranked, verdict, not_judged, turned, beside)
    if progress is not None:
        progress(1.0, "done")
    return report


def _searched(
    question: Question, effects: Sequence[Effect], progress: Progress | None
) -> tuple[Question, Ranked, Verdict]:
    """On few samples, from rest or where the mount remembers: the question is then asked with what it remembers."""
    known, rows, ranked, base = searched(
        question,
        lambda known, rows: rank(known, rows, effects, question.rig, progress),
        lambda ranked: ranked.best,
        lambda known, ranked: curve_says_it(known, ranked.best, ranked.curves),
    )
    ranked, otherwise = undisputed(known, rows, ranked, question.rig)
    if not at_floor(ranked.best, known):
        best = left(ranked.best, known) ** 0.5  # a reference that leaves more than the model is none
        free = min([best, unexplained(ranked.best), *(curve.mse**0.5 for curve in ranked.curves)])
        base = replace(base, least=float(np.hypot(free, known.tremble**0.5)))
        known = replace(known, least=free)
    verdict = judge(known, rows, ranked)
    if verdict.fit.terms:
        others = alike(known, rows, ranked, verdict.fit, question.rig)
        verdict = replace(verdict, alike=others, rivals=likely(verdict.fit, otherwise))
    return replace(question, base=base), ranked, verdict


def _told(base: Base, rows: Sequence[Record], ranked: Ranked, verdict: Verdict) -> tuple[Ranked, Verdict]:
    """By as many samples as a report is made of, with what is not told from it."""
    nothing = told(base, rows, ranked.nothing)
    ranked = replace(ranked, nothing=nothing)
    best = told(base, rows, verdict.fit) if verdict.fit.terms else nothing
    if not stands(nothing, best) and not something(nothing, base):  # what few samples seemed to say
        return ranked, Verdict(("none",), nothing, ())
    return ranked, replace(verdict, fit=best)


def _report(
    name: str,
    question: Question,
    ranked: Ranked,
    verdict: Verdict,
    not_judged: Sequence[NotJudged],
    turned: Sequence[str],
    beside: bool,
) -> DiagnoseReport:
    base, rows = question.base, question.rows
    scale, floor = base.scale, floor_of(verdict.fit, base)
    return DiagnoseReport(
        name,
        tuple(record.name for record in question.records),
        verdict.words,
        tuple(_candidates(base, ranked, verdict)),
        tuple(dependences(base, rows, verdict.fit, verdict.channels, ranked.tremble)),
        tuple(not_judged),
        (*turned, *_named(question.records[0]), *_advice(base, ranked, verdict, not_judged)),
        scale * float(np.sqrt(before(ranked.nothing, base))),
        scale * float(np.sqrt(left(verdict.fit, base))),
        scale * floor,
        base.promised is not None,
        grade_of(base, verdict),
        more_left(base, verdict),
        explained(question, ranked) if beside else None,
        base.roles.unit,
        noise_n=scale * floor_of(verdict.fit, replace(base, least=0.0)),
    )


def _candidates(base: Base, ranked: Ranked, verdict: Verdict) -> list[CandidateReport]:
    """Effects of the verdict, then every other by what it would leave alone."""
    scale, nothing, best = base.scale, ranked.nothing, verdict.fit
    was, after = scale * float(np.sqrt(before(nothing, base))), scale * float(np.sqrt(left(best, base)))
    numbers = estimates_of(base, best, verdict.rivals)
    found = []
    for term in best.terms:
        word = term.effect.word
        own = tuple(n for n in numbers if n.effect == word)
        said = _said(base, best, nothing, term.effect)
        found.append(CandidateReport(word, term.effect.name, was, after, own, verdict.alike, said, True))
    single = {fit.words[0]: fit for fit in reversed(ranked.fits) if len(fit.terms) == 1}
    seen = {report.effect for report in found}
    for looked in ranked.looked:
        word = looked.term.effect.word
        if word in seen:
            continue
        seen.add(word)
        found.append(_other(base, looked, single.get(word), ranked, best))
    return found[: len(best.terms)] + sorted(found[len(best.terms) :], key=lambda c: c.rmse_after_n)


def _other(base: Base, looked: Looked, fit: Joint | None, ranked: Ranked, best: Joint) -> CandidateReport:
    """An effect alone: estimated whole, or as the linear look saw it, which is no better than the best estimated.

    What a core that moves removes is none of the effect's.
    """
    scale, nothing = base.scale, ranked.nothing
    mse = fit.mse + ranked.tremble if fit else max(looked.leaves + ranked.tremble, left(best, base))
    if mse > REMOVES**2 * nothing.mse:
        mse = before(nothing, base)
    numbers = tuple(estimates_of(base, fit)) if fit is not None else ()
    name = fit.terms[0].effect.name if fit is not None else looked.term.effect.name
    was, after = (scale * float(np.sqrt(each)) for each in (before(nothing, base), min(mse, before(nothing, base))))
    said = f"{looked.term.effect.word} alone would leave {newtons(after)} {base.roles.unit}" + (
        "" if fit else ", at a linear look"
    )
    return CandidateReport(looked.term.effect.word, name, was, after, numbers, (), said, False)


def _said(base: Base, best: Joint, nothing: Joint, effect: Effect) -> str:
    scale = base.scale
    others = [word for word in best.words if word != effect.word]
    together = f" together with {' and '.join(others)}" if others else ""
    fall, was = nothing.block_mse - best.block_mse, before(nothing, base)
    removed = 100 * (1 - best.mse / was)
    return (
        f"{effect.word}{together} removes {removed:.0f} % of the squared error on held-back blocks"
        f" ({newtons(scale * was**0.5)} -> {newtons(scale * best.mse**0.5)} {base.roles.unit}),"
        f" better in {int(np.count_nonzero(fall > 0))} of {len(fall)} blocks"
        + (", looking ahead in the record where one is late: in flight that is extrapolated" if effect.ahead else "")
    )


def _named(record: Recording) -> list[str]:
    """Columns that may be a channel which effects read, under another name."""
    return list(advised({name: column for name, column in record.channels.items() if len(column)}).values())


def _advice(base: Base, ranked: Ranked, verdict: Verdict, not_judged: Sequence[NotJudged]) -> list[str]:
    floor, rest = base.scale * floor_of(verdict.fit, base), base.scale * float(np.sqrt(left(verdict.fit, base)))
    names = ", ".join(one.channel for one in verdict.channels)
    advice = []
    if verdict.words == ("unknown",) and verdict.channels:
        lead, *others = verdict.channels
        alike = "".join(f" or {one.channel}" for one in others if nearly(lead, one))
        advice.append(
            f"no effect that was judged explains how the residual follows {lead.channel}{alike}; its free curve does:"
            f" --effect {shlex.quote(lead.name)} adds it as it is; if you know the law behind it, add that instead"
        )
    elif more_left(base, verdict):
        along, unit = f", structure along {names}" if names else "", base.roles.unit
        why = "no effect explains the rest" if verdict.words == ("none",) else "something else too"
        advice.append(f"{newtons(rest)} {unit} left, floor about {newtons(floor)} {unit}{along}: {why}")
    if verdict.words == ("none",) and before(ranked.nothing, base) > (1.0 + WORTH) * rest**2 / base.scale**2:
        advice.append(
            f"{newtons(rest)} {base.roles.unit} with curve, relaxation, friction and load cell moved as far as the"
            " bench leaves open: identify the mount on these records and its bench together"
        )
    if base.own_mse * (1.0 + WORTH) < verdict.fit.mse:
        own, instead = (base.scale * float(np.sqrt(mse)) for mse in (base.own_mse, ranked.nothing.mse))
        advice.append(
            f"the model as it is leaves {newtons(own)} {base.roles.unit} of these records; effects are judged beside a"
            f" mount's curve and relaxation, which leave {newtons(instead)} {base.roles.unit} of blocks held back: one"
            " is added when it leaves less than the model does"
        )
    if verdict.alike:
        advice.append(f"these data do not tell {' and '.join(verdict.words)} from {' or '.join(verdict.alike)}")
        tests = {term.effect.word: term.effect.separating_test for fit in ranked.fits for term in fit.terms}
        words = dict.fromkeys([*verdict.words, *(word for one in verdict.alike for word in one.split("+"))])
        own = base.ours  # the tests speak of engines
        advice += [f"{word} alone would show so: {tests[word]}" for word in words if own and word in tests]
    return advice + not_judged_lines(not_judged)
