"""Which set of effects a flight shows, each weighed by evidence against what its brochure may be wrong by.

Sets grow one effect at a time while the next one makes the readings clearly likelier: by SURE for every law that was
looked at, as much as it takes to be so much surer than before anything was known. It also has to foretell what is held
back. A set that is not SURE times likelier than another one of as many effects is not told from it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import log

import numpy as np

from thrustd.core.measures import SIGMAS_95, rms
from thrustd.core.types import Progress
from thrustd.diagnose.compare.newtons import newtons
from thrustd.diagnose.search.base import Base
from thrustd.diagnose.search.candidates import NotJudged, judgeable, not_judged_lines
from thrustd.diagnose.search.diagnose_report import CandidateReport, DiagnoseReport
from thrustd.diagnose.search.explained import SETS, Explained, Stretch
from thrustd.diagnose.search.held_back import HeldBack, as_recordings_scatter, held_back, left_n
from thrustd.diagnose.search.library import Rig, laws, terms_of
from thrustd.diagnose.search.question import Given, Question, asked_for
from thrustd.diagnose.search.told import ParameterEstimate, lines_of
from thrustd.diagnose.search.weigh import SURE, Flown, Weighed, flown, weigh
from thrustd.identify.regression.terms import Term, split
from thrustd.identify.segments import DEFORMATION
from thrustd.model.artifact import EffectSpec, ModelSpec
from thrustd.model.effect import Effect
from thrustd.model.effects import effect_named, shelf

MOST = 3  # effects in a set
TRIED = 4  # estimated whole at every size
LOOK = 1  # Gauss-Newton step
HIDDEN = 4  # effects said that may hide
MUCH = 4.0  # times the variance that the readings should have: something else is missing too
AGAINST = "against the brochure"
HELD_BACK = f"{AGAINST}, on parts held back"
RUBBER = "rubber"
TOLD_BY_BENCH = "remembers the deformation alone: a bench tells it, no flight"
NOT_FORETOLD = "fits these flights, but a part held back is not foretold better with it: not named"
NO_PROOF = "the brochure's own errors may hide an effect: none against it is no proof of a right model"


@dataclass(frozen=True, slots=True)
class Found:
    """Sets by evidence. `looked`: every effect alone, its best law, best first, with ln of how much likelier."""

    nothing: Weighed
    best: Weighed
    sets: tuple[Weighed, ...]  # estimated whole
    looked: tuple[tuple[float, Weighed], ...]
    held: HeldBack | None  # of the best against nothing
    not_foretold: tuple[str, ...]  # likelier on everything, not on what was held back

    def left_n(self, seen: Flown) -> tuple[float, float]:
        """Rms without and with the best set, N: on what was held back, where there is one."""
        if self.held is None:
            return left_n(seen, self.nothing), left_n(seen, self.best)
        return self.held.before_n, self.held.after_n

    @property
    def alike(self) -> tuple[str, ...]:
        """Other sets of no more effects that the readings do not tell from the best."""
        gain = self.best.likelier(self.nothing)
        return tuple(
            dict.fromkeys(
                "+".join(one.words)
                for one in self.sets
                if 0 < len(one.terms) <= len(self.best.terms)
                and set(one.words) != set(self.best.words)
                and one.likelier(self.nothing) > gain - log(SURE)
            )
        )


def terms_in_flight(spec: ModelSpec, effects: Sequence[Effect], rig: Rig) -> list[Term]:
    """Effects as terms; of a law that the model has, another size, where it is not the rubber that has it."""
    present = {effect.name: effect for effect in spec.effects}
    places = {(law.word, acts_on(law)) for law in map(effect_named, present)}
    found = []
    for effect in laws(effects):
        known = acts_on(effect) == RUBBER and (effect.word, RUBBER) in places
        if known or of_the_rubber(effect):
            continue
        if effect.name in present:
            values = effect.neutral() | present[effect.name].parameters
            first = next(terms_of(effect, rig))
            centre = {name: values[name] for name in first.std}
            found.append(replace(first, fixed=values, centre=centre, shapes=False))
        elif (effect.word, acts_on(effect)) not in places:  # elsewhere it is another effect of one cause
            found += terms_of(effect, rig)
    return found


def acts_on(effect: Effect) -> str:
    """Where it acts: on what the rubber holds, or on what its installation does to it."""
    return RUBBER if effect.site in ("gain", "spring", "linear") else effect.site


def of_the_rubber(effect: Effect) -> bool:
    """Whether it remembers, and nothing but the deformation: the bench has told it, with a load cell.

    No deck is as sure, and what the rubber remembers when a log begins in flight nobody knows.
    """
    return set(effect.channels) <= {DEFORMATION} and (effect.n_state > 0 or effect.lags is not None)


def searched(given: Flown, terms: Sequence[Term], certain: float, progress: Progress | None = None) -> Found:
    """Grow the best set of these terms. `certain`: times likelier that each effect has to make the readings."""
    nothing = best = weigh(given, ())
    sets: list[Weighed] = [nothing]
    alone: list[tuple[float, Weighed]] = []
    held, not_foretold = None, tuple[str, ...]()
    for size in range(MOST):
        if progress is not None:
            progress(size / MOST, "effects")
        looked = _looked(given, best, [term for term in terms if term.effect.word not in best.words])
        grown = [weigh(given, (*best.terms, one.terms[-1])) for _, one in _leading(looked)]
        sets += grown
        if size == 0:
            alone = looked
        larger = max(grown, key=lambda one: one.likelier(best), default=best)
        if larger is best or larger.likelier(best) < log(certain):
            break
        judged = held_back(given, larger, best)
        if not judged.better:
            not_foretold = larger.words
            break
        held = judged if best is nothing else held_back(given, larger, nothing)
        best = larger
    return Found(nothing, as_recordings_scatter(given, best), tuple(sets), tuple(alone), held, not_foretold)


def _looked(given: Flown, best: Weighed, terms: Sequence[Term]) -> list[tuple[float, Weighed]]:
    """Every effect beside the best set with its shape where it begins; of its laws and starts the likeliest."""
    found: dict[str, tuple[float, Weighed]] = {}
    for term in terms:
        one = weigh(given, (*best.terms, replace(term, shapes=False)), iterations=LOOK)
        gain, word = one.likelier(best), term.effect.word
        if word not in found or gain > found[word][0]:
            found[word] = gain, replace(one, terms=(*best.terms, term))
    return sorted(found.values(), key=lambda each: -each[0])


def _leading(looked: Sequence[tuple[float, Weighed]]) -> Sequence[tuple[float, Weighed]]:
    return [each for each in looked if each[0] > 0.0][:TRIED]


def diagnosed_in_flight(
    name: str,
    spec: ModelSpec,
    question: Question,
    given: Given,
    extra: Sequence[Effect | str],
    progress: Progress | None = None,
) -> DiagnoseReport:
    """The verdict on a mount whose reference is the brochure."""
    possible = [one for one in shelf().values() if one.word not in question.rig.priors.without]
    effects, not_judged = judgeable([*possible, *asked_for(extra, question.records)], question.records, ())
    not_judged += dict.fromkeys(NotJudged(one.word, TOLD_BY_BENCH) for one in effects if of_the_rubber(one))
    seen, terms = flown(spec, question, given), terms_in_flight(spec, effects, question.rig)
    found = searched(seen, terms, SURE * len({term.effect.word for term in terms}), progress)
    best, more = found.best, found.best.squares > MUCH * found.best.rows
    grade = "cannot be told" if found.alike or not best.terms else "weak" if more else "strong"
    left = *found.left_n(seen), expected_n(seen)
    advice = _advice(question.base, seen, found, left, more)
    return DiagnoseReport(
        name,
        tuple(record.name for record in question.records),
        best.words or ("none",),
        tuple(_candidates(spec, seen, question.base, found)),
        (),
        tuple(not_judged),
        (*advice, *not_judged_lines(not_judged)),
        *left,
        promised=True,
        grade=grade,
        more_left=more,
        explained=_explained(seen, found),
        judged=AGAINST,
    )


def expected_n(seen: Flown) -> float:
    """One sigma of the same when nothing is missing."""
    return rms(np.array([source.std_n for source in seen.sources]))


def numbers_of(base: Base, one: Weighed) -> list[ParameterEstimate]:
    """Sizes of the effects of a set."""
    parts = zip(one.terms, split(one.terms, one.numbers), split(one.terms, one.std), strict=True)
    specs = [(term, EffectSpec(term.effect.name, term.values(v), term.sigma(v, sigma))) for term, v, sigma in parts]
    return [line for term, found in specs for line in lines_of(base, term, found)]


def several_flights(seen: Flown, base: Base, best: Weighed) -> list[str]:
    """What every recording says alone, beside what all say together."""
    if not best.terms or len(seen.recordings) < 2:
        return []
    alone = {name: numbers_of(base, weigh(seen.only(name), best.terms)) for name in seen.recordings}
    found = []
    for i, all_say in enumerate(numbers_of(base, best)):
        each = [(name, numbers[i]) for name, numbers in alone.items() if i < len(numbers)]
        said = ", ".join(f"{one.value:.3g} +- {one.half_width:.1g} ({name})" for name, one in each)
        found.append(
            f"{all_say.effect}: {all_say.name} = {all_say.value:.4g} +- {all_say.half_width:.2g} {all_say.unit}"
            f" from {len(each)} recordings; alone they say {said}"
        )
    return found


def _advice(base: Base, seen: Flown, found: Found, left: tuple[float, float, float], more: bool) -> list[str]:
    """`left`: N before, after, and expected."""
    best, advice = found.best, []
    if more:
        advice.append(f"{newtons(left[1])} N left, expected about {newtons(left[2])} N: something else too")
    if found.alike:
        advice.append(f"these data do not tell {' and '.join(best.words)} from {' or '.join(found.alike)}")
    if found.not_foretold:
        advice.append(f"{' and '.join(found.not_foretold)} {NOT_FORETOLD}")
    if not best.terms:
        advice += [NO_PROOF, *_may_hide(base, found)]
    return advice + several_flights(seen, base, best)


def _may_hide(base: Base, found: Found) -> list[str]:
    """Of the effects looked at alone: what their intervals hold, and how much force that is."""
    plain = np.concatenate(found.nothing.forces_n)
    held = []
    for _, one in found.looked:
        term = replace(one.terms[-1], shapes=False)
        numbers = numbers_of(base, replace(one, terms=(term,)))
        if len(numbers) == 1 and one.numbers[0] != 0.0:
            (number,) = numbers
            per_sigma_n = rms(np.concatenate(one.forces_n) - plain) / abs(float(one.numbers[0]))
            most_n = per_sigma_n * (abs(float(one.numbers[0])) + SIGMAS_95 * float(one.std[0]))
            held.append((most_n, f"{number.effect} {number.value:.2g} +- {number.half_width:.1g} {number.unit}"))
    lines = [f"{line} ({newtons(most_n)} N)" for most_n, line in sorted(held, reverse=True)[:HIDDEN]]
    return [f"what may hide (95 %, each alone): {'; '.join(lines)}"] if lines else []


def _candidates(spec: ModelSpec, seen: Flown, base: Base, found: Found) -> list[CandidateReport]:
    before_n, after_n = found.left_n(seen)
    numbers, said = numbers_of(base, found.best), []
    for term in found.best.terms:
        word = term.effect.word
        others = [other for other in found.best.words if other != word]
        together = f" together with {' and '.join(others)}" if others else ""
        gain = found.best.likelier(found.nothing) / log(10)
        line = f"{word}{together}: what mount and brochure say is 10^{gain:.0f} times likelier than with no effect"
        line += f"; {newtons(before_n)} -> {newtons(after_n)} N on parts held back"
        own = tuple(n for n in numbers if n.effect == word)
        said.append(CandidateReport(word, term.effect.name, before_n, after_n, own, found.alike, line, True))
    present = {effect_named(effect.name).word for effect in spec.effects}
    plain_n = left_n(seen, found.nothing)
    for gain, one in found.looked:
        term = one.terms[-1]
        if term.effect.word in (*found.best.words, *present):
            continue
        alone_n = min(plain_n, left_n(seen, one))
        line = f"{term.effect.word} alone: 10^{gain / log(10):.0f} times as likely, at a linear look"
        said.append(CandidateReport(term.effect.word, term.effect.name, plain_n, alone_n, (), (), line, False))
    return said


def _explained(seen: Flown, found: Found) -> Explained:
    """The best set and the best other one, sample by sample."""
    ordered = sorted((one for one in found.sets if one.terms), key=lambda one: -one.likelier(found.nothing))
    others = [one for one in ordered if one.words != found.best.words]
    sets = [found.best, *others][:SETS] if found.best.terms else others[:SETS]
    stretches = []
    for i, source in enumerate(seen.sources):
        s, plain = source.segment, found.nothing.forces_n[i]
        explained_n = tuple(one.forces_n[i] - plain for one in sets)
        stretches.append(Stretch(s.time_s, s.dt_s, s.inputs, s.force_n - plain, explained_n))
    return Explained(
        tuple(one.words for one in sets),
        tuple(tuple(term.effect.name for term in one.terms) for one in sets),
        tuple(left_n(seen, one) for one in sets),
        tuple(stretches),
    )
