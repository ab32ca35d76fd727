"""The latest readings as the deck and the monitor want them, at one fused step. Missing or stale is NaN."""

from collections.abc import Collection, Sequence
from math import nan
from operator import itemgetter

from thrustd.brochure.deck import DeckInputs
from thrustd.fusion.monitor_inputs import ENGINE_SIGNALS, Layout, Sensor
from thrustd.sync.hold import Hold

AIR_PRESSURE_SEA_LEVEL_PA = 101325.0  # ISO 2533
HEAT_RATIO = 1.4  # air
AIR_SIGNALS = ("mach", "pressure_altitude_m", "sat_degC")


class StepInputs:
    """Which held reading goes where. Readings are those of `Layout.sensors` that are no mounts, in their order."""

    def __init__(self, layout: Layout, hold: Hold) -> None:
        self._hold = hold
        self._sensors = layout.sensors()[len(layout.mount_names) :]
        self._heard = itemgetter(*[hold.place(*sensor) for sensor in self._sensors])
        air = [self.place(name, 0) for name in AIR_SIGNALS]
        self._of_deck = [
            itemgetter(*[self.place(name, engine) for name in ENGINE_SIGNALS], *air)
            for engine in range(len(layout.mounts_of_engine))
        ]

    def place(self, signal: str, index: int) -> int:
        """Of a sensor among the readings."""
        return self._sensors.index((signal, index))

    def at(self, t_ns: int) -> tuple[Sequence[float], Sequence[float]]:
        """The readings, and their ages in seconds."""
        values, ages_s = self._hold.seen(t_ns)
        return self._heard(values), self._heard(ages_s)

    def believed(self, readings: Sequence[float], excluded: Collection[Sensor]) -> Sequence[float]:
        """Without the sensors that are not believed."""
        if not excluded:
            return readings
        return [nan if s in excluded else value for s, value in zip(self._sensors, readings, strict=True)]

    def deck(self, readings: Sequence[float], engine: int, n1_rate_pct_s: float) -> DeckInputs:
        """What the brochure deck reads of one engine."""
        return DeckInputs._make((*self._of_deck[engine](readings), n1_rate_pct_s))


def dynamic_pressure_pa(mach: float, pressure_altitude_m: float) -> float:
    """q = gamma / 2 p M^2."""
    return 0.5 * HEAT_RATIO * static_pressure_pa(pressure_altitude_m) * mach * mach


def static_pressure_pa(pressure_altitude_m: float) -> float:
    """Static pressure of the standard atmosphere below 11 km, its continuation above (ISO 2533)."""
    return AIR_PRESSURE_SEA_LEVEL_PA * max(1.0 - 2.25577e-5 * pressure_altitude_m, 1e-3) ** 5.25588
