"""Block-oriented fits made so far: structures that need the same one (Wiener-Hammerstein the linear ones, friction and
weight the HW-PWL model) get it once."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from hashlib import blake2b
from typing import NamedTuple

import numpy as np

from thrustd.identify.fit_hw_pwl import warnings_of
from thrustd.identify.hw_fit import HwFit, HwSettings, Progress, fit_segments
from thrustd.identify.hw_shapes import directions_of
from thrustd.identify.hw_spec import spec_of
from thrustd.identify.segments import DEFORMATION, Segment
from thrustd.model.artifact import ModelSpec


class BlockFit(NamedTuple):
    """A fitted model, how many numbers were estimated (initial states aside), and warnings."""

    spec: ModelSpec
    n_parameters: int
    warnings: tuple[str, ...]


class Judged(NamedTuple):
    """How a model follows what it was fitted to: mean square missed, the same at low frequency, samples, numbers."""

    mse: float
    slow: float
    samples: int
    n_parameters: int


class Made(NamedTuple):
    """Fits to the same data by settings, and how they follow these where somebody asked (`simpler`)."""

    fits: dict[HwSettings, BlockFit]
    judged: dict[HwSettings, Judged]


@dataclass(frozen=True, slots=True)
class BlockFits:
    """By data and settings. `hw_pwl`: what is asked of HW-PWL and of the structures around it."""

    hw_pwl: HwSettings = field(default_factory=HwSettings)
    _made: dict[bytes, Made] = field(default_factory=dict)

    def made(self, segments: Sequence[Segment]) -> Made:
        """What was made so far of these data."""
        return self._made.setdefault(_digest(segments), Made({}, {}))

    def of(self, segments: Sequence[Segment], settings: HwSettings, progress: Progress | None) -> BlockFit:
        """The fit to these data with these settings, made now unless it was before."""
        made = self.made(segments).fits
        if settings not in made:
            fit = fit_segments(list(segments), settings, progress)
            spec = spec_of(fit, "block", "hw-pwl", (settings.input_shape, settings.output_shape))
            made[settings] = BlockFit(spec, _free(fit, settings), tuple(warnings_of(fit)))
        return made[settings]


def _free(fit: HwFit, settings: HwSettings) -> int:
    columns = directions_of(fit.point, settings.input_shape, settings.output_shape)
    return int(np.count_nonzero(np.any(columns[: fit.point.layout.size] != 0.0, axis=0)))


def _digest(segments: Sequence[Segment]) -> bytes:
    """Of what block fits read: sample period, input, output."""
    digest = blake2b()
    for segment in segments:
        digest.update(np.float64(segment.dt_s).tobytes())
        for column in (segment.inputs[DEFORMATION], segment.force_n):
            digest.update(column.tobytes())
    return digest.digest()
