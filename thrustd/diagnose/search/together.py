"""An effect that was there when the model was identified: curves and linear block imitate it and must let go of it.

Then the effect and the rest are estimated together. With so much free, held-back blocks inside the record are too kind
a judge; the last part of every segment is, which such an estimate has not seen.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from thrustd.diagnose.search.estimates import ParameterEstimate, estimated
from thrustd.diagnose.search.evidence import Evidence
from thrustd.diagnose.search.expected import own_error_n
from thrustd.model.artifact import EffectSpec, ModelSpec
from thrustd.model.stage import Floats

FAMILIAR = 1.3  # squared error in units of the promised one: the data hold nothing that the identification did not
TRAIN = 0.6  # of every segment; the rest judges


def familiar(spec: ModelSpec, evidence: Evidence, error_n: float) -> bool:
    """Whether the error is what the identification promises: if an effect is missing, it was missing then as well."""
    own_n = own_error_n(spec, evidence, evidence.output(spec))
    return own_n is not None and error_n**2 <= FAMILIAR * own_n**2


def estimated_together(
    spec: ModelSpec, effects: Sequence[EffectSpec], parent: ModelSpec, evidence: Evidence
) -> tuple[ModelSpec, list[ParameterEstimate], float, float]:
    """(model, numbers, error of the parent, error of the model) on the part that the judging estimate has not seen."""
    early, late = _parts(evidence)
    trial, _ = estimated(spec, effects, early, rest_too=True)
    before_n, after_n = late.rmse_n(parent), late.rmse_n(trial)
    better, numbers = estimated(spec, effects, evidence, rest_too=True)
    return better, numbers, before_n, after_n


def _parts(evidence: Evidence) -> tuple[Evidence, Evidence]:
    """The same evidence with a reference in the first part of every segment only, and in the last."""
    cuts = [round(TRAIN * len(segment)) for segment in evidence.segments]
    rows = np.concatenate([_ramp(int(np.sum(evidence.segment == i))) for i in range(len(evidence.segments))])
    early, late = [], []
    for segment, cut in zip(evidence.segments, cuts, strict=True):
        first = np.arange(len(segment)) < cut
        early.append(replace(segment, force_n=np.where(first, segment.force_n, np.nan)))
        late.append(replace(segment, force_n=np.where(first, np.nan, segment.force_n)))
    return (
        replace(evidence, segments=tuple(early), reference_n=_masked(evidence, rows < TRAIN), known={}),
        replace(evidence, segments=tuple(late), reference_n=_masked(evidence, rows >= TRAIN), known={}),
    )


def _ramp(count: int) -> Floats:
    return np.arange(count) / max(1, count)


def _masked(evidence: Evidence, keep: NDArray[np.bool_]) -> Floats:
    return np.where(keep, evidence.reference_n, np.nan)
