"""Which set of effects a flight shows, each weighed by evidence against what its brochure may be wrong by.

Sets grow one effect at a time while the next one makes the readings clearly likelier: by SURE for every law that was
looked at, as much as it takes to be so much surer than before anything was known. What is held back has to bear it out.
Of sets not told apart the one with fewer numbers grows. A set that is not SURE times likelier than another one of as
many effects is not told from it. An effect may be in the mount that is judged, in the engine's other one, or in both
(`aboard`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import log

import numpy as np

from thrustd.core.measures import SIGMAS_95, rms
from thrustd.core.types import Progress
from thrustd.diagnose.compare.newtons import newtons
from thrustd.diagnose.search.aboard import BOTH, Placed, places, sized
from thrustd.diagnose.search.base import Base
from thrustd.diagnose.search.candidates import NotJudged, judgeable, not_judged_lines
from thrustd.diagnose.search.diagnose_report import CandidateReport, DiagnoseReport
from thrustd.diagnose.search.explained import SETS, Explained, Stretch
from thrustd.diagnose.search.held_back import HeldBack, as_recordings_scatter, held_back, left_n, told
from thrustd.diagnose.search.library import of_the_rubber, terms_in_flight
from thrustd.diagnose.search.question import Given, Question, asked_for
from thrustd.diagnose.search.told import ParameterEstimate, lines_of
from thrustd.diagnose.search.weigh import SURE, Flown, Weighed, flown, weigh
from thrustd.identify.regression.terms import Term
from thrustd.model.artifact import ModelSpec
from thrustd.model.effect import Effect
from thrustd.model.effects import effect_named, shelf

MOST = 3  # effects in a set
TRIED = 4  # estimated whole at every size
LOOK = 1  # Gauss-Newton step
HIDDEN = 4  # effects said that may hide
MUCH = 4.0  # times the variance that the readings should have: something else is missing too
AGAINST = "against the brochure"
HELD_BACK = f"{AGAINST}, on parts held back"
TOLD_BY_BENCH = "remembers the deformation alone: a bench tells it, no flight"
NOT_FORETOLD = "fits these flights, but a part held back does not bear it out: not named"
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
                "+".join((*one.words, *one.elsewhere))
                for one in self.sets
                if 0 < len(one.placed) <= len(self.best.placed)
                and set(one.words) != set(self.best.words)
                and one.likelier(self.nothing) > gain - log(SURE)
            )
        )


def searched(given: Flown, terms: Sequence[Term], progress: Progress | None = None) -> Found:
    """Grow the best set of these terms."""
    nothing = best = weigh(given, ())
    placed = [one for term in terms for one in places(term, given.mounts)]
    sets: list[Weighed] = [nothing]
    alone: list[tuple[float, Weighed]] = []
    certain = SURE * len({(one.word, one.where) for one in placed})
    held, not_foretold = None, tuple[str, ...]()
    for size in range(MOST):
        if progress is not None:
            progress(size / MOST, "effects")
        looked = _looked(given, best, placed)
        grown = [weigh(given, one.placed) for _, one in _leading(looked)]
        sets += grown
        if size == 0:
            alone = looked
        larger = _simplest(grown, best)
        if larger is best or larger.likelier(best) < log(certain):
            break
        judged = held_back(given, larger, best)
        if judged.likelier <= 0.0 or not judged.fell or not told(as_recordings_scatter(given, larger)):
            not_foretold = larger.words or larger.elsewhere
            break
        held = judged if best is nothing else held_back(given, larger, nothing)
        best = larger
    return Found(nothing, as_recordings_scatter(given, best), tuple(sets), tuple(alone), held, not_foretold)


def _simplest(grown: Sequence[Weighed], best: Weighed) -> Weighed:
    """Of the sets that are not told from the likeliest the one with fewer numbers, then the likelier one."""
    gains = [one.likelier(best) for one in grown]
    alike = [
        (len(one.numbers), -gain, i)
        for i, (one, gain) in enumerate(zip(grown, gains, strict=True))
        if gain > max(gains) - log(SURE)
    ]
    return grown[min(alike)[-1]] if alike else best


def _looked(given: Flown, best: Weighed, placed: Sequence[Placed]) -> list[tuple[float, Weighed]]:
    """Every effect beside the best set with its shape where it begins; of its laws and starts the likeliest."""
    found: dict[tuple[str, str], tuple[float, Weighed]] = {}
    for one in placed:
        if any(one.word == known.word and one.here == known.here for known in best.placed):
            continue
        begin = np.append(best.numbers, np.zeros(len(one.fixed().term.free)))
        looked = weigh(given, (*best.placed, one.fixed()), LOOK, begin)
        gain, place = looked.likelier(best), (one.word, one.where)
        if place not in found or gain > found[place][0]:
            found[place] = gain, replace(looked, placed=(*best.placed, one))
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
    every = [*possible, *asked_for(extra, question.records)]
    others = [one for one in every if not of_the_rubber(one)]
    effects, not_judged = judgeable(others, question.records, ())
    elsewhere = {one.word for one in others}
    told = dict.fromkeys(one.word for one in every if one.word not in elsewhere)
    not_judged += [NotJudged(word, TOLD_BY_BENCH) for word in told]
    seen, terms = flown(spec, question, given), terms_in_flight(spec, effects, question.rig)
    found = searched(seen, terms, progress)
    best, more = found.best, found.best.squares > MUCH * found.best.rows
    grade = "cannot be told" if found.alike or not best.words else "weak" if more else "strong"
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
    parts = sized(one.placed, one.numbers, one.std)
    return [line for each, found in parts if each.here for line in lines_of(base, each.term, found)]


def several_flights(seen: Flown, base: Base, best: Weighed) -> list[str]:
    """What every recording says alone, beside what all say together."""
    if not best.words or len(seen.recordings) < 2:
        return []
    alone = {name: numbers_of(base, weigh(seen.only(name), best.placed)) for name in seen.recordings}
    found = []
    for i, all_say in enumerate(numbers_of(base, best)):
        each = [(name, numbers[i]) for name, numbers in alone.items() if i < len(numbers)]
        said = ", ".join(f"{one.interval} ({name})" for name, one in each)
        found.append(
            f"{all_say.effect}: {all_say.name} = {all_say.interval} from {len(each)} recordings; alone they say {said}"
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
    if best.elsewhere:
        advice.append(f"{seen.mounts[1].place.mount} is not as its model says, alone: {' and '.join(best.elsewhere)}")
    if not best.words:
        advice += [NO_PROOF, *_may_hide(base, seen, found)]
    return advice + several_flights(seen, base, best)


def _may_hide(base: Base, seen: Flown, found: Found) -> list[str]:
    """Of the effects looked at alone: what their intervals hold, how much force that is, and what each flight says."""
    plain = np.concatenate(found.nothing.forces_n)
    held: dict[str, tuple[float, str, Weighed]] = {}
    for _, one in found.looked:
        alone = replace(one, placed=(one.placed[-1].fixed(),))
        numbers = numbers_of(base, alone)
        if len(numbers) == 1 and one.numbers[0] != 0.0:
            (number,) = numbers
            per_sigma_n = rms(np.concatenate(one.forces_n) - plain) / abs(float(one.numbers[0]))
            most_n = per_sigma_n * (abs(float(one.numbers[0])) + SIGMAS_95 * float(one.std[0]))
            if number.effect not in held or most_n > held[number.effect][0]:
                held[number.effect] = most_n, f"{number.effect} {number.interval}", alone
    most = sorted(held.values(), key=lambda each: each[0], reverse=True)[:HIDDEN]
    lines = [f"{line} ({newtons(most_n)} N)" for most_n, line, _ in most]
    told = [f"what may hide (95 %, each alone): {'; '.join(lines)}"] if lines else []
    return told + [line for *_, alone in most for line in several_flights(seen, base, alone)]


def _candidates(spec: ModelSpec, seen: Flown, base: Base, found: Found) -> list[CandidateReport]:
    before_n, after_n = found.left_n(seen)
    numbers, said = numbers_of(base, found.best), []
    for placed in found.best.placed:
        word = placed.word
        if not placed.here:
            continue
        others = [other for other in found.best.words if other != word]
        together = f" together with {' and '.join(others)}" if others else ""
        gain = found.best.likelier(found.nothing) / log(10)
        line = f"{word}{together}: what mount and brochure say is 10^{gain:.0f} times likelier than with no effect"
        line += f"; {newtons(before_n)} -> {newtons(after_n)} N on parts held back{_where(placed, seen)}"
        own = tuple(n for n in numbers if n.effect == word)
        said.append(CandidateReport(word, placed.term.effect.name, before_n, after_n, own, found.alike, line, True))
    present = {effect_named(effect.name).word for effect in spec.effects}
    plain_n = left_n(seen, found.nothing)
    for gain, one in found.looked:
        placed = one.placed[-1]
        if placed.word in (*found.best.words, *present) or not placed.here:
            continue
        present.add(placed.word)
        alone_n = min(plain_n, left_n(seen, one))
        line = f"{placed.word} alone: 10^{gain / log(10):.0f} times as likely, at a linear look"
        said.append(CandidateReport(placed.word, placed.term.effect.name, plain_n, alone_n, (), (), line, False))
    return said


def _where(placed: Placed, seen: Flown) -> str:
    """In words, where there is a choice."""
    if len(seen.mounts) == 1:
        return ""
    return f"; {seen.mounts[1].place.mount} {'shows it too' if placed.where == BOTH else 'does not show it'}"


def _explained(seen: Flown, found: Found) -> Explained:
    """The best set and the best other one, sample by sample."""
    ordered = sorted((one for one in found.sets if one.words), key=lambda one: -one.likelier(found.nothing))
    others = [one for one in ordered if one.words != found.best.words]
    sets = [found.best, *others][:SETS] if found.best.words else others[:SETS]
    stretches = []
    for i, source in enumerate(seen.sources):
        s, plain = source.segment, found.nothing.forces_n[i]
        explained_n = tuple(one.forces_n[i] - plain for one in sets)
        stretches.append(Stretch(s.time_s, s.dt_s, s.inputs, s.force_n - plain, explained_n))
    return Explained(
        tuple(one.words for one in sets),
        tuple(tuple(placed.term.effect.name for placed in one.placed if placed.here) for one in sets),
        tuple(left_n(seen, one) for one in sets),
        tuple(stretches),
    )
