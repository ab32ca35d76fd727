"""A model's numbers as one vector with names, and back: what estimation and diagnosis change.

Names are `piece.place.field`, so that shell patterns choose them:

    input_curve.y.3   input_curve.x.3   input_curve.coefficients.1       (the same for output_curve)
    linear.direct   linear.real.0.log_tau_s   linear.real.0.gain
    linear.feedback.0.3   (state, product)
    linear.complex.0.log_decay_1_s   ...log_frequency_rad_s   ...gain_re   ...gain_im   (the same for output_linear)
    hysteresis.force_n                                        effect name . parameter; a second one: hysteresis#2.

`log_` parameters are natural logarithms, so that time constants stay positive and step by ratios.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from math import exp, inf, log
from typing import NamedTuple, TypeVar

import msgspec
import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.errors import ModelError
from thrustd.model.artifact import (
    ComplexMode,
    Curve,
    EffectSpec,
    LinearBlock,
    ModelSpec,
    PiecewiseLinear,
    Polynomial,
    RealMode,
)
from thrustd.model.effects import effect_named

Mode = TypeVar("Mode", RealMode, ComplexMode)
LOGARITHMS = ("tau_s", "decay_1_s", "frequency_rad_s")
LOG_SPAN = 12.0  # time constants may move by a factor e^12 either way


@dataclass(frozen=True, slots=True)
class ParameterVector:
    """Chosen numbers of a model. `scale` is a typical change, for steps and damping; all arrays (n,)."""

    names: tuple[str, ...]
    values: Floats
    low: Floats
    high: Floats
    scale: Floats

    def __len__(self) -> int:
        return len(self.names)

    def at(self, values: Floats) -> "ParameterVector":
        """The same parameters with other values, clipped to their bounds."""
        return ParameterVector(self.names, np.clip(values, self.low, self.high), self.low, self.high, self.scale)

    def as_dict(self) -> dict[str, float]:
        return dict(zip(self.names, map(float, self.values), strict=True))


class _Place(NamedTuple):
    value: float
    low: float
    high: float
    scale: float


def pack(spec: ModelSpec, which: Iterable[str] = ("*",)) -> ParameterVector:
    """The parameters whose names match one of the patterns `which`; ModelError when a pattern matches none."""
    places = parameter_places(spec)
    patterns = list(which)
    for pattern in patterns:
        if not any(name == pattern or fnmatchcase(name, pattern) for name in places):
            raise ModelError(f"model '{spec.name}': no parameter matches '{pattern}', it has {', '.join(places)}")
    names = [n for n in places if any(n == p or fnmatchcase(n, p) for p in patterns)]
    table = np.array([places[name] for name in names]).reshape(-1, 4)
    return ParameterVector(tuple(names), table[:, 0], table[:, 1], table[:, 2], table[:, 3])


def unpack(spec: ModelSpec, vector: ParameterVector) -> ModelSpec:
    """The model with the vector's values (clipped to their bounds) in place."""
    values = {name: place.value for name, place in parameter_places(spec).items()}
    values |= vector.at(vector.values).as_dict()
    return msgspec.structs.replace(
        spec,
        input_curve=_rebuilt_curve(spec.input_curve, "input_curve", values),
        linear=_rebuilt_linear(spec.linear, "linear", values),
        output_curve=_rebuilt_curve(spec.output_curve, "output_curve", values),
        output_linear=spec.output_linear and _rebuilt_linear(spec.output_linear, "output_linear", values),
        effects=[
            EffectSpec(effect.name, {key: values[f"{label}.{key}"] for key in _full(effect)}, effect.std)
            for label, effect in _labelled(spec)
        ],
    )


def parameter_places(spec: ModelSpec) -> dict[str, _Place]:
    """Every parameter of the model by name: value, bounds, scale."""
    places = _curve_places("input_curve", spec.input_curve)
    places |= _linear_places("linear", spec.linear)
    places |= _curve_places("output_curve", spec.output_curve)
    if spec.output_linear is not None:
        places |= _linear_places("output_linear", spec.output_linear)
    for label, effect in _labelled(spec):
        for parameter in effect_named(effect.name).parameters:
            value = _full(effect)[parameter.name]
            places[f"{label}.{parameter.name}"] = _Place(
                value, parameter.low, parameter.high, _effect_scale(value, parameter.neutral, parameter.starts)
            )
    return places


