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


class _Held:
    """The latest reading of one signal beside what the catalogue says of it."""

    __slots__ = ("high", "index", "low", "signal", "stale", "stale_after_ns", "t_ns", "value")

    def __init__(self, name: str, index: int) -> None:
        signal = CATALOGUE[name]
        self.signal, self.index = name, index
        self.low, self.high = signal.low, signal.high
        self.stale_after_ns = round(signal.stale_after_s * 1e9)
        self.stale = False  # as last told
        self.value, self.t_ns = nan, 0


class Hold:
    """The latest reading of every signal, with its age."""

    __slots__ = ("_held",)

    def __init__(self) -> None:
        self._held: dict[tuple[str, int], _Held] = {}

    def take(self, reading: Reading) -> Fault | None:
        """Keep a reading; a value outside the catalogue's range is a fault and does not count."""
        t_ns, signal, index, value = reading
        held = self._held.get((signal, index))
        known = held is not None
        if held is None:
            held = _Held(signal, index)
        if not held.low <= value <= held.high:
            return Fault(t_ns, f"{signal}[{index}]", "out_of_range")
        held.value, held.t_ns = value, t_ns
        if not known:
            self._held[signal, index] = held
        return None

    def value(self, t_ns: int, signal: str, index: int = 0) -> float:
        """The value at t_ns, NaN when never seen or stale."""
        held = self._held.get((signal, index))
        return held.value if held is not None and t_ns - held.t_ns <= held.stale_after_ns else nan

    def age_s(self, t_ns: int, signals: tuple[str, ...], index: int = 0) -> float:
        """Age of the oldest of these readings that still counts; 0 when none does."""
        fresh = [signal for signal in signals if isfinite(self.value(t_ns, signal, index))]
        return max((t_ns - self._held[signal, index].t_ns for signal in fresh), default=0) * 1e-9

    def changes(self, t_ns: int) -> list[Fault]:
        """Signals that went stale, or came back, since the last call."""
        faults = []
        for held in self._held.values():
            stale = t_ns - held.t_ns > held.stale_after_ns
            if stale is not held.stale:
                faults.append(Fault(t_ns, f"{held.signal}[{held.index}]", "stale" if stale else "fresh"))
                held.stale = stale
        return faults

    def readings(self, after_ns: int) -> list[Reading]:
        """The latest reading of every signal that was heard later than `after_ns`, at its own time."""
        return [
            Reading(held.t_ns, held.signal, held.index, held.value)
            for held in self._held.values()
            if held.t_ns > after_ns
        ]

    def snapshot(self) -> list[list[Any]]:
        """Rows of signal, index, value, t_ns."""
        return [[held.signal, held.index, held.value, held.t_ns] for held in self._held.values()]

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
