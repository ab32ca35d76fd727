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


class SmoothRate:
    """Derivative of a sampled signal behind a first-order lag: rate = (value - lagged value) / tau."""

    __slots__ = ("_lagged", "_t_ns")

    def __init__(self) -> None:
        self._lagged = nan
        self._t_ns = 0

    def step(self, t_ns: int, value: float) -> float:
        """Rate in units per second; NaN while there is no value."""
        rate, self._lagged = smooth_rate(self._lagged, value, (t_ns - self._t_ns) * 1e-9)
        self._t_ns = t_ns
        return float(rate)
