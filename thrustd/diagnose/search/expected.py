"""What error the model itself is known to leave: the yardstick of every verdict.

An artifact carries the held-out error of its identification by region of force and rate. Averaged over the regions
which the data visit, it is what the residual would be if nothing were missing.
"""

import numpy as np

from thrustd.diagnose.search.evidence import Evidence
from thrustd.identify.error_map import rates_of
from thrustd.model.artifact import ErrorMap, ModelSpec
from thrustd.model.stage import Floats


def own_error_n(spec: ModelSpec, evidence: Evidence, output_n: Floats) -> float | None:
    """One sigma in N that the identification promises for these data; None when the artifact has no error map."""
    if spec.error is None:
        return None
    parts = np.split(output_n, np.flatnonzero(np.diff(evidence.segment)) + 1)
    rate = np.abs(np.concatenate([rates_of(part, evidence.row_s) for part in parts]))
    return float(np.sqrt(np.mean(_lookup(spec.error, output_n, rate) ** 2)))


def _lookup(error: ErrorMap, force_n: Floats, rate_n_s: Floats) -> Floats:
    i = np.searchsorted(error.force_edges_n[1:-1], force_n, side="right")
    j = np.searchsorted(error.rate_edges_n_s[1:-1], rate_n_s, side="right")
    found: Floats = np.array(error.std_n)[i, j]
    return found
