"""Sensors that fail on purpose: what a broken transducer makes of its values before they go on the wire."""

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from thrustd.core.errors import UsageError
from thrustd.twin.fast import FloatArray

Kind = Literal["stuck", "noisy", "offset", "drift", "dead"]
KINDS: tuple[Kind, ...] = ("stuck", "noisy", "offset", "drift", "dead")


class SensorFault(NamedTuple):
    """Sensor `number` of `signal` fails from `start_s` to `stop_s` of the flight.

    `size` is in the signal's unit: one sigma (noisy), the step (offset), per minute (drift). `stuck` repeats the last
    value, `dead` sends nothing (an ADC channel reads open).
    """

    signal: str
    number: int  # engine or mount; 0 for aircraft signals
    kind: Kind
    start_s: float
    stop_s: float = float("inf")
    size: float = 0.0


class Breaker:
    """Applies the faults of one flight block by block; keeps the value a stuck sensor is stuck at.

    `faults` is read anew at every block: whoever kept the list may add one while the flight is under way.
    """

    def __init__(self, faults: Sequence[SensorFault], seed: int) -> None:
        for fault in faults:
            if fault.kind not in KINDS:
                raise UsageError(f"sensor fault {fault.kind!r}: expected one of {', '.join(KINDS)}")
        self._faults = faults
        self._held: dict[SensorFault, float] = {}
        self._rng = np.random.default_rng([seed, 4])

    def apply(self, signal: str, number: int, time_s: FloatArray, values: FloatArray) -> FloatArray:
        """`values` (n,) as the broken sensor gives them; NaN = says nothing."""
        for fault in self._faults:
            if (fault.signal, fault.number) == (signal, number):
                on = (time_s >= fault.start_s) & (time_s < fault.stop_s)
                if on.any():
                    values = np.where(on, self._broken(fault, time_s, values, int(np.argmax(on))), values)
        return values

    def _broken(self, fault: SensorFault, time_s: FloatArray, values: FloatArray, first: int) -> FloatArray:
        match fault.kind:
            case "stuck":
                return np.full(len(values), self._held.setdefault(fault, float(values[first])))
            case "noisy":
                return values + self._rng.normal(0.0, fault.size, len(values))
            case "offset":
                return values + fault.size
            case "drift":
                return values + fault.size * (time_s - fault.start_s) / 60.0
            case "dead":
                return np.full(len(values), np.nan)
