"""Block-oriented structures (thesis section 13.4) and their linear members, all by one search (`identify.hw_fit`).

oe-2-2, oe-6-4               linear output error: both curves straight; 4 poles carry 5 zeros' worth of numerator
hammerstein, hammerstein-pwl curve before the linear block
wiener                       curve behind it
hammerstein-wiener           cubics on both sides
hw-pwl                       ten segments on both sides: the thesis' winner
"""

from collections.abc import Sequence

import numpy as np

from thrustd.identify.hw_fit import HwFit, HwSettings, Progress, fit_segments
from thrustd.identify.hw_shapes import directions_of
from thrustd.identify.hw_spec import spec_of
from thrustd.identify.segments import Segment
from thrustd.identify.structures.structure import Family, Fitted, Structure, of_spec


def fit_blocks(segments: Sequence[Segment], settings: HwSettings, name: str, progress: Progress | None) -> Fitted:
    fit = fit_segments(list(segments), settings, progress)
    shapes = (settings.input_shape, settings.output_shape)
    return of_spec(spec_of(fit, name, name, shapes), _free(fit, settings))


def _free(fit: HwFit, settings: HwSettings) -> int:
    """Numbers that were estimated, initial states aside."""
    columns = directions_of(fit.point, settings.input_shape, settings.output_shape)
    return int(np.count_nonzero(np.any(columns[: fit.point.layout.size] != 0.0, axis=0)))


def _structure(name: str, title: str, family: Family, settings: HwSettings) -> Structure:
    def fit(segments: Sequence[Segment], progress: Progress | None) -> Fitted:
        return fit_blocks(segments, settings, name, progress)

    return Structure(name, title, family, fit)


STRUCTURES = (
    _structure("oe-2-2", "output error 2/2", "linear", HwSettings(2, input_shape="line", output_shape="line")),
    _structure("oe-6-4", "output error 6/4", "linear", HwSettings(4, input_shape="line", output_shape="line")),
    _structure(
        "hammerstein", "Hammerstein, cubic", "block-oriented", HwSettings(input_shape="cubic", output_shape="line")
    ),
    _structure("hammerstein-pwl", "Hammerstein, PWL", "block-oriented", HwSettings(output_shape="line")),
    _structure("wiener", "Wiener, cubic", "block-oriented", HwSettings(input_shape="line", output_shape="cubic")),
    _structure(
        "hammerstein-wiener",
        "Hammerstein-Wiener, cubics",
        "block-oriented",
        HwSettings(input_shape="cubic", output_shape="cubic"),
    ),
    _structure("hw-pwl", "HW-PWL, 10 + 10 segments", "block-oriented", HwSettings()),
)
