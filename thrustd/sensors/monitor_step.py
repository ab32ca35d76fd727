"""One look at every sensor as compiled code, up to the next thing that is not everyday.

    WATCH -> [DOUBT] -> OPINIONS -> [JUDGE] -> SHARED -> [ACQUIT or ACCUSE] -> DONE

`look_on` says why it stopped; afterwards it is called again. What is to be done then is in `monitor`.
"""

from typing import Any

import numba
import numpy as np

from thrustd.core.columns import MOUNT_STATE
from thrustd.core.jit import compiled, entry
from thrustd.sensors.common_mode import HOLD_S, differ
from thrustd.sensors.engine_force import SHARE
from thrustd.sensors.limits import SAT_CLIMB_M
from thrustd.sensors.opinions import Flags, Floats, Integers, weigh
from thrustd.sensors.signal_watch import RESTING, STEP_S, watch

DONE, DOUBT, JUDGE, ACQUIT, ACCUSE = range(5)  # why it stopped
WATCH, OPINIONS, SHARED, END = range(4)  # places in a look

LOOK = np.dtype(
    [
        ("place", np.int64),
        ("altitude", np.int64),  # where it and SAT are among the sensors
        ("sat", np.int64),
        ("sat_since_m", np.float64),  # altitude where SAT last moved; NaN: not known
        ("outside_s", np.float64),  # how long mounts and brochure have differed on every engine
        ("suspect", np.bool_),  # some sensor's own watch has a fault or a jump in doubt
        ("sat_moved", np.bool_),
        ("sat_climbed", np.bool_),  # it has not, and the altitude has
        ("accused", np.bool_),  # told: some sensor is, by cross-checks
        ("frozen", np.bool_),  # told: a sensor that several engines share is in doubt
    ],
    align=True,
)


@compiled
def _watch_temperature(look: Any, rows: Floats, altitude_m: float) -> None:
    """SAT holds one value for minutes when level: it is stuck when it does so in a climb."""
    look.sat_moved = rows[look.sat, RESTING] == 0.0 or not np.isfinite(look.sat_since_m)
    if look.sat_moved:
        look.sat_since_m = altitude_m
    look.sat_climbed = abs(altitude_m - look.sat_since_m) > SAT_CLIMB_M


def _look_on(
    memory: Any, rows: Floats, limits: Floats, opinions: Floats, differences: Floats, mounts_of: Integers,
    spools: Integers, judged: Flags, shares: Floats, believed: Flags, readings: Floats, mounts: Any, routes_n: Floats,
) -> int:  # fmt: skip
    look = memory[0]
    if look.place == WATCH:
        look.place, look.frozen, believed[:] = OPINIONS, False, True
        look.suspect = watch(rows, limits, readings, len(mounts), len(opinions))
        _watch_temperature(look, rows, readings[look.altitude])
        if look.suspect or look.accused or look.sat_climbed:
            return DOUBT
    if look.place == OPINIONS:
        look.place = SHARED
        layout = mounts_of, spools, judged
        faulty = weigh(
            opinions, differences, layout, readings, mounts, shares[:, SHARE], routes_n, believed, look.frozen
        )
        if faulty or look.accused:
            return JUDGE
    if look.place == SHARED:
        look.place = END
        if look.frozen:
            return ACQUIT
        look.outside_s = look.outside_s + STEP_S if differ(differences) else 0.0
        if look.outside_s >= HOLD_S:
            return ACCUSE
    look.place = WATCH
    return DONE


_ROW, _TABLE, _PLACES = numba.float64[::1], numba.float64[:, ::1], numba.int64[:, ::1]
_SIGNATURE = numba.int64(
    numba.from_dtype(LOOK)[::1], _TABLE, _TABLE, numba.float64[:, :, ::1], _TABLE, _PLACES, _PLACES,
    numba.boolean[::1], _TABLE, numba.boolean[:, ::1], _ROW, numba.from_dtype(MOUNT_STATE)[::1], _TABLE,
)  # fmt: skip
look_on: Any = entry(compiled(_look_on, _SIGNATURE))
