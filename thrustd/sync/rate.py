"""The rate of a signal that comes in samples."""

from math import exp, isfinite, nan

RATE_TAU_S = 0.5  # time constant of the derivative of N1: faster than a spool, slower than quantisation


class SmoothRate:
    """Derivative of a sampled signal behind a first-order lag: rate = (value - lagged value) / tau."""

    __slots__ = ("_lagged", "_t_ns")

    def __init__(self) -> None:
        self._lagged = nan
        self._t_ns = 0

    def step(self, t_ns: int, value: float) -> float:
        """Rate in units per second; NaN while there is no value."""
        if not isfinite(value):
            self._lagged = nan
            return nan
        if not isfinite(self._lagged):
            self._lagged = value
        else:
            dt_s = (t_ns - self._t_ns) * 1e-9
            self._lagged += (1.0 - exp(-dt_s / RATE_TAU_S)) * (value - self._lagged)
        self._t_ns = t_ns
        return (value - self._lagged) / RATE_TAU_S
