"""A mount: the regression with everything in it, and what `identify` does when nothing is asked for."""

from collections.abc import Sequence

import msgspec
import numpy as np

from thrustd.identify.hw_fit import Progress
from thrustd.identify.regression.posterior import kept
from thrustd.identify.regression.regress import regress
from thrustd.identify.regression.solve import Solution
from thrustd.identify.regression.table import spec_of
from thrustd.identify.segments import Segment
from thrustd.identify.structures.block_fits import BlockFits
from thrustd.identify.structures.structure import Fitted, Structure, of_spec

NAME = "hw-pwl+prandtl-ishlinskii"


def _fit(segments: Sequence[Segment], fits: BlockFits, progress: Progress | None) -> Fitted:
    return fitted_from(regress(segments), segments)


def fitted_from(found: Solution, segments: Sequence[Segment]) -> Fitted:
    """A solution as a structure's result, ready to go on with more data."""
    spec = msgspec.structs.replace(spec_of(found, segments, "mount"), posterior=kept(found))
    numbers = round(determined(found))

    def again(more: Sequence[Segment]) -> Fitted:
        return fitted_from(regress(more), more)

    fitted = of_spec(spec, numbers)
    return Fitted(fitted.n_parameters, fitted.simulate, spec, fitted.warnings, again=again)


def determined(found: Solution) -> float:
    """How many numbers the data determine: the trace of data information over all information (MacKay's gamma)."""
    free = found.free
    data = found.normal.matrix[np.ix_(free, free)] / found.noise_variance
    return float(np.trace(np.linalg.lstsq(found.information[np.ix_(free, free)], data, rcond=None)[0]))


STRUCTURES = (Structure(NAME, "HW-PWL with Prandtl-Ishlinskii friction", "beyond", _fit),)
