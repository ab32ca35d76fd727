"""Effects whose size is known before any data: the mass of an engine on its scale, a coefficient of the data sheet.

A bench that stands still says nothing of the engine's inertia; the value of the aircraft is put in as it is, without
a sigma, and the ledger has no entry because no error was measured.
"""

from collections.abc import Mapping, Sequence

import msgspec
import numpy as np

from thrustd.core.errors import ModelError, UsageError
from thrustd.diagnose.compare.checks import check_new
from thrustd.identify.artifact import witness_rows
from thrustd.model.artifact import EffectSpec, ModelSpec
from thrustd.model.compile import check_witness
from thrustd.model.effects import effect_named

Given = Mapping[str, Mapping[str, float]]  # effect -> parameter -> value


def read_given(texts: Sequence[str]) -> Given:
    """`EFFECT.PARAMETER=VALUE` of the command line, gathered by effect."""
    found: dict[str, dict[str, float]] = {}
    for text in texts:
        path, _, number = text.partition("=")
        name, _, parameter = path.strip().rpartition(".")
        try:
            if not name:
                raise ValueError
            found.setdefault(name, {})[parameter] = float(number)
        except ValueError:
            raise UsageError(f"--given {text}: expected EFFECT.PARAMETER=NUMBER") from None
    return found


def with_given(spec: ModelSpec, given: Given) -> ModelSpec:
    """The model with effects of known size; the parameters not given stay as the card starts them."""
    check_witness(spec, spec.name)
    for name, values in given.items():
        effect = effect_named(name)
        check_new(spec, effect, spec.name)
        ranges = {p.name: (p.low, p.high) for p in effect.parameters}
        for parameter, value in values.items():
            low, high = ranges.get(parameter, (np.nan, np.nan))
            if parameter not in ranges:
                raise ModelError(f"{name}: no parameter '{parameter}', expected one of {', '.join(ranges)}")
            if not low <= value <= high:
                raise ModelError(f"{name}: {parameter} = {value:g}, expected {low:g} to {high:g}")
        spec = msgspec.structs.replace(spec, effects=[*spec.effects, EffectSpec(name, effect.neutral() | dict(values))])
    said = [f"{name}.{parameter} = {value:g}" for name, values in given.items() for parameter, value in values.items()]
    before = spec.provenance.get("given", [])
    assert isinstance(before, list)
    assert spec.witness is not None  # nobody reads a model without
    rate_hz = spec.witness.rate_hz
    spec = msgspec.structs.replace(spec, provenance=dict(spec.provenance) | {"given": [*before, *said]})
    return msgspec.structs.replace(spec, witness=witness_rows(spec, rate_hz))
