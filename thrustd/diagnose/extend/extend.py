"""Extend a model by an effect: start neutral, estimate, keep only what is better on held-back blocks, write the ledger.

The effects of the model are estimated together. The rest moves gently or not at all: a ridge step of the curves and
the linear block, of the strength that predicts held-back blocks best, taken only when it pays.
"""

import hashlib
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
from rich.console import Console

from thrustd.brochure.deck import Deck
from thrustd.core.aircraft import MountPlace
from thrustd.core.errors import ModelError
from thrustd.diagnose.compare.checks import (
    check_channels,
    check_length,
    check_new,
    check_not_own_output,
    check_recording,
)
from thrustd.diagnose.compare.newtons import newtons
from thrustd.diagnose.compare.reference import referenced
from thrustd.diagnose.search.candidates import candidates, moves, with_effect
from thrustd.diagnose.search.estimates import ParameterEstimate, estimated
from thrustd.diagnose.search.evidence import Evidence, base_patterns, gather, lateness
from thrustd.diagnose.search.expected import own_error_n
from thrustd.diagnose.search.gram import block_gram, held_out_fit
from thrustd.diagnose.search.polish import polished
from thrustd.diagnose.search.selection import BESIDE, RIDGES, Progress
from thrustd.diagnose.search.start import Start, start_of
from thrustd.diagnose.search.together import estimated_together, familiar
from thrustd.identify.artifact import data_sha256, witness_rows
from thrustd.identify.parameters import pack, unpack
from thrustd.model.artifact import EffectSpec, LedgerEntry, ModelSpec, write_model
from thrustd.model.effect import Effect
from thrustd.model.effects import effect_named
from thrustd.model.stage import Floats
from thrustd.records.recording import Recording

PAYS = 0.97  # the rest of the model moves only when that leaves less than this of the squared error
LITTLE = 1.4  # times what the identification promises
POLISHED = 3  # starting shapes that are polished
IDLE = 1e-6  # of the typical amplitude: so small is neutral


@dataclass(frozen=True, slots=True)
class ExtendReport:
    """The extended model and what it gained on held-back blocks."""

    spec: ModelSpec
    effects: tuple[str, ...]
    rmse_before_n: float
    rmse_after_n: float
    parameters: tuple[ParameterEstimate, ...]
    rest_moved: bool  # whether curves and linear block were re-estimated, gently

    def to_json(self) -> dict[str, Any]:
        return {
            "model": self.spec.name,
            "effects": list(self.effects),
            "rmse_before_n": self.rmse_before_n,
            "rmse_after_n": self.rmse_after_n,
            "parameters": {self._key(p): p.to_json() | {"effect": p.effect} for p in self.parameters},
            "rest_moved": self.rest_moved,
        }

    def _key(self, parameter: ParameterEstimate) -> str:
        """Its name, with its effect where two effects call one of theirs the same."""
        same = sum(p.name == parameter.name for p in self.parameters)
        return parameter.name if same == 1 else f"{parameter.effect}.{parameter.name}"

    def print(self, console: Console) -> None:
        names = " and ".join(self.effects)
        console.print(
            f"[bold]{names}[/bold] added: {newtons(self.rmse_before_n)} -> {newtons(self.rmse_after_n)} N"
            " on held-back blocks, start-up aside",
            highlight=False,
        )
        for number in self.parameters:
            console.print(f"  {number.sentence}", highlight=False)
        if self.rest_moved:
            console.print("  curves and linear block moved a little as well")


