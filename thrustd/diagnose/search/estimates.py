"""Parameters of effects with honest error bars, in units a person can check.

Amplitudes and shapes are estimated by Levenberg-Marquardt on the full model (thrustd.identify.estimate), whose
covariance knows that the residual is coloured. Misfit of the model itself shows as estimates that differ from one part
of the record to another, so the spread over parts left out (a delete-a-group jackknife, Efron & Tibshirani 1993,
chapter 11) is computed as well, and the larger of the two counts. Misfit that lasts moves all parts alike: what the
rest of the model may do wrong, in the directions in which it can, is added to it. Where more is left than the model's
own error, the law itself does not hold: what it misses is seen only in part, since the estimate took as much of it as
it could. So the same again is granted to the direction in which each parameter moves the force.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import msgspec
import numpy as np

from thrustd.diagnose.search.candidates import column_at
from thrustd.diagnose.search.evidence import Evidence, base_patterns, lateness, put_back, simulate
from thrustd.diagnose.search.expected import own_error_n
from thrustd.diagnose.search.gram import orthonormal
from thrustd.diagnose.search.start import start_of
from thrustd.identify.estimate import EstimateSettings, estimate_segments
from thrustd.identify.parameters import effect_labels
from thrustd.identify.segments import Segment
from thrustd.model.artifact import EffectSpec, ModelSpec
from thrustd.model.effects import effect_named
from thrustd.model.stage import Floats

GROUPS = 12  # parts left out in turn
ITERATIONS = 8
PASSES = 2  # of the lateness and the rest in turn
NUDGE = 0.02  # of a shape parameter: its difference quotient
MAD = 1.4826  # median absolute value of normal noise -> sigma
LEAST_MISFIT = 0.25  # of the error left: what of it may be misfit of the model where it looks like noise


@dataclass(frozen=True, slots=True)
class ParameterEstimate:
    """One number with one sigma."""

    effect: str
    name: str
    value: float
    std: float
    unit: str
    expected: str

    @property
    def sentence(self) -> str:
        unit = f" {self.unit}" if self.unit not in ("", "-") else ""
        tail = f" (on PH-LAB {self.expected})" if self.expected else ""
        tail += ": these data do not tell it" if self.std >= abs(self.value) > 0 else ""
        return f"{self.effect}: {self.name} = {self.value:.4g} +- {self.std:.2g}{unit}{tail}"

    def to_json(self) -> dict[str, Any]:
        return {"value": self.value, "std": self.std, "unit": self.unit, "expected": self.expected}


def free_names(spec: ModelSpec, effects: Sequence[EffectSpec]) -> list[str]:
    """Names of the parameters of these effects that may be estimated (see thrustd.identify.parameters)."""
    names = []
    for label, present in zip(effect_labels(spec), spec.effects, strict=True):
        if present in effects:
            names += [f"{label}.{p.name}" for p in effect_named(present.name).parameters if p.estimate]
    return names


def estimated(
    spec: ModelSpec, effects: Sequence[EffectSpec], evidence: Evidence, rest_too: bool = False
) -> tuple[ModelSpec, list[ParameterEstimate]]:
    """The model with these of its effects re-estimated together on all the data, and the numbers.

    `rest_too`: curves and linear block are free as well, for an effect that they had to imitate when identified.
    """
    places = [i for i, present in enumerate(spec.effects) if present in effects]
    for _ in range(PASSES if _late(spec, places) else 0):
        spec = _retimed(_fitted(spec, places, evidence, rest_too)[0], places, evidence)
    spec, std = _fitted(spec, places, evidence, rest_too)
    spread = {} if rest_too and not _late(spec, places) else _spreads(spec, places, evidence)
    labels = effect_labels(spec)
    numbers: list[ParameterEstimate] = []
    finished = list(spec.effects)
    for i in places:
        effect = effect_named(finished[i].name)
        for p in effect.parameters:
            if p.estimate:
                sigma = max(std.get(f"{labels[i]}.{p.name}", 0.0), spread.get(f"{i}.{p.name}", 0.0))
                value = finished[i].parameters[p.name]
                numbers.append(ParameterEstimate(effect.word, p.name, value, sigma, p.unit, p.expected))
        sigmas = {n.name: n.std for n in numbers if n.effect == effect.word}
        finished[i] = EffectSpec(finished[i].name, finished[i].parameters, sigmas)
    return msgspec.structs.replace(spec, effects=finished), numbers


def _fitted(
    spec: ModelSpec, places: Sequence[int], evidence: Evidence, rest_too: bool
) -> tuple[ModelSpec, dict[str, float]]:
    """Levenberg-Marquardt on everything that is free but lateness, and one sigma by name."""
    punctual, late_s = lateness(spec)
    names = free_names(punctual, [spec.effects[i] for i in places]) + (base_patterns(punctual) if rest_too else [])
    if not names:
        return spec, {}
    settings = EstimateSettings(max_iterations=2 * ITERATIONS if rest_too else ITERATIONS, tolerance=1e-4)
    segments = [put_back(segment, late_s) for segment in _started(spec, places, evidence)]
    result = estimate_segments(punctual, segments, names, settings)
    moved = iter(result.spec.effects)
    effects = [next(moved) if effect in punctual.effects else effect for effect in spec.effects]
    std = {name: float(sigma) for name, sigma in zip(result.names, result.std, strict=True)}
    return msgspec.structs.replace(result.spec, effects=effects), std


def _late(spec: ModelSpec, places: Sequence[int]) -> list[int]:
    """Those of the places where a reading is late: beyond the reach of a causal estimation."""
    punctual = lateness(spec)[0].effects
    return [i for i in places if spec.effects[i] not in punctual]


def _retimed(spec: ModelSpec, places: Sequence[int], evidence: Evidence) -> ModelSpec:
    """The model with its lateness one Gauss-Newton step better, all other numbers of its effects free beside it."""
    names, table = _columns(spec, places, evidence)
    good, start = np.isfinite(evidence.reference_n), start_of(spec, evidence)
    residual = start.without(np.where(good, evidence.reference_n - evidence.output(spec), 0.0))
    size = np.maximum(np.sqrt(np.mean(table**2, axis=0)), 1e-300)
    step = np.linalg.lstsq(start.without(table / size * good[:, None]), residual, rcond=1e-6)[0] / size
    by_name, effects = dict(zip(names, step, strict=True)), list(spec.effects)
    for i in _late(spec, places):
        effect, values = effect_named(effects[i].name), dict(effects[i].parameters)
        for p in effect.parameters:
            if p.amplitude and p.estimate:
                values[p.name] = float(np.clip(values[p.name] + by_name[f"{i}.{p.name}"], 0.0, p.high))
        effects[i] = EffectSpec(effect.name, values, effects[i].std)
    return msgspec.structs.replace(spec, effects=effects)


def _started(spec: ModelSpec, places: Sequence[int], evidence: Evidence) -> list[Segment]:
    """The segments, their reference without what the unknown state at the start most likely adds."""
    start = start_of(spec, evidence)
    if not start.strength.size:
        return list(evidence.segments)
    good = np.isfinite(evidence.reference_n)
    residual = np.where(good, evidence.reference_n - evidence.output(spec), 0.0)
    table = _amplitude_columns(spec, places, evidence)[1] * good[:, None]
    size = np.maximum(np.sqrt(np.mean(table**2, axis=0)), 1e-300)
    beta = np.linalg.lstsq(start.without(table / size), start.without(residual), rcond=1e-6)[0] / size
    added = start.likely(residual - table @ beta)
    segments = []
    for i, segment in enumerate(evidence.segments):
        mine = evidence.segment == i
        drift = np.interp(segment.time_s, evidence.time_s[mine], added[mine])
        segments.append(replace(segment, force_n=segment.force_n - drift))
    return segments


def _spreads(spec: ModelSpec, places: Sequence[int], evidence: Evidence) -> dict[str, float]:
    """One sigma of each parameter, linear about the solution: parts left out, and misfit of the model beside it."""
    names, table = _columns(spec, places, evidence)
    start, good = start_of(spec, evidence), np.isfinite(evidence.reference_n)
    residual = start.without(np.where(good, evidence.reference_n - evidence.output(spec), 0.0))
    seen = start.without(table * good[:, None])
    left_out = np.array(_spread(seen, np.where(good, residual, np.nan), evidence))
    rest, law = _misfit_std(spec, seen, evidence), _law_std(spec, seen[good], residual, evidence)
    return dict(zip(names, map(float, np.sqrt(left_out**2 + rest**2 + law**2)), strict=True))


def _law_std(spec: ModelSpec, table: Floats, residual: Floats, evidence: Evidence) -> Floats:
    """One sigma by what the law of the effect misses: E^2 n (Z'Z)^-1, E^2 = squared error left beyond the own one."""
    own_n = own_error_n(spec, evidence, evidence.output(spec))
    if own_n is None:
        return np.zeros(table.shape[1])
    beyond_n2 = float(residual @ residual) / len(table) + evidence.white_n2(spec) - own_n**2
    size = np.maximum(np.sqrt(np.mean(table**2, axis=0)), 1e-300)
    inverse = np.linalg.pinv((table / size).T @ (table / size) / len(table), rcond=1e-9)
    return np.sqrt(max(0.0, beyond_n2) * np.diagonal(inverse)) / size


def _misfit_std(spec: ModelSpec, table: Floats, evidence: Evidence) -> Floats:
    """One sigma by what the rest of the model does wrong: m^2 spread evenly over the q directions of its Jacobian.

    theta moves by A d when the model is wrong by d, A = (Z' Z)^-1 Z'. With d = Q w, Q orthonormal (n, q) and w of
    variance n m^2 / q, the variance of theta is the diagonal of A Q Q' A' n m^2 / q.
    """
    good = np.isfinite(evidence.reference_n)
    rest = orthonormal(evidence.jacobian(spec)[good])
    size = np.maximum(np.sqrt(np.mean(table[good] ** 2, axis=0)), 1e-300)
    moved = np.linalg.lstsq(table[good] / size, rest, rcond=1e-6)[0] / size[:, None]
    share = good.sum() * _misfit_n2(spec, evidence) / max(1, rest.shape[1])
    return np.sqrt(share * np.sum(moved**2, axis=1))


def _misfit_n2(spec: ModelSpec, evidence: Evidence) -> float:
    """What the model leaves beyond white noise, N^2; a share of all it leaves at least, as no bench shows a flight."""
    left, quick, count = 0.0, [], 0
    for segment in evidence.segments:
        residual = segment.force_n - simulate(spec, segment)
        left += float(np.nansum(residual**2))
        count += int(np.isfinite(residual).sum())
        quick.append(np.diff(residual))
    jump = np.concatenate(quick)
    white_n2 = 0.5 * (MAD * float(np.nanmedian(np.abs(jump)))) ** 2 if jump.size else 0.0
    return max(left / max(1, count) - white_n2, LEAST_MISFIT**2 * left / max(1, count))


def _columns(spec: ModelSpec, places: Sequence[int], evidence: Evidence) -> tuple[list[str], Floats]:
    """Names and columns (n, k) of every free parameter of the effects at `places`, about their present values."""
    names, amplitudes = _amplitude_columns(spec, places, evidence)
    output_n, columns = evidence.output(spec), [amplitudes]
    for i in places:
        effect, values = effect_named(spec.effects[i].name), spec.effects[i].parameters
        for p in effect.parameters:
            if p.estimate and not p.amplitude:
                step = NUDGE * max(abs(values[p.name]), 1e-6) * (-1 if values[p.name] * (1 + NUDGE) > p.high else 1)
                changed = list(spec.effects)
                changed[i] = EffectSpec(effect.name, values | {p.name: values[p.name] + step})
                nudged = evidence.output(msgspec.structs.replace(spec, effects=changed))
                names.append(f"{i}.{p.name}")
                columns.append(((nudged - output_n) / step)[:, None])
    return names, np.column_stack(columns)


def _amplitude_columns(spec: ModelSpec, places: Sequence[int], evidence: Evidence) -> tuple[list[str], Floats]:
    """Names and columns (n, k) of the amplitudes of the effects at `places`, about their present values."""
    names, columns = [], []
    for i in places:
        effect = effect_named(spec.effects[i].name)
        others = [e for j, e in enumerate(spec.effects) if j != i]
        without = msgspec.structs.replace(spec, effects=others)
        candidate = column_at(effect, spec.effects[i].parameters, without, evidence, evidence.output(without))
        names += [f"{i}.{name}" for name in candidate.amplitudes]
        columns.append(candidate.columns)
    return names, np.column_stack(columns)


def _spread(table: Floats, residual: Floats, evidence: Evidence) -> list[float]:
    good = np.isfinite(residual)
    size = np.maximum(np.sqrt(np.mean(table[good] ** 2, axis=0)), 1e-300)
    group = evidence.block * GROUPS // evidence.n_blocks
    estimates = []
    for left_out in range(GROUPS):
        keep = good & (group != left_out)
        rows = table[keep] / size
        estimates.append(np.linalg.lstsq(rows, residual[keep], rcond=1e-6)[0] / size)
    moved = np.array(estimates) - np.mean(estimates, axis=0)
    sigma = np.sqrt((GROUPS - 1) / GROUPS * np.sum(moved**2, axis=0))
    return [float(s) for s in sigma]
