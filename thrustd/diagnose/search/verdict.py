"""From rounds of selection to a verdict: effects by name, none, or unknown.

none      nothing absent removes enough on held-back blocks, and no channel carries structure that is left
unknown   a channel carries structure (a free curve of it removes it), but no effect of the library does
names     otherwise, in the order they were found; free curves then only show what is still left
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from thrustd.diagnose.search.dependence import OWN
from thrustd.diagnose.search.evidence import Evidence
from thrustd.diagnose.search.expected import own_error_n
from thrustd.diagnose.search.gram import Fit, gain_t
from thrustd.diagnose.search.pairs import Pair, best_pair, preferred
from thrustd.diagnose.search.pruning import redundant, without
from thrustd.diagnose.search.selection import (
    ENOUGH,
    MOST,
    Progress,
    Round,
    Scored,
    acceptable,
    buried,
    look,
    rank,
    taken,
    with_absorbed,
)
from thrustd.diagnose.search.together import FAMILIAR
from thrustd.model.artifact import EffectSpec, ModelSpec
from thrustd.model.effect import Effect

STRUCTURE = 0.5  # of the own squared error: what a free curve must still remove to count as structure
BY_CHANNEL = 0.5  # of that which a mere constant (offset and gain) would not
IMPOSTOR = 0.3  # of the own squared error: a free curve of one channel beats all effects found by this much
PAIR = 0.1  # of the own squared error: so much more than the best free curve may two effects leave
WELL = 1.05  # of the own squared error: what leaves less needs no better explanation
MUCH = 1.3  # of the own squared error: with more left, two effects are asked though neither shows alone; 1.23 at most
# was left of 70 records with nothing hidden
NEARLY = 0.1  # channels that remove this much less than the best are named too
UNSAID = 2.0  # squared error in units of the own one, unexplained by anything: unknown without a channel
SURE_CURVE = 2.5


@dataclass(frozen=True, slots=True)
class Judgement:
    """The verdict with everything it rests on."""

    verdict: tuple[str, ...]
    found: tuple[Scored, ...]  # effects of the verdict, in the order they were found
    added: tuple[EffectSpec, ...]
    rounds: tuple[Round, ...]  # the first looks at the model as given
    own_n: float  # what the model leaves where nothing is missing
    promised: bool  # own_n comes from the artifact (else the best that anything reached)
    channels: tuple[str, ...]  # which carry structure, best first
    spec: ModelSpec | None = None  # the model with the effects found
    deep: bool = False  # found only when the present parameters are re-estimated along


def judge(
    spec: ModelSpec, evidence: Evidence, effects: Sequence[Effect], progress: Progress | None = None
) -> Judgement:
    """The verdict of the rounds, or two effects at once where these explain better."""
    said, first = _one_by_one(spec, evidence, effects, progress)
    enough = WELL if said.found or said.channels else MUCH
    well = _left_n2(said) <= enough * said.own_n**2
    return said if well else _or_a_pair(said, first, effects, evidence)


def _one_by_one(
    spec: ModelSpec, evidence: Evidence, effects: Sequence[Effect], progress: Progress | None = None
) -> tuple[Judgement, Round]:
    """Rounds of selection until nothing is worth adding, then the question whether something else is left.

    With the verdict the first look, its present parameters as identified.
    """
    rounds: list[Round] = []
    found: list[Scored] = []
    added: list[EffectSpec] = []
    own_n, promised = 0.0, False
    while True:
        absent = [e for e in effects if e.word not in {s.candidate.word for s in found}]
        rounds.append(look(spec, evidence, absent, added, _within(progress, len(rounds))))
        if len(rounds) == 1:
            promised = spec.error is not None
            rounds[0] = rounds[0] if promised else with_absorbed(rounds[0], evidence)
            own_n = _own_n(spec, evidence, rounds[0])
            if promised and rounds[0].before.mse <= FAMILIAR * own_n**2:
                rounds[0] = with_absorbed(rounds[0], evidence)
                if (deep := buried(rounds[0])) is not None:
                    return _deep(deep, own_n), rounds[0]
        able = [s for s in rounds[-1].scored if acceptable(s, own_n, first=not found)]
        best = min(able, key=lambda s: rank(s, own_n), default=None)
        if best is None or len(found) == MOST:
            break
        spec, effect = taken(spec, best)
        found.append(best)
        added.append(effect)
    spec = _exchanged(spec, evidence, effects, rounds, found, added, own_n)
    while (idle := redundant(spec, added, evidence, ENOUGH * own_n**2)) is not None:
        found.pop(added.index(idle))
        added.remove(idle)
        spec = without(spec, idle)
    if not found:
        rounds[0] = rounds[0] if rounds[0].absorbed is not None else with_absorbed(rounds[0], evidence)
        if (deep := buried(rounds[0])) is not None and not _outdone(deep, own_n):
            return _deep(deep, own_n, promised), rounds[0]
    return replace(_concluded(rounds, found, added, own_n, promised), spec=spec), rounds[0]


def _or_a_pair(said: Judgement, first: Round, effects: Sequence[Effect], evidence: Evidence) -> Judgement:
    """The verdict, unless two effects explain better: those that hide each other, or that a third imitates."""
    own_n = said.own_n
    pair = best_pair(first, evidence, effects, own_n)
    if pair is None:
        return said
    if said.found and not preferred(pair, said.found, _left_n2(said), own_n):
        return said
    if not said.found and pair[0].fit.mse > min(f.mse for f in first.curves.values()) + PAIR * own_n**2:
        return said
    found, added, rounds, spec = _each_beside_the_other(pair, evidence, effects, first)
    if not all(acceptable(scored, own_n) for scored in found):
        return said
    then = _concluded(
        [*rounds, look(spec, evidence, _absent(effects, found), added)], found, added, own_n, said.promised
    )
    return said if then.verdict == ("unknown",) else replace(then, spec=spec)


def _each_beside_the_other(
    pair: Pair, evidence: Evidence, effects: Sequence[Effect], first: Round
) -> tuple[list[Scored], list[EffectSpec], list[Round], ModelSpec]:
    """The two with all others judged in their place: who else could stand there is seen only beside its partner."""
    spec, one = taken(first.spec, pair[0])
    spec, two = taken(spec, pair[1])
    found, added, rounds = list(pair), [one, two], [first]
    for i in range(2):
        bare, others = without(spec, added[i]), [added[1 - i]]
        rounds.append(look(bare, evidence, _absent(effects, [found[1 - i]]), others))
        found[i] = next(s for s in rounds[-1].scored if s.candidate.word == found[i].candidate.word)
        spec, added[i] = taken(bare, found[i])
    return found, added, rounds, spec


def _absent(effects: Sequence[Effect], found: Sequence[Scored]) -> list[Effect]:
    words = {scored.candidate.word for scored in found}
    return [effect for effect in effects if effect.word not in words]


def _left_n2(said: Judgement) -> float:
    """Held-back squared error with all effects found."""
    return said.found[0].fit.mse if said.deep else said.rounds[-1].before.mse


def _exchanged(
    spec: ModelSpec,
    evidence: Evidence,
    effects: Sequence[Effect],
    rounds: list[Round],
    found: list[Scored],
    added: list[EffectSpec],
    own_n: float,
) -> ModelSpec:
    """The model after a second thought: what was taken early was the best alone, is it still so beside the others?

    Each effect but the last is judged anew against all absent ones with the others in place, and gives way to a better
    one or to a better variant of itself.
    What is told of it, look-alikes above all, is of that place: in the first look much else explains the rest.
    """
    changed = False
    for i in range(len(found) - 1):
        bare, others = without(spec, added[i]), [e for j, e in enumerate(added) if j != i]
        words = {s.candidate.word for j, s in enumerate(found) if j != i}
        again = look(bare, evidence, [e for e in effects if e.word not in words], others)
        best = min((s for s in again.scored if acceptable(s, own_n)), key=lambda s: rank(s, own_n), default=None)
        if best is None:
            continue
        if best.candidate.effect.name != found[i].candidate.effect.name:
            spec, added[i] = taken(bare, best)
            changed = True
        found[i] = best
        rounds.insert(-1, again)
    if changed:
        absent = [e for e in effects if e.word not in {s.candidate.word for s in found}]
        rounds.append(look(spec, evidence, absent, added))
    return spec


def _outdone(deep: Round, own_n: float) -> bool:
    """Whether a free curve of one channel beats the effect and everything re-estimated along: then it is not that."""
    channels = structured(deep, own_n)
    return bool(channels) and deep.curves[channels[0]].mse < deep.scored[0].fit.mse - IMPOSTOR * own_n**2


def _deep(first: Round, own_n: float, promised: bool = True) -> Judgement:
    """The effect that is in the identification data too, found with the present parameters re-estimated along."""
    best = first.scored[0]
    spec, effect = taken(first.spec, best)
    return Judgement((best.candidate.word,), (best,), (effect,), (first,), own_n, promised, (), spec=spec, deep=True)


def _own_n(spec: ModelSpec, evidence: Evidence, first: Round) -> float:
    """What the artifact promises; without a promise the best that anything reached."""
    promised = own_error_n(spec, evidence, first.output_n)
    if promised is not None:
        return min(promised, first.before.rmse)
    fits = [first.before, *(s.fit for s in first.scored), *first.curves.values()]
    return min(fit.rmse for fit in (*fits, first.absorbed) if fit is not None)


def _concluded(
    rounds: list[Round], found: list[Scored], added: list[EffectSpec], own_n: float, promised: bool
) -> Judgement:
    first, last = rounds[0], rounds[-1]
    left, read = structured(last, own_n), {c for s in found for c in s.candidate.effect.channels}

    def outdoes(name: str) -> bool:
        """Whether a free curve of this channel alone beats all effects found."""
        left_n2, curve_n2 = last.before_curves.mse, first.curves[name].mse
        much = curve_n2 < left_n2 - 0.25 * (first.before_curves.mse - left_n2)
        simpler = len(found) > 1 and name != "time_s"  # one channel, where several effects leave structure
        whole = name not in read and curve_n2 < FAMILIAR * own_n**2 and (simpler or left_n2 > UNSAID * own_n**2)
        return name not in (*OWN, "(constant)") and curve_n2 < left_n2 - IMPOSTOR * own_n**2 and (much or whole)

    impostor = [name for name in sorted(first.curves, key=lambda n: first.curves[n].mse) if found and outdoes(name)]
    words = tuple(s.candidate.word for s in found)
    if found and not (impostor and left):
        return Judgement(words, tuple(found), tuple(added), tuple(rounds), own_n, promised, left)
    if found:
        return Judgement(("unknown",), (), (), tuple(rounds), own_n, promised, _nearest(first, impostor))
    unsaid = min(fit.mse for fit in (first.before, first.absorbed) if fit is not None) > UNSAID * own_n**2 and promised
    verdict = ("unknown",) if left or unsaid else ("none",)
    channels = left or (best_curves(first) if unsaid else ())
    return Judgement(verdict, (), (), tuple(rounds), own_n, promised, channels)


def structured(look_at: Round, own_n: float) -> tuple[str, ...]:
    """Channels whose free curve still removes enough, more than offset and gain would; best first."""
    before, constant = look_at.before_curves, look_at.curves["(constant)"]
    names = []
    for name, fit in sorted(look_at.curves.items(), key=lambda item: item[1].mse):
        removed = before.mse - fit.mse
        beyond = min(before.mse, constant.mse) - fit.mse
        if name in OWN or name == "(constant)" or removed < STRUCTURE * own_n**2:
            continue
        if beyond >= BY_CHANNEL * removed and _sure(before, fit):
            names.append(name)
    best = _own_curve(look_at)
    names = [n for n in names if look_at.curves[n].mse < best - 0.25 * (before.mse - best)]
    return _nearest(look_at, names)


def _nearest(look_at: Round, names: Sequence[str]) -> tuple[str, ...]:
    """The best of the channels and those which remove nearly as much (correlated channels)."""
    if not names:
        return ()
    before, best = look_at.before_curves.mse, look_at.curves[names[0]].mse
    near = [n for n in names if look_at.curves[n].mse <= best + NEARLY * (before - best)]
    return tuple(sorted(near, key=lambda n: n == "time_s"))  # the clock stands for whatever went on meanwhile


def _own_curve(look_at: Round) -> float:
    """Squared error after a free curve of what the model itself reads: not an absent effect, but a poor model."""
    return min([look_at.before_curves.mse, *(look_at.curves[n].mse for n in OWN if n in look_at.curves)])


def _sure(before: Fit, after: Fit) -> bool:
    return gain_t(before, after) >= SURE_CURVE


def best_curves(look_at: Round) -> tuple[str, ...]:
    """The one channel with the best free curve."""
    names = [n for n in look_at.curves if n != "(constant)"]
    return (min(names, key=lambda n: look_at.curves[n].mse),) if names else ()


def _within(progress: Progress | None, number: int) -> Progress | None:
    if progress is None:
        return None
    begin = 1 - 0.6**number
    return lambda share, what: progress(begin + share * 0.4 * 0.6**number, what)
