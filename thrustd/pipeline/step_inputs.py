"""The latest readings as deck and monitor want them, and what the filters are told. Missing or stale is NaN."""

from collections.abc import Collection
from math import isfinite, nan
from typing import Any

import numba
import numpy as np

from thrustd.core.aircraft import NO_MOUNT
from thrustd.core.columns import MOUNT_STATE, Floats, Integers
from thrustd.core.jit import compiled, entry
from thrustd.fusion.fusion_inputs import INPUTS
from thrustd.sensors.engine_force import ENGINE_MOUNTS
from thrustd.sensors.monitor_inputs import Layout, Sensor
from thrustd.sync.hold import Hold


class StepInputs:
    """Which held reading goes where: readings are of `Layout.sensors`, in their order."""

    def __init__(self, layout: Layout, hold: Hold, states: Any) -> None:
        """`states`: MOUNT_STATE by mount, where the mounts' readings come from."""
        self._hold, self._measured_mm = hold, states["deformation_mm"]
        self._sensors = layout.sensors()
        self._heard = np.array([hold.place(*sensor) for sensor in self._sensors])
        self._seen = np.full((2, len(self._sensors)), nan)
        self.readings, self.ages_s = self._seen
        self._of_mounts = self.readings[: len(states)]

    def place(self, signal: str, index: int) -> int:
        """Of a sensor among the readings."""
        return self._sensors.index((signal, index))

    def look(self, t_ns: int) -> bool:
        """Bring `readings` and their `ages_s` to t_ns; true when signals went stale or came back."""
        changed = self._hold.look(t_ns)
        self._hold.seen.take(self._heard, axis=1, out=self._seen, mode="wrap")  # slot -1: never heard
        return changed

    def measure(self) -> None:
        """The mounts' part of `readings`, as their models were given it."""
        self._of_mounts[:] = self._measured_mm

    def trusted(self, excluded: Collection[Sensor]) -> Floats:
        """`readings` without the excluded sensors."""
        if not excluded:
            return self.readings
        out = np.array([sensor in excluded for sensor in self._sensors])
        return np.where(out, np.nan, self.readings)


def _tell_filters(
    told: Any, t_ns: int, status: Integers, engines: Any, mounts_of: Integers, mounts: Any, load_factors: Floats
) -> None:
    """INPUTS by engine: all but its brochure source. `load_factors`: as read."""
    loaded = True
    for load_factor in load_factors:
        loaded &= isfinite(load_factor)
    for e in range(len(told)):
        t, engine = told[e], engines[e]
        t.t_ns, t.status, t.load_factor_stale = t_ns, status[e], not loaded
        t.mount_n, t.mount_std_n, t.push_n = engine.force_n, engine.std_n, engine.push_n
        t.load_share, t.one_mount = engine.load_share, engine.one_mount
        t.mount_extrapolating = t.gap = False
        for i in mounts_of[e]:
            if i != NO_MOUNT:
                t.mount_extrapolating |= mounts[i].extrapolating
                t.gap |= mounts[i].gap


_I = numba.int64
_TOLD, _ENGINES, _MOUNTS = (numba.from_dtype(kind)[::1] for kind in (INPUTS, ENGINE_MOUNTS, MOUNT_STATE))
tell_filters: Any = entry(
    compiled(_tell_filters, numba.void(_TOLD, _I, _I[::1], _ENGINES, _I[:, ::1], _MOUNTS, numba.float64[::1]))
)
