"""What error the model itself is known to leave: the yardstick of every verdict.

An artifact carries the held-out error of its identification by region of force and rate. Averaged over the regions
which the data visit, it is what the residual would be if nothing were missing.
"""

import numpy as np

from thrustd.diagnose.evidence import Evidence
from thrustd.model.artifact import ErrorMap, ModelSpec
from thrustd.model.stage import Floats

RATE_S = 1.0


def own_error_n(spec: ModelSpec, evidence: Evidence, output_n: Floats) -> float | None:
    """One sigma in N that the identification promises for these data; None when the artifact has no error map."""
    if spec.error is None:
        return None
    rate = np.abs(force_rate_n_s(evidence, output_n))
    return float(np.sqrt(np.mean(_lookup(spec.error, output_n, rate) ** 2)))


def force_rate_n_s(evidence: Evidence, output_n: Floats) -> Floats:
    """Rate of the model's force over about a second, by row (n,)."""
    step = max(1, round(RATE_S / evidence.row_s))
    rate = np.zeros_like(output_n)
    rate[step:] = (output_n[step:] - output_n[:-step]) / (step * evidence.row_s)
    same = np.zeros(len(rate), bool)
    same[step:] = evidence.segment[step:] == evidence.segment[:-step]
    return np.where(same, rate, 0.0)


def _lookup(error: ErrorMap, force_n: Floats, rate_n_s: Floats) -> Floats:
    i = np.searchsorted(error.force_edges_n[1:-1], force_n, side="right")
    j = np.searchsorted(error.rate_edges_n_s[1:-1], rate_n_s, side="right")
    found: Floats = np.array(error.std_n)[i, j]
    return found
