"""Whole models estimated and compared on blocks of data held back: what Wiener-Hammerstein and feedback share.

Records begin anywhere, so every segment gets the past that suits the model at hand in front (`identify.first_state`).
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from thrustd.core.columns import Flags
from thrustd.identify.estimate import estimate
from thrustd.identify.first_state import begun
from thrustd.identify.parameters import pack
from thrustd.identify.segments import Segment
from thrustd.identify.structures.structure import error_over, of_spec
from thrustd.model.artifact import ModelSpec

HELD_BACK = ((0.3, 0.4), (0.7, 0.8))  # of every segment, while models are compared
FEEDBACK_STD = 0.1  # of half the input's range: weighs as much as one sample
MODE_STD = 1.0  # of the blocks' gain at rest, and e-fold: modes that only cancel each other tell another record wrong


class Trial(NamedTuple):
    """A model estimated without the blocks held back, and its RMS error on them."""

    spec: ModelSpec
    error: float


@dataclass(frozen=True, slots=True)
class Bench:
    """Segments to estimate on; `which`: the parameters that are."""

    segments: list[Segment]
    which: tuple[str, ...]

    def tried(self, spec: ModelSpec, iterations: int) -> Trial:
        hidden = [_only(segment, ~_held(segment, len(segment))) for segment in self.segments]
        found = replace(self, segments=hidden).estimated(spec, iterations)
        return Trial(found, self.held_back_error(found))

    def held_back_error(self, spec: ModelSpec) -> float:
        pairs = zip(self._begun(spec), self.segments, strict=True)
        return error_over(spec, [_only(after, _held(after, len(segment))) for after, segment in pairs])

    def error(self, spec: ModelSpec) -> float:
        """RMS over all samples that carry weight."""
        return error_over(spec, self._begun(spec))

    def estimated(self, spec: ModelSpec, iterations: int) -> ModelSpec:
        """Twice: the past is another once the model is."""
        for count in (iterations // 2, iterations - iterations // 2):
            spec = estimate(spec, self._begun(spec), self.which, count, 1e-4, gentle(spec)).spec
        return spec

    def _begun(self, spec: ModelSpec) -> list[Segment]:
        return begun(of_spec(spec, 0).simulate, self.segments)


def gentle(spec: ModelSpec) -> dict[str, float]:
    """How far each number of a feedback, each time constant (logarithm) and each gain may move, one sigma."""
    fed = spec.linear.feedback
    if fed is not None:
        return {name: FEEDBACK_STD * fed.scale[-1] for name in pack(spec).names if ".feedback." in name}
    return {name: MODE_STD for name in pack(spec, ("linear.*", "output_linear.*")).names}


def _only(segment: Segment, there: Flags) -> Segment:
    """Where it is not, samples carry no weight."""
    return replace(segment, force_n=np.where(there, segment.force_n, np.nan))


def _held(segment: Segment, n: int) -> Flags:
    """The blocks held back of the last n samples of a segment."""
    at = np.arange(len(segment)) - (len(segment) - n)
    return np.any([(at >= a * n) & (at < b * n) for a, b in HELD_BACK], axis=0)
