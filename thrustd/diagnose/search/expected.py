"""What error the model itself is known to leave: the yardstick of every verdict.

An artifact carries the held-out error of its identification by region of force and rate. Averaged over the regions
which the data visit, it is what the residual would be if nothing were missing.
"""

import numpy as np

from thrustd.core.measures import rms
from thrustd.diagnose.search.evidence import Evidence
from thrustd.identify.error_map import rates_of
from thrustd.model.artifact import ModelSpec
from thrustd.model.region_error import region_stds_n
from thrustd.model.stage import Floats


def own_error_n(spec: ModelSpec, evidence: Evidence, output_n: Floats) -> float | None:
    """One sigma in N that the identification promises for these data; None when the artifact has no error map."""
    if spec.error is None:
        return None
    parts = np.split(output_n, np.flatnonzero(np.diff(evidence.segment)) + 1)
    rate = np.abs(np.concatenate([rates_of(part, evidence.row_s) for part in parts]))
    return rms(region_stds_n(spec.error, output_n, rate))
