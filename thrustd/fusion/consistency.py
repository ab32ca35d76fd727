"""Is the filter as sure as it should be? Two figures from the innovations of a flight, per source.

    NIS        mean of nu^2 / S over the accepted measurements: 1 when the noises are right, more when too small
    whiteness  lag-1 autocorrelation of nu: 0 when nothing that lasts is left over, 1 for a slow error without state

An estimate's `nis` is the mean over the sources it has just used: where both were, the mounts' is 2 nis - brochure_nis.
Reference: Bar-Shalom, Li & Kirubarajan, Estimation with Applications to Tracking and Navigation, sec. 5.4.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from thrustd.core.columns import Floats
from thrustd.core.types import Status

# a filter that settles, an engine that stands, a moving throttle, a rejected measurement: none tells of the noises
LEFT_OUT = int(
    Status.CONVERGING
    | Status.ENGINE_OFF
    | Status.TRANSIENT
    | Status.MOUNT_REJECTED
    | Status.BROCHURE_REJECTED
    | Status.MOUNT_FAILED
    | Status.BROCHURE_FAILED
)
FEWEST = 3


class Consistency(NamedTuple):
    """NaN where there are too few measurements to tell."""

    nis: float
    whiteness: float
    measurements: int


class Innovations(NamedTuple):
    """Columns of one engine's estimates at every fused step, all (n,); NaN where a source was not measured."""

    nis: Floats
    brochure_nis: Floats
    mount_n: Floats
    brochure_n: Floats
    status: npt.NDArray[np.int64]


def consistency(innovations: Innovations) -> dict[str, Consistency]:
    """By source, over the steady part of the flight."""
    steady = (innovations.status & LEFT_OUT) == 0
    nis, brochure_nis, mount_n, brochure_n = (column[steady] for column in innovations[:4])
    mount_nis = np.where(np.isfinite(brochure_nis), 2.0 * nis - brochure_nis, nis)
    return {"mount": _figures(mount_nis, mount_n), "brochure": _figures(brochure_nis, brochure_n)}


def _figures(nis: Floats, innovation_n: Floats) -> Consistency:
    measured = np.isfinite(innovation_n) & np.isfinite(nis)
    n = int(measured.sum())
    return Consistency(float(nis[measured].mean()) if n else float("nan"), whiteness(innovation_n[measured]), n)


def whiteness(innovation_n: Floats) -> float:
    """Lag-1 autocorrelation of the measurements (n,) that were used, one after the other."""
    if len(innovation_n) < FEWEST or np.ptp(innovation_n) == 0.0:
        return float("nan")
    nu = innovation_n - innovation_n.mean()
    return float(np.sum(nu[1:] * nu[:-1]) / np.sum(nu * nu))
