"""Backward look after forward selection: an effect taken early may be redundant once the true ones are in.

Forward selection takes the best single effect first; where two are hidden that may be a third which resembles their
sum. Each effect found is therefore left out again, the others re-estimated, and dropped when that costs less than the
gain for which an effect is taken.
"""

from collections.abc import Sequence

import msgspec
import numpy as np

from thrustd.diagnose.search.candidates import column_at
from thrustd.diagnose.search.evidence import Evidence
from thrustd.diagnose.search.gram import block_gram, held_out_fit
from thrustd.diagnose.search.start import start_of
from thrustd.model.artifact import EffectSpec, ModelSpec
from thrustd.model.effects import effect_named
from thrustd.model.stage import Floats

RIDGE = 1e-6


def redundant(spec: ModelSpec, added: Sequence[EffectSpec], evidence: Evidence, least_n2: float) -> EffectSpec | None:
    """The effect that is missed least, if leaving it out costs less than `least_n2` of held-back squared error."""
    if len(added) < 2:
        return None
    together = _joint_mse(spec, added, evidence)
    costs = [
        _joint_mse(without(spec, effect), [e for e in added if e != effect], evidence) - together for effect in added
    ]
    least = int(np.argmin(costs))
    return added[least] if costs[least] < least_n2 else None


def without(spec: ModelSpec, effect: EffectSpec) -> ModelSpec:
    """The model with one of its effects taken out."""
    return msgspec.structs.replace(spec, effects=[e for e in spec.effects if e != effect])


def tangents(spec: ModelSpec, added: Sequence[EffectSpec], evidence: Evidence, output_n: Floats) -> Floats:
    """Columns (n, k) of the amplitudes of effects found in earlier rounds: re-estimated beside every candidate."""
    columns = []
    for effect in added:
        bare = without(spec, effect)
        candidate = column_at(effect_named(effect.name), effect.parameters, bare, evidence, evidence.output(bare))
        columns.append(candidate.columns)
    return np.column_stack(columns) if columns else np.empty((len(output_n), 0))


def _joint_mse(spec: ModelSpec, added: Sequence[EffectSpec], evidence: Evidence) -> float:
    """Held-back squared error with the amplitudes of all `added` effects estimated together."""
    output_n = evidence.output(spec)
    beside = tangents(spec, added, evidence, output_n)
    residual = evidence.reference_n - output_n
    gram = block_gram(evidence, residual, beside, [], evidence.white_n2(spec), start_of(spec, evidence))
    return held_out_fit(gram, range(1, 1 + beside.shape[1]), [RIDGE] * beside.shape[1]).mse
