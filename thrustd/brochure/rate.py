"""The rate of a signal that comes in samples."""

from math import exp, isfinite, nan
from typing import Any

from thrustd.core.jit import compiled

RATE_TAU_S = 0.5  # time constant of the derivative of N1: faster than a spool, slower than quantisation


def _smooth(lagged: float, value: float, dt_s: float) -> tuple[float, float]:
    """(rate, lagged value) at `value`, dt_s after the last one; NaN while there is no value."""
    if not isfinite(value):
        return nan, nan
    if not isfinite(lagged):
        return 0.0, value
    lagged += (1.0 - exp(-dt_s / RATE_TAU_S)) * (value - lagged)
    return (value - lagged) / RATE_TAU_S, lagged


smooth_rate: Any = compiled(_smooth, "UniTuple(f8, 2)(f8, f8, f8)")
