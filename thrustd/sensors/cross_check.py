"""The engines and the sources of one step against each other.

    source residual  mounts minus brochure            an engine that wears burns more fuel for its thrust: it falls
    asymmetry       thrust minus the others' mean    of engines at the same throttle

The mounts' load share stands in the estimate.
"""

from collections.abc import Sequence
from math import nan

from thrustd.core.types import CrossCheck, Estimate


def cross_checks(estimates: Sequence[Estimate]) -> list[CrossCheck]:
    """One per engine, of their `estimates` at one instant."""
    others, total_n = len(estimates) - 1, sum(e.thrust_n for e in estimates)
    return [
        CrossCheck(
            e.t_ns,
            e.engine,
            e.mount_n - e.brochure_n,
            e.thrust_n - (total_n - e.thrust_n) / others if others else nan,
        )
        for e in estimates
    ]
