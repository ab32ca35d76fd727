"""Is the filter as sure as it should be? Two figures from the innovations of a flight.

    NIS        mean of nu^2 / S over the accepted measurements: 1 when the noises are right, more when too small
    whiteness  lag-1 autocorrelation of nu: 0 when nothing that lasts is left over, 1 for a slow error without state

Reference: Bar-Shalom, Li & Kirubarajan, Estimation with Applications to Tracking and Navigation, sec. 5.4.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


class Consistency(NamedTuple):
    nis: float
    whiteness: float


def consistency(nis: Array, innovation_n: Array) -> Consistency:
    """From (n,) columns of estimates; NaN where no measurement was used."""
    believed, nu = nis[np.isfinite(nis)], innovation_n[np.isfinite(innovation_n)]
    if len(believed) == 0 or len(nu) < 3 or np.ptp(nu) == 0.0:
        return Consistency(float("nan"), float("nan"))
    nu = nu - nu.mean()
    return Consistency(float(believed.mean()), float(np.sum(nu[1:] * nu[:-1]) / np.sum(nu * nu)))
