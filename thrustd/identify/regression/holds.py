"""How the input goes on between two samples: in ramps, or in steps as well where that matters."""

from collections.abc import Sequence

import numpy as np

from thrustd.identify.regression.shape import Hold
from thrustd.identify.segments import DEFORMATION, Segment

FAST = 1.0 / 6.0  # of the Nyquist frequency: input that moves faster tells holds apart
FAST_SHARE = 0.05  # of the input's power beyond


def holds_of(segments: Sequence[Segment]) -> tuple[Hold, ...]:
    """Ramps between samples, and steps as well where the input's power reaches so far that it matters."""
    for segment in segments:
        power = np.abs(np.fft.rfft(segment.inputs[DEFORMATION] - segment.inputs[DEFORMATION].mean())) ** 2
        if float(power[int(FAST * len(power)) :].sum()) > FAST_SHARE * float(power.sum()):
            return "foh", "zoh"
    return ("foh",)
