"""From the forces of single mounts to the force on the engine, with whichever mounts are believed.

both mounts    F = sum F_i,  share = sum F_upper F dt / sum F^2 dt      (least squares: F_upper = share F)
               sigma^2 = sum sigma_i^2 + (sum c_i)^2 - sum c_i^2        c_i: what both have to the same side
one mount      F = F_i / share_i,  share from the time when both were believed; one sigma of share widens the band

push           p = (k_upper + k_lower) d,  d: the smaller of what both moved to the same side within half a second, mm

A push is seen by the transducers themselves: one that lies has the other against it, an acceleration that lies moves
none. At idle F_upper / F says more of the transducers' zeros than of the share: least squares weigh it little.
"""

from collections.abc import Sequence
from math import isfinite, nan, sqrt
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from thrustd.compiled import compiled

UPPER_N_MM, LOWER_N_MM = 5079.0, 5954.0  # fore and aft spring rates of the two isolators, thesis table 4.1
UPPER_SHARE = UPPER_N_MM / (UPPER_N_MM + LOWER_N_MM)
PRIOR_N2_S = 2000.0**2 * 5.0  # what the spring rates are worth: five seconds at 2 kN
MEMORY_N2_S = 5000.0**2 * 60.0  # a minute at 5 kN: slower than a throttle movement
MAX_STEP_S = 1.0
SHARE_STD = 0.02  # of one mount's part, when scaled from the other
SHARE, WEIGHT_N2_S = range(2)  # the memory of one engine
PUSH_TAU_S = 0.5
FORCE_N, STD_N, COMMON_N, MEASURED_MM = range(4)  # rows by mount: force, one sigma of its own, and of what both have
NO_MOUNT = -1
_new: Final = tuple.__new__  # half the time of calling a NamedTuple
Floats = npt.NDArray[np.float64]


class EngineMounts(NamedTuple):
    """One engine's mount route at one step; NaN force = none is believed."""

    force_n: float
    std_n: float
    load_share: float  # upper mount's part, slow average, -
    one_mount: bool
    push_n: float  # what both mounts were moved by within half a second; 0 when they do not say the same


class MountCombiner:
    """Keeps the slow load share of every engine. Starts from the spring rates."""

    def __init__(self, mounts_of_engine: Sequence[Sequence[int]]) -> None:
        """By engine, its mounts: the upper one first."""
        self.rows = np.tile((UPPER_SHARE, PRIOR_N2_S), (len(mounts_of_engine), 1))
        self.mounts = np.full((len(mounts_of_engine), max(2, *map(len, mounts_of_engine))), NO_MOUNT)
        for row, mounts in zip(self.mounts, mounts_of_engine, strict=True):
            row[: len(mounts)] = mounts
        self._lagged_mm = np.full(1 + max(map(max, mounts_of_engine)), nan)
        self._out = np.zeros((len(mounts_of_engine), 4))

    def step(self, mounts_n: Floats, believed: npt.NDArray[np.bool_], dt_s: float) -> list[EngineMounts]:
        """`mounts_n` (4, n_mounts), `believed` (n_mounts,); forces that are not finite are not believed either."""
        _combine(self.rows, self.mounts, self._lagged_mm, mounts_n, believed, dt_s, self._out)
        shares = self.rows[:, SHARE].tolist()
        rows = zip(self._out.tolist(), shares, strict=True)
        return [_new(EngineMounts, (force, std, share, one > 0.0, push)) for (force, std, one, push), share in rows]

    def snapshot(self) -> list[list[float]]:
        rows: list[list[float]] = self.rows.tolist()
        return rows

    def restore(self, rows: Sequence[Sequence[float]]) -> None:
        """ValueError when these are not as many rows of numbers."""
        found = np.array(rows, dtype=np.float64)
        if found.shape != self.rows.shape or not np.isfinite(found).all():
            raise ValueError("not the shares of these engines")
        self.rows[:] = found


@compiled
def _learn(row: Floats, upper_n: float, total_n: float, dt_s: float) -> None:
    news = total_n * total_n * dt_s
    row[WEIGHT_N2_S] = min(row[WEIGHT_N2_S] + news, MEMORY_N2_S)
    row[SHARE] += news / row[WEIGHT_N2_S] * (min(max(upper_n / total_n, 0.2), 0.8) - row[SHARE])


@compiled
def _both(mounts_n: Floats, mounts: Any) -> tuple[float, float]:
    """Force and one sigma of all mounts together."""
    force_n = variance_n2 = common_n = common_n2 = 0.0
    for i in mounts:
        force_n += mounts_n[FORCE_N, i]
        variance_n2 += mounts_n[STD_N, i] ** 2
        common_n += mounts_n[COMMON_N, i]
        common_n2 += mounts_n[COMMON_N, i] ** 2
    return force_n, sqrt(variance_n2 + common_n**2 - common_n2)


@compiled
def _push_n(moved_mm: Floats, upper: int, lower: int) -> float:
    """NaN is no movement."""
    both = moved_mm[upper] * moved_mm[lower] > 0.0
    smaller = upper if abs(moved_mm[upper]) < abs(moved_mm[lower]) else lower
    return (UPPER_N_MM + LOWER_N_MM) * moved_mm[smaller] if both else 0.0


def _combine_all(
    rows: Floats, mounts: Any, lagged_mm: Floats, mounts_n: Floats, believed: Any, dt_s: float, out: Floats
) -> None:
    """`out` by engine: force, one sigma, 1 when it is scaled from one mount, push."""
    moved_mm = mounts_n[MEASURED_MM] - lagged_mm
    for i in range(len(lagged_mm)):
        known = isfinite(moved_mm[i])
        lagged_mm[i] = lagged_mm[i] + min(dt_s / PUSH_TAU_S, 1.0) * moved_mm[i] if known else mounts_n[MEASURED_MM, i]
    for e in range(len(rows)):
        n = n_usable = 0
        only = NO_MOUNT
        for i in mounts[e]:
            if i != NO_MOUNT:
                n += 1
                if believed[i] and isfinite(mounts_n[FORCE_N, i]):
                    n_usable += 1
                    only = i if only == NO_MOUNT else only
        out[e] = nan
        out[e, 2] = out[e, 3] = 0.0
        if n_usable == n and n > 0:
            force_n, std_n = _both(mounts_n, mounts[e, :n])
            out[e, 0], out[e, 1] = force_n, std_n
            if n == 2 and force_n > 0.0:
                _learn(rows[e], mounts_n[FORCE_N, mounts[e, 0]], force_n, min(dt_s, MAX_STEP_S))
            if n == 2:
                out[e, 3] = _push_n(moved_mm, mounts[e, 0], mounts[e, 1])
        elif n_usable > 0:
            part = rows[e, SHARE] if only == mounts[e, 0] else 1.0 - rows[e, SHARE]
            force_n = mounts_n[FORCE_N, only] / part
            out[e] = force_n, sqrt((mounts_n[STD_N, only] / part) ** 2 + (SHARE_STD / part * force_n) ** 2), 1.0, 0.0


_combine: Any = compiled(
    _combine_all, "void(f8[:, ::1], i8[:, ::1], f8[::1], f8[:, ::1], b1[::1], f8, f8[:, ::1])", "numpy"
)
