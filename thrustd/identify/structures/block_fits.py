"""Regressions made so far: structures that need the same one get it once."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from hashlib import blake2b
from typing import NamedTuple

import numpy as np

from thrustd.identify.regression.general import Asked
from thrustd.identify.regression.hypotheses import Trials, explained
from thrustd.identify.regression.solve import Progress, Solution
from thrustd.identify.regression.table import spec_of
from thrustd.identify.segments import DEFORMATION, Segment
from thrustd.model.artifact import ModelSpec


class BlockFit(NamedTuple):
    """A solution, the same as an artifact, and how many numbers its data determine."""

    found: Solution
    spec: ModelSpec
    n_parameters: int


@dataclass(frozen=True, slots=True)
class BlockFits:
    """By data and by what was asked. `wish`: order and segments of the artifact, where somebody wants them."""

    wish: Asked = field(default_factory=Asked)
    _made: dict[tuple[bytes, Asked], BlockFit] = field(default_factory=dict)
    _searched: dict[bytes, Trials] = field(default_factory=dict)

    def of(self, segments: Sequence[Segment], asked: Asked, progress: Progress | None) -> BlockFit:
        """The regression of these data with this asked of it, made now unless it was before."""
        key = _digest(segments), asked
        if key not in self._made:
            found = explained(segments, asked, progress, self._searched.setdefault(key[0], {}))
            spec = spec_of(found, segments, "block", asked.segments)
            self._made[key] = BlockFit(found, spec, round(determined(found)))
        return self._made[key]


def determined(found: Solution) -> float:
    """How many numbers the data determine: the trace of data information over all information (MacKay's gamma)."""
    free = found.free
    data = found.normal.matrix[np.ix_(free, free)] / found.noise_variance
    return float(np.trace(np.linalg.lstsq(found.information[np.ix_(free, free)], data, rcond=None)[0]))


def _digest(segments: Sequence[Segment]) -> bytes:
    """Of what block fits read: sample period, input, output."""
    digest = blake2b()
    for segment in segments:
        digest.update(np.float64(segment.dt_s).tobytes())
        for column in (segment.inputs[DEFORMATION], segment.force_n):
            digest.update(column.tobytes())
    return digest.digest()