def extend(
    spec: ModelSpec,
    recordings: Sequence[Recording],
    effects: Sequence[Effect | str],
    *,
    name: str = "",
    against: str = "",
    mount: MountPlace | None = None,
    deck: Deck | None = None,
    progress: Progress | None = None,
) -> ExtendReport:
    """Add `effects` to a model. ModelError, and no model, when held-back blocks are not better with them."""
    chosen = [effect_named(effect) if isinstance(effect, str) else effect for effect in effects]
    records = referenced(recordings, against, mount, deck, [spec])
    for record in records:
        check_recording(record, spec)
    for effect in chosen:
        check_new(spec, effect, spec.name)
        check_channels(records, effect)
    check_length(records, spec)
    evidence = gather(spec, records)
    check_not_own_output(records[0], evidence.output(spec), evidence.reference_n)
    before = _held_out(spec, spec, evidence, len(spec.effects))
    started = spec
    for i, effect in enumerate(chosen):
        _tell(progress, 0.5 * i / len(chosen), effect.name)
        started = with_effect(started, _start(effect, started, evidence))
    _tell(progress, 0.5, "estimate")
    free = _estimable(started, records, chosen)
    better, numbers = estimated(started, free, evidence)
    if lost := _lost(spec, better):
        free = [effect for effect in free if effect.name not in lost]
        better, numbers = estimated(started, free, evidence)
    after = _held_out(spec, better, evidence, len(spec.effects))
    _tell(progress, 0.9, "the rest, gently")
    gentle, gentle_after = _gently(better, evidence) if _settled(spec, after, evidence) else (better, after)
    moved = gentle_after < PAYS**0.5 * after
    final, final_after = (gentle, gentle_after) if moved else (better, after)
    if familiar(spec, evidence, before):
        _tell(progress, 0.95, "together with the rest")
        whole, whole_numbers, parent_n, whole_n = estimated_together(started, free, spec, evidence)
        if whole_n / parent_n < PAYS**0.5 * final_after / before:
            final, numbers, before, final_after, moved = whole, whole_numbers, parent_n, whole_n, True
    _check_better(spec, chosen, final, before, final_after)
    _tell(progress, 1.0, "done")
    words = tuple(effect.word for effect in chosen)
    final = _for_flight(final, chosen, evidence)
    written = _finished(spec, final, name or spec.name, chosen, records, (before, final_after), evidence)
    return ExtendReport(written, words, before, final_after, tuple(numbers), moved)


def _check_better(spec: ModelSpec, chosen: Sequence[Effect], final: ModelSpec, before_n: float, after_n: float) -> None:
    """ModelError when nothing is gained, or not by the effects: the rest alone may have moved."""
    if not after_n < before_n:
        raise ModelError(
            f"{spec.name}: {_words(chosen)} not added: {before_n:.4g} N before and {after_n:.4g} N after"
            " on held-back blocks, expected less; no model written"
        )
    values = {effect.name: effect.parameters for effect in final.effects}
    idle = [effect for effect in chosen if _neutral(effect, values[effect.name])]
    if idle:
        raise ModelError(
            f"{spec.name}: {_words(idle)} not added: these data are explained best with none of it,"
            " expected a size other than neutral; no model written"
        )


def _neutral(effect: Effect, values: Mapping[str, float]) -> bool:
    """Whether every amplitude ended where the effect does nothing."""
    return all(abs(values[p.name] - p.neutral) <= IDLE * abs(p.starts[0]) for p in effect.parameters if p.amplitude)


def _for_flight(spec: ModelSpec, chosen: Sequence[Effect], evidence: Evidence) -> ModelSpec:
    """The model with the best of the starts of what matters only in flight: how a late reading is extrapolated."""
    punctual = lateness(spec)[0].effects
    for i, present in enumerate(spec.effects):
        effect = effect_named(present.name)
        if effect in chosen and present not in punctual:
            fixed = [p for p in effect.parameters if not p.estimate]
            trials = [
                _with_values(spec, i, dict(zip([p.name for p in fixed], values, strict=True)))
                for values in itertools.product(*(p.starts for p in fixed))
            ]
            spec = min(trials, key=evidence.rmse_in_flight_n)
    return spec


def _with_values(spec: ModelSpec, place: int, values: Mapping[str, float]) -> ModelSpec:
    """The model with some parameters of one of its effects at other values."""
    effects = list(spec.effects)
    effects[place] = msgspec.structs.replace(effects[place], parameters=effects[place].parameters | dict(values))
    return msgspec.structs.replace(spec, effects=effects)


def _start(effect: Effect, spec: ModelSpec, evidence: Evidence) -> EffectSpec:
    """The best shape and amplitude beside the model as it is."""
    output_n = evidence.output(spec)
    residual = evidence.reference_n - output_n
    start = start_of(spec, evidence)
    nothing = np.empty((len(residual), 0))
    rough = candidates(effect, spec, evidence, output_n)
    order = sorted(rough, key=lambda c: _left(evidence, residual, c.columns, start))
    fine = [polished(c, spec, evidence, output_n, nothing, start) for c in order[:POLISHED]]
    best = min(fine, key=lambda c: _left(evidence, residual, c.columns, start))
    return EffectSpec(effect.name, best.parameters)


def _left(evidence: Evidence, residual: Floats, columns: Floats, start: Start) -> float:
    gram = block_gram(evidence, residual, columns, [], 0.0, start)
    count = columns.shape[1]
    return held_out_fit(gram, range(1, 1 + count), [BESIDE] * count).mse


