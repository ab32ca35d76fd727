"""Parameters of effects as a joint fit tells them, with one sigma each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import floor, log10
from typing import Any

import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.measures import SIGMAS_95
from thrustd.diagnose.search.base import Base, is_nuisance
from thrustd.diagnose.search.floor import EXACTLY
from thrustd.diagnose.search.joint import Joint, without
from thrustd.diagnose.search.spectra import many_words, together
from thrustd.identify.regression.free_run import simulate
from thrustd.identify.regression.shape import SPECTRUM
from thrustd.identify.regression.terms import Term, split
from thrustd.model.artifact import EffectSpec
from thrustd.model.effects import effect_named

NEGATIVE = "negative: "  # in the meaning of a parameter: what it is then
UNSCALED = "-", "s"  # units of amplitudes that the scale of a transducer does not touch


@dataclass(frozen=True, slots=True)
class ParameterEstimate:
    """One number with one sigma."""

    effect: str
    name: str
    value: float
    std: float
    unit: str
    expected: str
    bound: str = ""  # "lower" or "upper" where it ended on one
    negative: str = ""  # what it means that it is, where its card says so

    @property
    def half_width(self) -> float:
        """Of the 95 % interval: what "+-" stands for, here and everywhere."""
        return SIGMAS_95 * self.std

    @property
    def interval(self) -> str:
        """95 %, two digits of its half width; a number that ended where it cannot move has none."""
        wide = self.half_width
        unit = f" {self.unit}" if self.unit not in ("", "-") else ""
        if not wide > 0.0:
            return f"{self.value:.3g}{unit}{f' (its {self.bound} bound)' if self.bound else ''}"
        decimals = max(0, 1 - floor(log10(wide)))
        side = f" (negative: {self.negative})" if self.negative else ""
        return f"{self.value:.{decimals}f} +- {wide:.{decimals}f}{unit}{side}"

    @property
    def sentence(self) -> str:
        unit = f" {self.unit}" if self.unit not in ("", "-") else ""
        tail = ": these data do not tell it" if self.std >= abs(self.value) > 0 else ""
        tail += f"; negative: {self.negative}" if self.negative else ""
        tail += f"; it is on its {self.bound} bound" if self.bound else ""
        tail += f"; expected on PH-LAB: {self.expected}" if self.expected else ""
        return f"{self.effect}: {self.name} = {self.value:.4g} +- {self.half_width:.2g}{unit} (95 %){tail}"

    def to_json(self) -> dict[str, Any]:
        found = {"value": self.value, "std": self.std, "unit": self.unit, "expected": self.expected}
        said = {"bound": self.bound, "negative": self.negative}
        return found | {key: word for key, word in said.items() if word}


def sentences(numbers: Sequence[ParameterEstimate]) -> list[str]:
    """One a number; the elements of a spectrum or a curve in one."""
    return [sentence_of(every) for every in gathered(numbers)]


def gathered(numbers: Sequence[ParameterEstimate]) -> list[tuple[ParameterEstimate, ...]]:
    """Every number alone, but for the elements of a spectrum or a curve."""
    found = []
    for effect in dict.fromkeys(number.effect for number in numbers):
        own = {number.name: number for number in numbers if number.effect == effect}
        found += [tuple(own[name] for name in names) for names in together(own)]
    return found


def sentence_of(numbers: Sequence[ParameterEstimate]) -> str:
    """Of one number, or of one spectrum."""
    one = numbers[0]
    return one.sentence if len(numbers) == 1 else f"{one.effect}: {many_of(numbers)}"


def shown(numbers: Sequence[ParameterEstimate]) -> str:
    """In a table: a spectrum where there is one, else the first number that is not nothing."""
    every = sorted(gathered(numbers), key=lambda own: (len(own) == 1, own[0].value == 0.0))[:1]
    return "".join(many_of(own) if len(own) > 1 else f"{own[0].name} {own[0].interval}" for own in every)


def many_of(numbers: Sequence[ParameterEstimate]) -> str:
    """What a spectrum or a curve is like."""
    names, values = [number.name for number in numbers], [number.value for number in numbers]
    return many_words(numbers[0].effect, names, values, numbers[0].unit)


def specs_of(base: Base, fit: Joint) -> list[tuple[Term, EffectSpec]]:
    """Every effect of a fit, those that the model had first, with values and sigmas in units."""
    found = fit.solution
    where = found.shape.parts()["terms"]
    std = fit.std[where]
    terms = found.shape.terms
    parts = zip(terms, split(terms, found.point.terms), split(terms, std), strict=True)
    told = [(term, v, sigma) for term, v, sigma in parts if not is_nuisance(term)]
    return [(term, EffectSpec(term.effect.name, term.values(v), term.sigma(v, sigma))) for term, v, sigma in told]


Likely = Sequence[tuple[Joint, float]]  # fits, and how likely each is beside the best


def estimates_of(base: Base, fit: Joint, rivals: Likely = ()) -> list[ParameterEstimate]:
    """The numbers of the new effects; elements of friction that carry nothing are left out.

    rivals: fits of the same effects by other laws or from other starts, which the data hardly tell from this one. What
    these disagree by is part of what is not known of an amplitude (Draper, J. R. Stat. Soc. B 57 (1995) 45). A number
    means what its law says: another law is asked how much it does of what this one does.
    """
    found: list[ParameterEstimate] = []
    for term, spec in _new(base, fit):
        others = [(_disagreed(base, fit, rival, term, spec), share) for rival, share in rivals]
        found += lines_of(base, term, spec, others)
    return found


def _disagreed(base: Base, fit: Joint, rival: Joint, term: Term, spec: EffectSpec) -> dict[str, float]:
    """By how much a rival has other amplitudes of one effect."""
    own = spec.parameters
    other, theirs = next((t, s.parameters) for t, s in _new(base, rival) if t.effect.word == term.effect.word)
    if other.effect.name == term.effect.name:
        return {name: theirs[name] - own[name] for name in own}
    does, instead = _does(fit, term), _does(rival, other)
    share = float(does @ instead) / max(float(does @ does), EXACTLY) - 1.0
    return {p.name: share * (own[p.name] - p.neutral) for p in term.free}


def _does(fit: Joint, term: Term) -> Floats:
    """What a term makes of the force (n,) of all records: what a law bears like a spring beside it, a core may bear."""
    out, rest = (
        [simulate(one.solution.shape, one.solution.point, record) for record in fit.records]
        for one in (fit, without(fit, term))
    )
    return np.concatenate(out) - np.concatenate(rest)


def as_told(effects: Sequence[EffectSpec], numbers: Sequence[ParameterEstimate]) -> list[EffectSpec]:
    """Effects with the sigmas that these numbers tell, for a model's file: with what a scale or a rival leaves open."""
    std = {(number.effect, number.name): number.std for number in numbers}
    found = []
    for one in effects:
        word = effect_named(one.name).word
        found.append(EffectSpec(one.name, one.parameters, {p: std.get((word, p), own) for p, own in one.std.items()}))
    return found