def _labelled(spec: ModelSpec) -> list[tuple[str, EffectSpec]]:
    seen: dict[str, int] = {}
    labelled = []
    for effect in spec.effects:
        seen[effect.name] = seen.get(effect.name, 0) + 1
        count = seen[effect.name]
        labelled.append((effect.name if count == 1 else f"{effect.name}#{count}", effect))
    return labelled


def _full(effect: EffectSpec) -> dict[str, float]:
    return effect_named(effect.name).neutral() | effect.parameters


def _effect_scale(value: float, neutral: float, starts: tuple[float, ...]) -> float:
    spans = [abs(start - neutral) for start in starts] + [abs(value - neutral)]
    return max(spans) or max([abs(start) for start in starts] + [abs(value)]) or 1.0


def _curve_places(label: str, curve: Curve) -> dict[str, _Place]:
    if isinstance(curve, Polynomial):
        size = max(map(abs, curve.coefficients)) or 1.0
        return {f"{label}.coefficients.{i}": _Place(c, -inf, inf, size) for i, c in enumerate(curve.coefficients)}
    height = max(curve.y) - min(curve.y) or 1.0
    places = {f"{label}.y.{i}": _Place(y, -inf, inf, height) for i, y in enumerate(curve.y)}
    x = curve.x
    for i in range(1, len(x) - 1):  # a knot may move half way to its neighbours: the order stays
        low, high = (x[i - 1] + x[i]) / 2, (x[i] + x[i + 1]) / 2
        places[f"{label}.x.{i}"] = _Place(x[i], low, high, (x[-1] - x[0]) / (len(x) - 1))
    return places


def _linear_places(label: str, linear: LinearBlock) -> dict[str, _Place]:
    places = {f"{label}.direct": _Place(linear.direct, -inf, inf, 1.0)}
    kinds: dict[str, Sequence[RealMode | ComplexMode]] = {"real": linear.real_modes, "complex": linear.complex_modes}
    for kind, modes in kinds.items():
        for i, mode in enumerate(modes):
            places |= {_named(f"{label}.{kind}.{i}", key): _mode_place(key, mode) for key in mode.__struct_fields__}
    if linear.feedback is not None:
        size = linear.feedback.scale[-1]
        for i, row in enumerate(linear.feedback.into):
            places |= {f"{label}.feedback.{i}.{j}": _Place(value, -inf, inf, size) for j, value in enumerate(row)}
    return places


def _named(label: str, key: str) -> str:
    return f"{label}.log_{key}" if key in LOGARITHMS else f"{label}.{key}"


def _mode_place(key: str, mode: RealMode | ComplexMode) -> _Place:
    value = float(getattr(mode, key))
    if key not in LOGARITHMS:
        return _Place(value, -inf, inf, 0.1)
    return _Place(log(value), log(value) - LOG_SPAN, log(value) + LOG_SPAN, 1.0)


def _rebuilt_curve(curve: Curve, label: str, values: Mapping[str, float]) -> Curve:
    if isinstance(curve, Polynomial):
        coefficients = [values[f"{label}.coefficients.{i}"] for i in range(len(curve.coefficients))]
        return Polynomial(curve.centre, curve.scale, coefficients)
    x = [values.get(f"{label}.x.{i}", at) for i, at in enumerate(curve.x)]
    return PiecewiseLinear(x, [values[f"{label}.y.{i}"] for i in range(len(curve.y))])


def _rebuilt_linear(linear: LinearBlock, label: str, values: Mapping[str, float]) -> LinearBlock:
    def rebuilt(place: str, mode: Mode) -> Mode:
        numbers = {key: values[_named(place, key)] for key in mode.__struct_fields__}
        return msgspec.structs.replace(mode, **{k: exp(v) if k in LOGARITHMS else v for k, v in numbers.items()})

    real = [rebuilt(f"{label}.real.{i}", mode) for i, mode in enumerate(linear.real_modes)]
    pairs = [rebuilt(f"{label}.complex.{i}", mode) for i, mode in enumerate(linear.complex_modes)]
    fed = linear.feedback and msgspec.structs.replace(
        linear.feedback,
        into=[
            [values[f"{label}.feedback.{i}.{j}"] for j in range(len(row))] for i, row in enumerate(linear.feedback.into)
        ],
    )
    return LinearBlock(values[f"{label}.direct"], real, pairs, linear.hold, fed)
