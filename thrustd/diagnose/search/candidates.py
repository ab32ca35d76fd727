"""Absent effects as columns: what each would change in the model's force, per unit of its amplitude.

An effect that is neutral does nothing, so its first-order influence is the difference quotient at a typical amplitude;
shape parameters (a yield deformation, a time constant) are tried at each of their `starts` and polished later, for
those candidates that matter. No code per effect: everything comes from its card.
"""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import msgspec
import numpy as np

from thrustd.diagnose.search.evidence import Evidence
from thrustd.model.artifact import EffectSpec, ModelSpec
from thrustd.model.effect import Effect, Parameter
from thrustd.model.stage import Floats
from thrustd.records.recording import Recording

STILL = 1e-3  # a channel moves when its spread exceeds this share of its typical size ...
TRAVEL_MM = 1.2  # of a PH-LAB mount between idle and full thrust, for which the starts of the effects are made
ORDER = 3.0  # times more or less is another order of magnitude
LEAST = 1e-3  # of the typical amplitude: a difference quotient needs some difference


@dataclass(frozen=True, slots=True)
class Candidate:
    """One effect with one choice of shape parameters; columns (n, k), one per amplitude, force per unit of it."""

    effect: Effect
    parameters: dict[str, float]  # amplitudes at the value where the column was taken
    amplitudes: tuple[str, ...]
    columns: Floats

    @property
    def word(self) -> str:
        return self.effect.word

    def spec(self) -> EffectSpec:
        return EffectSpec(self.effect.name, dict(self.parameters))

    def impossible(self, values: Floats) -> bool:
        """Whether an amplitude lies where physics does not allow it: the effect could not become what was judged."""
        by_name = {p.name: p for p in self.effect.parameters}
        pairs = [(by_name[name], value) for name, value in zip(self.amplitudes, values, strict=True)]
        return any(not p.low <= v <= p.high for p, v in pairs)

    def with_amplitudes(self, values: Sequence[float] | Floats) -> dict[str, float]:
        """Parameters with amplitudes clipped to their bounds."""
        by_name = {p.name: p for p in self.effect.parameters}
        clipped = {
            name: float(np.clip(value, by_name[name].low, by_name[name].high))
            for name, value in zip(self.amplitudes, values, strict=True)
        }
        return self.parameters | clipped


@dataclass(frozen=True, slots=True)
class NotJudged:
    """An effect the data say nothing about, and why."""

    effect: str
    reason: str


def with_effect(spec: ModelSpec, effect: EffectSpec) -> ModelSpec:
    """The model with one effect more, last of its site."""
    return msgspec.structs.replace(spec, effects=[*spec.effects, effect], witness=None)


def judgeable(
    effects: Sequence[Effect], spec: ModelSpec, records: Sequence[Recording], present: Sequence[str]
) -> tuple[list[Effect], list[NotJudged]]:
    """Effects whose channels are there and move, and the others with the reason."""
    able, unable = [], []
    for effect in effects:
        reason = _reason(effect, records, present)
        if reason:
            unable.append(NotJudged(effect.name, reason))
        elif effect.word not in present:
            able.append(effect)
    return able, unable


def _reason(effect: Effect, records: Sequence[Recording], present: Sequence[str]) -> str:
    if effect.word in present:
        return ""
    for channel in effect.channels:
        if channel == "time_s":
            continue
        if not all(channel in record for record in records):
            return f"channel {channel} is not in the data"
        if not any(moves(record[channel]) for record in records):
            return f"channel {channel} never moves"
    return ""


def moves(column: Floats) -> bool:
    """Whether a channel varies at all, beyond its last digit."""
    good = column[np.isfinite(column)]
    if good.size < 2:
        return False
    low, high = np.quantile(good, [0.001, 0.999])
    return bool(high - low > STILL * max(abs(low), abs(high), 1e-9))


