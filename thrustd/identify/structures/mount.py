"""A mount: the regression with everything in it, and what `identify` does when nothing is asked for."""

from collections.abc import Sequence
from dataclasses import replace

import msgspec
import numpy as np

from thrustd.identify.regression.friction import effects_of
from thrustd.identify.regression.hypotheses import resolved
from thrustd.identify.regression.posterior import kept
from thrustd.identify.regression.solve import Progress, Solution
from thrustd.identify.regression.table import spec_of
from thrustd.identify.segments import Segment
from thrustd.identify.structures.block_fits import BlockFits, determined
from thrustd.identify.structures.structure import Fitted, Structure, of_spec
from thrustd.model.artifact import ModelSpec

NAME = "hw-pwl+prandtl-ishlinskii"

UNSEEN = 0.02  # of the largest force: a lower least one is as good as no load


def _fit(segments: Sequence[Segment], fits: BlockFits, progress: Progress | None) -> Fitted:
    wish = replace(fits.wish, friction=True)
    return fitted_from(fits.of(segments, wish, progress).found, segments, wish.segments)


def fitted_from(found: Solution, segments: Sequence[Segment], wanted: int | None = None) -> Fitted:
    """A solution as a structure's result, ready to go on with more data; `wanted`: segments of its tables."""
    spec, rubs = spec_of(found, segments, "mount", wanted), effects_of(found)
    spec = msgspec.structs.replace(
        spec,
        effects=[*spec.effects, *rubs],
        structure=NAME if rubs else spec.structure,
        posterior=kept(found, [e.name for e in rubs]),
    )

    def again(more: Sequence[Segment]) -> Fitted:
        return fitted_from(resolved(found, more), more, wanted)

    fitted = of_spec(spec, round(determined(found)), (*never_excited(spec), *lagging(found)))
    return replace(fitted, again=again)


def never_excited(spec: ModelSpec) -> tuple[str, ...]:
    """Said where the data leave out the least loads: flight idle lives there."""
    low, high = spec.valid.force_n
    if low <= UNSEEN * high:
        return ()
    return (f"force_N never goes below {100 * low / high:.0f} % of its largest; lower, the model extrapolates",)


def lagging(found: Solution) -> tuple[str, ...]:
    """Said where no passive body can be behind the data: more comes out of its loops than goes in."""
    if found.shape.passive or not np.any(found.point.stops):
        return ()
    return (
        "the output follows the input late, however slowly it moves; the force of a passive body leads its deformation:"
        " is this no mount, is one sign turned, or are the two exchanged?",
    )


STRUCTURES = (Structure(NAME, "HW-PWL with Prandtl-Ishlinskii friction", "beyond", _fit),)
