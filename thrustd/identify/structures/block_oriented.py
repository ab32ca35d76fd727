"""Block-oriented structures (thesis section 13.4) and their linear members, all by one search (`identify.hw_fit`).

oe-2-2, oe-6-4               linear output error: both curves straight; 4 poles carry 5 zeros' worth of numerator
hammerstein, hammerstein-pwl curve before the linear block
wiener                       curve behind it
hammerstein-wiener           cubics on both sides
hw-pwl                       ten segments on both sides: the thesis' winner
"""

from collections.abc import Sequence

import msgspec

from thrustd.identify.hw_fit import HwSettings, Progress
from thrustd.identify.segments import Segment
from thrustd.identify.structures.block_fits import BlockFits
from thrustd.identify.structures.simpler import best_of, words
from thrustd.identify.structures.structure import Family, Fitted, Structure, of_spec


def _structure(name: str, title: str, family: Family, settings: HwSettings | None = None) -> Structure:
    """`settings` None: those that were asked for."""

    def fit(segments: Sequence[Segment], fits: BlockFits, progress: Progress | None) -> Fitted:
        wanted = settings or fits.hw_pwl
        chosen = best_of(segments, wanted, fits, progress)
        found = fits.of(segments, chosen, progress)
        note = "" if chosen == wanted else f"{words(chosen)} follows the same data better: this is it"
        return of_spec(msgspec.structs.replace(found.spec, structure=name), found.n_parameters, found.warnings, note)

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
    _structure("hw-pwl", "HW-PWL, 10 + 10 segments", "block-oriented"),
)
