"""The latest readings as deck and monitor want them, at one fused step. Missing or stale is NaN."""

from collections.abc import Collection

import numpy as np

from thrustd.columns import Floats
from thrustd.fusion.monitor_inputs import Layout, Sensor
from thrustd.sync.hold import Hold

AIR_PRESSURE_SEA_LEVEL_PA = 101325.0  # ISO 2533
HEAT_RATIO = 1.4  # air


class StepInputs:
    """Which held reading goes where. Readings are those of `Layout.sensors` that are no mounts, in their order."""

    def __init__(self, layout: Layout, hold: Hold) -> None:
        self._hold = hold
        self._sensors = layout.sensors()[len(layout.mount_names) :]
        self._heard = np.array([hold.place(*sensor) for sensor in self._sensors])

    def place(self, signal: str, index: int) -> int:
        """Of a sensor among the readings."""
        return self._sensors.index((signal, index))

    def at(self, t_ns: int) -> tuple[bool, Floats, Floats]:
        """Whether signals went stale or came back, the readings, and their ages in seconds."""
        changed = self._hold.look(t_ns)
        readings, ages_s = self._hold.seen.take(self._heard, axis=1)
        return changed, readings, ages_s

    def believed(self, readings: Floats, excluded: Collection[Sensor]) -> Floats:
        """Without the sensors that are not believed."""
        if not excluded:
            return readings
        out = np.array([sensor in excluded for sensor in self._sensors])
        return np.where(out, np.nan, readings)


def dynamic_pressure_pa(mach: float, pressure_altitude_m: float) -> float:
    """q = gamma / 2 p M^2."""
    return 0.5 * HEAT_RATIO * static_pressure_pa(pressure_altitude_m) * mach * mach


def static_pressure_pa(pressure_altitude_m: float) -> float:
    """Static pressure of the standard atmosphere below 11 km, its continuation above (ISO 2533)."""
    return AIR_PRESSURE_SEA_LEVEL_PA * max(1.0 - 2.25577e-5 * pressure_altitude_m, 1e-3) ** 5.25588
