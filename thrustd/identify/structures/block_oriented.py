"""Block-oriented structures (thesis section 13.4) and their linear members: one regression, with less or more in it.

oe-2-2, oe-6-4               linear output error of two and of four poles: both curves straight
hammerstein, hammerstein-pwl curve before the linear block
wiener                       curve behind it
hammerstein-wiener           cubics on both sides
hw-pwl                       curves on both sides: the thesis' winner, without friction
"""

from collections.abc import Sequence
from dataclasses import replace

import msgspec

from thrustd.identify.regression.general import Asked
from thrustd.identify.regression.posterior import kept
from thrustd.identify.regression.solve import Progress
from thrustd.identify.segments import Segment
from thrustd.identify.structures.block_fits import BlockFits
from thrustd.identify.structures.structure import Family, Fitted, Structure, of_spec


def _structure(name: str, title: str, family: Family, asked: Asked) -> Structure:
    """Order and segments are those that were wished for, unless the structure has its own."""

    def fit(segments: Sequence[Segment], fits: BlockFits, progress: Progress | None) -> Fitted:
        wished = replace(asked, order=asked.order or fits.wish.order, segments=fits.wish.segments)
        found = fits.of(segments, wished, progress)
        spec = msgspec.structs.replace(found.spec, structure=name, posterior=kept(found.found))
        return of_spec(spec, found.n_parameters)

    return Structure(name, title, family, fit)


STRUCTURES = (
    _structure("oe-2-2", "output error 2/2", "linear", Asked("line", "line", order=2)),
    _structure("oe-6-4", "output error 6/4", "linear", Asked("line", "line", order=4)),
    _structure("hammerstein", "Hammerstein, cubic", "block-oriented", Asked("cubic", "line")),
    _structure("hammerstein-pwl", "Hammerstein, PWL", "block-oriented", Asked("curve", "line")),
    _structure("wiener", "Wiener, cubic", "block-oriented", Asked("line", "cubic")),
    _structure("hammerstein-wiener", "Hammerstein-Wiener, cubics", "block-oriented", Asked("cubic", "cubic")),
    _structure("hw-pwl", "HW-PWL", "block-oriented", Asked()),
)