def disputed(fit: Joint, rivals: Sequence[Joint]) -> set[str]:
    """Effects that this fit, or a rival, does not tell from nothing (95 %); a spectrum is told by the blocks."""
    return {
        term.effect.word
        for one in (fit, *rivals)
        for term, sigmas in zip(one.terms, one.sigmas, strict=True)
        if sigmas <= SIGMAS_95
    }


def unsized(base: Base, fit: Joint, rivals: Likely) -> set[str]:
    """Effects of whose size the intervals, as they are printed, say that it may be nothing."""
    half = {(n.effect, n.name): n.half_width for n in estimates_of(base, fit, rivals)}
    found = set()
    for term, spec in _new(base, fit):
        away = {p.name: abs(spec.parameters[p.name] - p.neutral) for p in term.free if p.amplitude and not p.beside}
        told = [name for name, by in away.items() if by > half.get((term.effect.word, name), 0.0)]
        if len(away) < SPECTRUM and not told:
            found.add(term.effect.word)
    return found


def _new(base: Base, fit: Joint) -> list[tuple[Term, EffectSpec]]:
    return specs_of(base, fit)[sum(not is_nuisance(term) for term in base.shape.terms) :]


def lines_of(
    base: Base, term: Term, spec: EffectSpec, others: Sequence[tuple[Mapping[str, float], float]] = ()
) -> Sequence[ParameterEstimate]:
    """The numbers of one effect; `others`: by how much other fits have others, and how likely these are."""
    lines = []
    many = sum(p.amplitude for p in term.free) > 2
    for p in term.free:
        value = spec.parameters[p.name]
        if many and value == p.neutral:
            continue
        bound = "lower" if value <= p.low and p.low != p.neutral else "upper" if value >= p.high else ""
        std = _finite(spec.std.get(p.name, float("nan")))
        if p.amplitude and p.unit not in UNSCALED:  # measured by a transducer whose scale is known so well
            std = float(np.hypot(std, base.calibration * value))
        if p.amplitude:
            apart = max((share**0.5 * abs(away.get(p.name, 0.0)) for away, share in others), default=0.0)
            std = float(np.hypot(std, apart))
        unit, expected = base.roles.measured_in(p.unit), p.expected if base.ours else ""
        side = p.meaning.partition(NEGATIVE)[2] if value < 0.0 else ""
        lines.append(ParameterEstimate(term.effect.word, p.name, value, std, unit, expected, bound, side))
    return lines


def _finite(value: float) -> float:
    return float(value) if np.isfinite(value) else 0.0
