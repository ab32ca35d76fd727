"""How much structure short records bear: a structure, or a simpler one that it contains.

Every member of the block-oriented family is the next with a curve held smoother or straight, or with a shorter linear
block. A thousand samples follow six modes between two curves of ten segments closely and then predict others badly; and
where a simpler one follows the very data better, the search for the other ended in a worse minimum, or it leans on
initial states that no past could have left. So all of them are fitted, and Schwarz' criterion chooses,

    n ln(mse) + p ln n,   mse of the free run from the state that the first stretch of every segment shows.
"""

from collections.abc import Sequence
from dataclasses import replace

from thrustd.identify.hw_fit import HwSettings, Progress
from thrustd.identify.hw_shapes import Shape
from thrustd.identify.segments import Segment
from thrustd.identify.structures.block_fits import BlockFits
from thrustd.identify.structures.structure import error_from_past, schwarz

SHORT = 8_000  # samples: longer records bear what is asked for, and are compared with what was fitted to them already
ORDERS = (2, 3)  # of the linear block, those below the wanted one
SHAPES: tuple[Shape, ...] = ("line", "cubic", "pwl")  # each contains those before it


def best_of(
    segments: Sequence[Segment], wanted: HwSettings, fits: BlockFits, progress: Progress | None = None
) -> HwSettings:
    """What is wanted, or what it contains, whichever these records speak for."""
    samples, (made, errors) = sum(map(len, segments)), fits.made(segments)

    def worth(settings: HwSettings) -> float:
        found = made.get(settings) or fits.of(segments, settings, progress)
        if settings not in errors:
            errors[settings] = error_from_past(found.spec, segments)
        return schwarz(errors[settings], samples, found.n_parameters)

    return min([wanted, *(s for s in _within(wanted) if samples <= SHORT or s in made)], key=worth)


def _within(wanted: HwSettings) -> list[HwSettings]:
    """Everything simpler that the settings contain."""
    first, second = (SHAPES[: SHAPES.index(shape) + 1] for shape in (wanted.input_shape, wanted.output_shape))
    orders = [*(order for order in ORDERS if order < wanted.order), wanted.order]
    pairs = [(f, h) for f in first for h in second if {f, h} != {"cubic", "pwl"}]
    family = [replace(wanted, order=n, input_shape=f, output_shape=h) for n in orders for f, h in pairs]
    return [settings for settings in family if settings != wanted]


def words(settings: HwSettings) -> str:
    """`order 4, cubic - line`."""
    return f"order {settings.order}, {settings.input_shape} - {settings.output_shape}"
