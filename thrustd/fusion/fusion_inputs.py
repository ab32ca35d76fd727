"""What the filter is told of one engine at one fused step, and what of it is a number of this world."""

from math import nan
from typing import NamedTuple

ABSURD_RATE_PCT_S = 100.0
ABSURD_N = 1e5  # no engine, no mount: not a measurement
ABSURD_AGE_S = 10.0


class FusionInputs(NamedTuple):
    """NaN = no measurement. Forces in N, one sigma beside them."""

    t_ns: int
    mount_n: float  # sum of the engine's mounts, corrected for load factors
    mount_std_n: float  # of the model in this region, its slow errors included
    brochure_n: float
    brochure_std_n: float  # slow: the engine's own deviation included
    n1_pct: float
    n1_rate_pct_s: float
    brochure_lag_n: float = 0.0  # lasts as long as the throttle moves
    brochure_age_s: float = 0.0  # of the reading behind the brochure thrust: a value that is repeated is not news
    push_n: float = 0.0  # what both mounts were moved by lately, 0 when they do not say the same
    load_share: float = nan
    mount_extrapolating: bool = False
    brochure_extrapolating: bool = False
    transient: bool = False
    gap: bool = False
    one_mount: bool = False
    load_factor_stale: bool = False
    status: int = 0  # Status bits found elsewhere (monitor, catalogue): handed through


def sane(inputs: FusionInputs) -> FusionInputs:
    """A route whose force or sigma is no number of this world is silent."""
    mount = abs(inputs.mount_n) < ABSURD_N and 0.0 < inputs.mount_std_n < ABSURD_N
    brochure = abs(inputs.brochure_n) < ABSURD_N and 0.0 < inputs.brochure_std_n < ABSURD_N
    brochure = brochure and 0.0 <= inputs.brochure_lag_n < ABSURD_N and 0.0 <= inputs.brochure_age_s < ABSURD_AGE_S
    rate_known = abs(inputs.n1_rate_pct_s) < ABSURD_RATE_PCT_S
    if mount and brochure and rate_known:
        return inputs
    return inputs._replace(
        mount_n=inputs.mount_n if mount else nan,
        mount_std_n=inputs.mount_std_n if mount else nan,
        brochure_n=inputs.brochure_n if brochure else nan,
        brochure_std_n=inputs.brochure_std_n if brochure else nan,
        n1_rate_pct_s=inputs.n1_rate_pct_s if rate_known else nan,
    )
