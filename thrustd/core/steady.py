"""How long everything has stayed inside limits: the one rule for test points, in flight and on the ground.

A quantity is steady over a window when its span there, the largest minus the smallest of its one-second means, is at
most its limit. `SteadyWatch` says after every second how long the window that ends now is at most.
"""

from collections import deque
from collections.abc import Sequence
from math import isfinite
from typing import NamedTuple

import msgspec


class SteadyLimits(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Largest spans within a test point, and what a point is at least.

    Defaults: what the level points of a PH-LAB flight need, marked by their crew (docs/flight-test.md), with some room.
    """

    mach: float = 0.006
    altitude_m: float = 35.0
    n1_pct: float = 0.5
    accel_x_g: float = 0.01
    load_factor_g: float = 0.08
    least_n1_pct: float = 20.0  # every engine: below it is off or starting
    least_s: float = 30.0


class Quantity(NamedTuple):
    """One quantity that has to be steady."""

    channel: str  # of the catalogue
    engine: int
    limit: float


def quantities(limits: SteadyLimits, engines: int) -> tuple[Quantity, ...]:
    """What is watched of an aircraft with so many engines."""
    return (
        Quantity("mach", 0, limits.mach),
        Quantity("pressure_altitude_m", 0, limits.altitude_m),
        *(Quantity("n1_pct", engine, limits.n1_pct) for engine in range(engines)),
        Quantity("accel_x_g", 0, limits.accel_x_g),
        Quantity("accel_z_g", 0, limits.load_factor_g),
    )


class SteadyWatch:
    """Takes one row of means after another, evenly in time."""

    __slots__ = ("_first", "_high", "_limits", "_low", "_n")

    def __init__(self, limits: Sequence[float]) -> None:
        self._limits = tuple(limits)
        self._n = self._first = 0
        # per quantity (place, value): what may yet be the largest or smallest of a window, values falling or rising
        self._high: list[deque[tuple[int, float]]] = [deque() for _ in limits]
        self._low: list[deque[tuple[int, float]]] = [deque() for _ in limits]

    def take(self, row: Sequence[float]) -> int:
        """Rows of the longest steady window that ends with this one; 0 when a value of it is not known."""
        place, self._n = self._n, self._n + 1
        if not all(map(isfinite, row)):
            self._first = self._n
            for kept in (*self._high, *self._low):
                kept.clear()
            return 0
        for value, limit, high, low in zip(row, self._limits, self._high, self._low, strict=True):
            while high and high[-1][1] <= value:
                high.pop()
            while low and low[-1][1] >= value:
                low.pop()
            high.append((place, value))
            low.append((place, value))
            while high[0][1] - low[0][1] > limit:
                older = high if high[0][0] < low[0][0] else low
                self._first = max(self._first, older.popleft()[0] + 1)
        for high, low in zip(self._high, self._low, strict=True):
            for kept in (high, low):
                while kept[0][0] < self._first:
                    kept.popleft()
        return self._n - self._first