def anchors(effect: Effect, evidence: Evidence, spec: ModelSpec) -> dict[str, tuple[float, ...]]:
    """Values of the reference parameters (never estimated) that these data suggest."""
    deformation = evidence.channels["deformation_mm"]
    low, high = float(deformation.min()), float(deformation.max())
    known: dict[str, tuple[float, ...]] = {
        "reference_s": (float(evidence.time_s[0]),),
        "centre_mm": ((low + high) / 2,),
        "half_range_mm": (max((high - low) / 2, 0.05),),
    }
    if "temperature_degC" in evidence.channels:
        known["reference_degc"] = (_identified_at(spec, evidence),)
    by_name = {p.name: p for p in effect.parameters if not p.estimate}
    return {
        name: tuple(float(np.clip(v, by_name[name].low, by_name[name].high)) for v in values)
        for name, values in known.items()
        if name in by_name
    }


def _identified_at(spec: ModelSpec, evidence: Evidence) -> float:
    """Temperature of the identification if the artifact tells it, else that at the start of the data."""
    told = spec.provenance.get("mean_temperature_degC")
    if isinstance(told, int | float):
        return float(told)
    return float(np.mean(evidence.channels["temperature_degC"][: max(1, round(60.0 / evidence.row_s))]))


def shapes(effect: Effect, fixed: Mapping[str, tuple[float, ...]], scale: float = 1.0) -> Iterator[dict[str, float]]:
    """Every combination of starts of the shape parameters that can be estimated, the others at their first."""
    shape = [p for p in effect.parameters if not p.amplitude]
    for values in itertools.product(*(fixed.get(p.name, _starts(p, scale)) for p in shape)):
        yield dict(zip([p.name for p in shape], values, strict=True))


def _starts(p: Parameter, scale: float) -> tuple[float, ...]:
    """Starts of a shape parameter; millimetres go with the travel where that is of another order of magnitude."""
    starts = p.starts if p.estimate else p.starts[:1]
    return tuple(float(np.clip(scale * s, p.low, p.high)) for s in starts) if p.unit == "mm" else starts


def order_of(size: float, usual: float) -> float:
    """How many times the usual a size is; 1 within an order of magnitude."""
    return 1.0 if size <= 0.0 or usual / ORDER <= size <= usual * ORDER else size / usual


def amplitudes_of(effect: Effect) -> tuple[Parameter, ...]:
    return tuple(p for p in effect.parameters if p.amplitude and p.estimate)


def candidates(effect: Effect, spec: ModelSpec, evidence: Evidence, output_n: Floats) -> Iterator[Candidate]:
    """Candidates of one effect, one per combination of shape and per start of the (first) amplitude."""
    free = amplitudes_of(effect)
    scale = order_of(float(np.ptp(evidence.channels["deformation_mm"])), TRAVEL_MM)
    for shape in shapes(effect, anchors(effect, evidence, spec), scale):
        for start in free[0].starts if len(free) == 1 else (free[0].starts[0],):
            values = {p.name: p.starts[0] for p in free} | {free[0].name: start}
            yield column_at(effect, shape | values, spec, evidence, output_n)


def column_at(
    effect: Effect,
    parameters: Mapping[str, float],
    spec: ModelSpec,
    evidence: Evidence,
    output_n: Floats,
) -> Candidate:
    """Difference quotients at given parameters: each amplitude alone against neutral."""
    free = amplitudes_of(effect)
    columns = []
    for p in free:
        value = parameters[p.name] if abs(parameters[p.name] - p.neutral) > LEAST * abs(p.starts[0]) else p.starts[0]
        alone = dict(parameters) | {q.name: q.neutral for q in free} | {p.name: value}
        changed = evidence.output(with_effect(spec, EffectSpec(effect.name, alone)))
        columns.append((changed - output_n) / (value - p.neutral))
    table = np.column_stack(columns)
    table[~np.isfinite(table)] = 0.0
    return Candidate(effect, dict(parameters), tuple(p.name for p in free), table)


def moved_shape(
    candidate: Candidate, name: str, value: float, spec: ModelSpec, evidence: Evidence, output_n: Floats
) -> Candidate:
    """The candidate with another value of one shape parameter."""
    changed = column_at(candidate.effect, candidate.parameters | {name: value}, spec, evidence, output_n)
    return replace(changed, parameters=dict(candidate.parameters) | {name: value})
