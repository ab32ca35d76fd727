"""Readings on the step grid: hold, age and lateness rule per signal, and the ADC's clock on ours.

The instants of the ADC are the grid. Everything else arrives when it arrives: a reading holds until the next one and
counts as missing once it is older than the catalogue's `stale_after_s`.
"""

from math import exp, isfinite, nan
from typing import Any

from thrustd.signals import CATALOGUE
from thrustd.types import Fault, Reading

CRYSTAL_TOLERANCE = 100e-6  # two crystals drift apart by less than this, s/s
RATE_TAU_S = 0.5  # time constant of the derivative of N1: faster than a spool, slower than quantisation


class ClockMap:
    """ADC device time -> our monotonic time: the smallest delay seen lately is the true offset."""

    __slots__ = ("_device_ns", "_offset_ns")

    def __init__(self) -> None:
        self._device_ns = 0
        self._offset_ns: int | None = None

    def to_ns(self, arrival_ns: int, device_time_us: int) -> int:
        """Monotonic time of a sample; never later than its arrival."""
        device_ns = device_time_us * 1000
        delay_ns = arrival_ns - device_ns
        if self._offset_ns is None or device_ns < self._device_ns:
            self._offset_ns = delay_ns
        else:
            drift_ns = int((device_ns - self._device_ns) * CRYSTAL_TOLERANCE)
            self._offset_ns = min(self._offset_ns + drift_ns, delay_ns)
        self._device_ns = device_ns
        return device_ns + self._offset_ns


class Hold:
    """The latest reading of every signal, with its age."""

    __slots__ = ("_stale", "_values")

    def __init__(self) -> None:
        self._values: dict[tuple[str, int], tuple[float, int]] = {}
        self._stale: set[tuple[str, int]] = set()

    def take(self, reading: Reading) -> Fault | None:
        """Keep a reading; a value outside the catalogue's range is a fault and does not count."""
        signal = CATALOGUE[reading.signal]
        if not signal.low <= reading.value <= signal.high:
            return Fault(reading.t_ns, f"{reading.signal}[{reading.index}]", "out_of_range")
        self._values[reading.signal, reading.index] = (reading.value, reading.t_ns)
        return None

    def value(self, t_ns: int, signal: str, index: int = 0) -> float:
        """The value at t_ns, NaN when never seen or stale."""
        value, since_ns = self._values.get((signal, index), (nan, 0))
        return value if t_ns - since_ns <= CATALOGUE[signal].stale_after_s * 1e9 else nan

    def changes(self, t_ns: int) -> list[Fault]:
        """Signals that went stale, or came back, since the last call."""
        faults = []
        for (signal, index), (_, since_ns) in self._values.items():
            stale = t_ns - since_ns > CATALOGUE[signal].stale_after_s * 1e9
            if stale != ((signal, index) in self._stale):
                faults.append(Fault(t_ns, f"{signal}[{index}]", "stale" if stale else "fresh"))
                (self._stale.add if stale else self._stale.discard)((signal, index))
        return faults

    def readings(self, after_ns: int) -> list[Reading]:
        """The latest reading of every signal that was heard later than `after_ns`, at its own time."""
        return [
            Reading(since_ns, signal, index, value)
            for (signal, index), (value, since_ns) in self._values.items()
            if since_ns > after_ns
        ]

    def snapshot(self) -> list[list[Any]]:
        """Rows of signal, index, value, t_ns."""
        return [[signal, index, value, t_ns] for (signal, index), (value, t_ns) in self._values.items()]

    def restore(self, rows: list[list[Any]], shift_ns: int = 0) -> bool:
        """Take over the readings of a snapshot, their times moved by `shift_ns`; False when it is none."""
        try:
            readings = [Reading(int(t_ns) + shift_ns, name, int(i), float(value)) for name, i, value, t_ns in rows]
            return all([self.take(reading) is None for reading in readings])
        except (KeyError, TypeError, ValueError):
            return False


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
