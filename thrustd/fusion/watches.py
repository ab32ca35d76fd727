"""The watches of every sensor of the aircraft, stepped at once (see `signal_watch`)."""

from typing import Any

import numpy as np

from thrustd.fusion.limits import ALONE_STUCK_S, FLYING_MACH, LIMITS, TURNING_N1_PCT
from thrustd.fusion.monitor_inputs import Layout, MonitorInputs, Sensor
from thrustd.fusion.signal_watch import (
    JUMP_LIMIT,
    STUCK_LIMIT,
    SignalWatch,
    fresh_rows,
    is_sane,
    limit_rows,
    watch,
)

ENGINE_SIGNALS = ("fuel_flow_kg_s", "n1_pct", "n2_pct")
WITNESS_STEPS = 10
AIRCRAFT_SIGNALS = ("mach", "pressure_altitude_m", "sat_degC", "accel_x_g", "accel_y_g", "accel_z_g")


class Watches:
    """Mutable; `snapshot` / `restore` for the checkpoint."""

    def __init__(self, layout: Layout) -> None:
        engines = range(len(layout.mounts_of_engine))
        self.sensors: tuple[Sensor, ...] = (
            *(("deformation_mm", i) for i in range(len(layout.mount_names))),
            *((name, e) for name in ENGINE_SIGNALS for e in engines),
            *((name, 0) for name in AIRCRAFT_SIGNALS),
        )
        n = len(self.sensors)
        self._rows, self._limits = fresh_rows(n), limit_rows([LIMITS[name] for name, _ in self.sensors])
        self._values, self._active = np.zeros(n), np.ones(n, dtype=np.bool_)
        self._of = {sensor: SignalWatch(row) for sensor, row in zip(self.sensors, self._rows, strict=True)}
        self._place = {sensor: i for i, sensor in enumerate(self.sensors)}
        self.suspect = False  # some sensor has a fault or a jump in doubt

    def __getitem__(self, sensor: Sensor) -> SignalWatch:
        return self._of[sensor]

    def trusts(self, sensor: Sensor) -> bool:
        """No fault, no jump in doubt."""
        watched = self._of[sensor]
        return not (watched.kind or watched.doubted)

    def step(self, inputs: MonitorInputs) -> None:
        """Every 0.1 s."""
        self._values[:] = (
            *(*inputs.deformation_mm, *inputs.fuel_flow_kg_s, *inputs.n1_pct, *inputs.n2_pct),
            *(inputs.mach, inputs.pressure_altitude_m, inputs.sat_degc),
            *(inputs.accel_x_g, inputs.accel_y_g, inputs.accel_z_g),
        )
        spools = zip(inputs.n1_pct, inputs.n2_pct, strict=True)
        turning = [n1 > TURNING_N1_PCT or n2 > TURNING_N1_PCT for n1, n2 in spools]
        for engine in range(len(turning)):
            self._limit(engine)
        self._active[len(inputs.deformation_mm) :] = (
            *(*turning, *turning, *turning),
            *((inputs.mach > FLYING_MACH,) * len(AIRCRAFT_SIGNALS)),
        )
        self.suspect = watch(self._rows, self._limits, self._values, self._active)

    def followed(self, sensor: Sensor) -> bool:
        """Another signal of the engine moved too within the last second, and is not in doubt."""
        name, engine = sensor
        others = [(self._of[other, engine], other) for other in ENGINE_SIGNALS if other != name]
        return any([watched.moved(WITNESS_STEPS, LIMITS[o].moves) and not watched.doubted for watched, o in others])

    def _limit(self, engine: int) -> None:
        """Fuel flow, N1 and N2 of one engine go together: who jumps alone, or rests alone, lies."""
        moved = [self._of[name, engine].moved(WITNESS_STEPS, LIMITS[name].moves) for name in ENGINE_SIGNALS]
        for i, name in enumerate(ENGINE_SIGNALS):
            limits, others = self._limits[self._place[name, engine]], (moved[i - 1], moved[i - 2])
            own = LIMITS[name]
            limits[JUMP_LIMIT] = own.alone_jump if others == (False, False) else own.jump
            limits[STUCK_LIMIT] = ALONE_STUCK_S if others == (True, True) else own.stuck_s

    def forget_last_values(self) -> None:
        """Nobody watched for a while: a change since the last value is not a jump."""
        before = self._rows.copy()
        watch(self._rows, self._limits, np.full(len(before), np.nan), self._active)
        for i, sensor in enumerate(self.sensors):
            if self._of[sensor].kind == "offset":
                self._rows[i] = before[i]

    def snapshot(self) -> list[list[float]]:
        """One row of numbers per sensor."""
        return self._rows.tolist()

    def restore(self, rows: Any) -> bool:
        """Take over a snapshot; False, and nothing changed, when it is none of these sensors."""
        found = np.array(rows, dtype=np.float64)  # raises ValueError or TypeError on anything but rows of numbers
        if found.shape != self._rows.shape or not is_sane(found):
            return False
        self._rows[:] = found
        return True
