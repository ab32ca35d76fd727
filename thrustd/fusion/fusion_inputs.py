"""What the filter is told of one engine at one fused step, and what of it is a number of this world."""

from math import nan
from typing import Any, NamedTuple, get_type_hints

import numpy as np

from thrustd.core.jit import compiled

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
    off_n: float = 0.0  # thrust of an engine that burns nothing: on the ground none
    off_std_n: float = 0.0
    unlit: bool = False  # of fuel flow, N1 and N2 somebody says that it burns nothing, and nobody that it does
    burns: bool = False  # somebody says that it does
    installed_n: float = 0.0  # what nobody corrected of its mounts, one sigma
    gap: bool = False
    one_mount: bool = False
    load_factor_stale: bool = False
    status: int = 0  # Status bits found elsewhere (monitor, catalogue): handed through

    def row(self) -> Any:
        """(1,) of INPUTS: the same for compiled code."""
        return np.array([self], INPUTS)


_KINDS: dict[Any, Any] = {int: np.int64, float: np.float64, bool: np.bool_}
INPUTS = np.dtype([(name, _KINDS[hint]) for name, hint in get_type_hints(FusionInputs).items()])


@compiled
def silence(t: Any) -> None:
    """A source whose force or sigma is no number of this world says nothing."""
    if not (abs(t.mount_n) < ABSURD_N and 0.0 < t.mount_std_n < ABSURD_N):
        t.mount_n = t.mount_std_n = nan
    lag, age = 0.0 <= t.brochure_lag_n < ABSURD_N, 0.0 <= t.brochure_age_s < ABSURD_AGE_S
    if not (abs(t.brochure_n) < ABSURD_N and 0.0 < t.brochure_std_n < ABSURD_N and lag and age):
        t.brochure_n = t.brochure_std_n = nan
    if not abs(t.n1_rate_pct_s) < ABSURD_RATE_PCT_S:
        t.n1_rate_pct_s = nan
