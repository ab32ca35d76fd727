"""The watches of every sensor of the aircraft, stepped at once (see `signal_watch`)."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from thrustd.core.aircraft import SensorLimits
from thrustd.core.columns import Floats
from thrustd.core.errors import ConfigError
from thrustd.sensors.monitor_inputs import AIRCRAFT_SIGNALS, ENGINE_SIGNALS, Layout, Sensor
from thrustd.sensors.signal_watch import WITNESS_STEPS, SignalWatch, leapt, limit_rows, watch
from thrustd.sensors.watch_row import NOISE_S, fresh_rows, is_sane

MOVED_PCT, MOVED_STEPS = 3.0, 10  # spools that moved this far within a second: the throttle was moved
RESTING_S = 2.0  # longer: it is stuck
MUTE = "stuck", "noisy"
TOGETHER_MM = 0.05  # both mounts of an engine moved this far in one step: the engine pushed them


class Watches:
    """Mutable; `snapshot` / `restore` for the checkpoint."""

    def __init__(self, layout: Layout, limits: Mapping[str, SensorLimits]) -> None:
        """`limits` by signal; ConfigError when one is missing."""
        self.sensors = layout.sensors()
        self._by_signal, n = limits, len(self.sensors)
        self._size = len(layout.mount_names), len(layout.mounts_of_engine)
        self._mounts_of_engine = layout.mounts_of_engine
        self._rows, self._limits = fresh_rows(n), limit_rows([_limits_of(name, limits) for name, _ in self.sensors])
        self._of = {sensor: SignalWatch(row) for sensor, row in zip(self.sensors, self._rows, strict=True)}

    def __getitem__(self, sensor: Sensor) -> SignalWatch:
        return self._of[sensor]

    def step(self, readings: Floats) -> bool:
        """Watch the readings of one look; true when some sensor has a fault or a jump in doubt."""
        return bool(watch(self._rows, self._limits, readings, *self._size))

    def trusts(self, sensor: Sensor) -> bool:
        """No fault, no jump in doubt."""
        watched = self._of[sensor]
        return not (watched.kind or watched.doubted)

    def mute(self) -> dict[Sensor, float]:
        """Whose readings mean nothing, stuck or noisy, and since how many seconds."""
        mute = ((sensor, watched) for sensor, watched in self._of.items() if watched.kind in MUTE)
        return {sensor: watched.resting_s if watched.kind == "stuck" else NOISE_S for sensor, watched in mute}

    def kind_of_others(self, sensor: Sensor) -> str:
        """Of a fault that the others saw."""
        watched = self._of[sensor]
        return "offset" if watched.jumped_lately else "stuck" if watched.resting_s > RESTING_S else "drift"

    def leapt_alone(self, readings: Floats) -> frozenset[Sensor]:
        """Between two looks, further from where they were than they may jump: out before anything follows them.

        An engine that is pushed moves both of its mounts; its own signals are judged at the next look.
        """
        if not leapt(self._rows, self._limits, readings):
            return frozenset()
        pairs = zip(self.sensors, readings.tolist(), strict=True)
        far = {s for s, value in pairs if abs(self._of[s].step_to(value)) > self._by_signal[s[0]].jump}
        out = {sensor for sensor in far if sensor[0] in AIRCRAFT_SIGNALS}
        for mounts in self._mounts_of_engine:
            mine = [("deformation_mm", i) for i in mounts if ("deformation_mm", i) in far]
            if len(mine) == 1 and len(mounts) > 1:
                out.add(mine[0])
        return frozenset(out)

    def acquit_jumps(self) -> None:
        """A throttle that is cut moves fuel flow, spools and both mounts: what jumps with them did not fail."""
        for engine, mounts in enumerate(self._mounts_of_engine):
            n1, n2 = self["n1_pct", engine], self["n2_pct", engine]
            spools_moved = any(abs(spool.change(MOVED_STEPS)) > MOVED_PCT for spool in (n1, n2) if not spool.doubted)
            last = [self["deformation_mm", i].change(1) for i in mounts]
            together = len(mounts) > 1 and max(last) * min(last) > 0.0 and min(map(abs, last)) > TOGETHER_MM
            for i in mounts:
                if spools_moved or together:
                    self["deformation_mm", i].acquit()
            for name in ENGINE_SIGNALS:
                if self._followed((name, engine)):
                    self[name, engine].acquit()

    def _followed(self, sensor: Sensor) -> bool:
        """Another signal of the engine moved too within the last second, and is not in doubt."""
        name, engine = sensor
        others = [(self._of[other, engine], other) for other in ENGINE_SIGNALS if other != name]
        return any([abs(w.change(WITNESS_STEPS)) > self._by_signal[o].moves and not w.doubted for w, o in others])

    def forget_last_values(self) -> None:
        """Nobody watched for a while: a change since the last value is not a jump, nor is one judged that was in doubt.

        As of a sensor that was dead: nobody saw who followed it.
        """
        before = self._rows.copy()
        watch(self._rows, self._limits, np.full(len(self.sensors), np.nan), *self._size)
        for i, sensor in enumerate(self.sensors):
            if self._of[sensor].kind == "offset":
                self._rows[i] = before[i]
            self._of[sensor].acquit()

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


def _limits_of(signal: str, limits: Mapping[str, SensorLimits]) -> SensorLimits:
    if signal not in limits:
        raise ConfigError(f"aircraft data: limits: no {signal}, which every aircraft has a sensor of")
    return limits[signal]