def _estimable(spec: ModelSpec, records: Sequence[Recording], chosen: Sequence[Effect]) -> list[EffectSpec]:
    """The new effects, and those found earlier from data (they carry a sigma) whose channels are here to move them."""
    names = {effect.name for effect in chosen}

    def movable(effect: EffectSpec) -> bool:
        channels = [c for c in effect_named(effect.name).channels if c != "time_s"]
        return bool(effect.std) and all(all(c in r and moves(r[c]) for r in records) for c in channels)

    return [effect for effect in spec.effects if effect.name in names or movable(effect)]


def _lost(spec: ModelSpec, better: ModelSpec) -> set[str]:
    """Effects of the model whose size was known and is not any more: these data do not tell it, so it stays."""

    def known(effect: EffectSpec, name: str) -> bool:
        return effect.std.get(name, 0.0) < abs(effect.parameters[name])

    pairs = [(old, new) for old, new in zip(spec.effects, better.effects, strict=False) if old.std]
    return {
        old.name
        for old, new in pairs
        if any(known(old, p.name) and not known(new, p.name) for p in effect_named(old.name).parameters if p.amplitude)
    }


def _held_out(spec: ModelSpec, better: ModelSpec, evidence: Evidence, n_before: int) -> float:
    """Error on held-back blocks, the amplitudes of the new effects estimated on the other blocks each time."""
    output_n = evidence.output(better)
    columns = []
    for i in range(n_before, len(better.effects)):
        without = msgspec.structs.replace(better, effects=[e for j, e in enumerate(better.effects) if j != i])
        size = _amplitude(better.effects[i])
        columns.append((output_n - evidence.output(without)) / size)
    table = np.column_stack(columns) if columns else np.empty((len(output_n), 0))
    white, starts = evidence.white_n2(better), start_of(spec, evidence)
    gram = block_gram(evidence, evidence.reference_n - output_n, table, [], white, starts)
    return held_out_fit(gram, range(1, 1 + table.shape[1]), [BESIDE] * table.shape[1]).rmse


def _amplitude(effect: EffectSpec) -> float:
    sizes = [abs(effect.parameters[p.name]) for p in effect_named(effect.name).parameters if p.amplitude]
    return max(max(sizes), 1e-12)


def _settled(spec: ModelSpec, after_n: float, evidence: Evidence) -> bool:
    """Whether little enough is left to be the model's own; else the rest would absorb what is still missing."""
    own_n = own_error_n(spec, evidence, evidence.output(spec))
    return own_n is None or after_n <= LITTLE * own_n


def _gently(spec: ModelSpec, evidence: Evidence) -> tuple[ModelSpec, float]:
    """A ridge step of curves and linear block, of the strength that predicts held-back blocks best."""
    residual = evidence.reference_n - evidence.output(spec)
    present = evidence.jacobian(spec)
    gram = block_gram(evidence, residual, present, [], evidence.white_n2(spec), start_of(spec, evidence))
    n = present.shape[1]
    fits = [held_out_fit(gram, range(1, 1 + n), [ridge] * n) for ridge in RIDGES]
    best = min(fits, key=lambda fit: fit.mse)
    vector = pack(spec, base_patterns(spec))
    moved = unpack(spec, vector.at(vector.values + best.beta))
    real = evidence.rmse_n(moved)
    linear = held_out_fit(gram, [], []).rmse
    return moved, best.rmse if real < linear else float("inf")


def _finished(
    parent: ModelSpec,
    spec: ModelSpec,
    name: str,
    chosen: Sequence[Effect],
    records: Sequence[Recording],
    errors: tuple[float, float],
    evidence: Evidence,
) -> ModelSpec:
    """Name, ledger, provenance and witness of the new model."""
    entry = LedgerEntry(
        added=_words(chosen),
        rmse_before_n=errors[0],
        rmse_after_n=errors[1],
        data=", ".join(record.name for record in records),
        parent_sha256=hashlib.sha256(write_model(parent).encode()).hexdigest(),
    )
    provenance = dict(parent.provenance) | {"extended_on": [f"{r.name} {data_sha256(r)}" for r in records]}
    draft = msgspec.structs.replace(
        spec, name=name, ledger=[*parent.ledger, entry], provenance=provenance, witness=None
    )
    return msgspec.structs.replace(draft, witness=witness_rows(draft, 1.0 / evidence.segments[0].dt_s))


def _words(effects: Sequence[Effect]) -> str:
    return ", ".join(effect.word for effect in effects)


def _tell(progress: Progress | None, share: float, what: str) -> None:
    if progress is not None:
        progress(share, what)
