"""From the forces of single mounts to the force on the engine, with whichever mounts are trusted.

both mounts    F = sum F_i,  share = sum F_upper F dt / sum F^2 dt      (least squares: F_upper = share F)
               sigma^2 = sum sigma_i^2 + (sum c_i)^2 - sum c_i^2        c_i: what both have to the same side
one mount      F = F_i / share_i,  share from the time when both were trusted; one sigma of share widens the band,
               and of the couple by which the weight presses one mount and lifts the other. The same where the other
               one has no transducer: its share is then what the aircraft's file says

push           p = (k_upper + k_lower) d,  d: the smaller of what both moved to the same side within half a second, mm

A push is seen by the transducers themselves: one that lies has the other against it, an acceleration that lies moves
none. At idle F_upper / F says more of the transducers' zeros than of the share: least squares weigh it little, beside
what the models say: a minute at 5 kN.
"""

from collections.abc import Mapping, Sequence
from math import hypot, isfinite, nan, sqrt
from typing import Any, NamedTuple

import numba
import numpy as np

from thrustd.core.aircraft import NO_MOUNT, UNKNOWN
from thrustd.core.columns import MOUNT_STATE, Flags, Floats, Integers
from thrustd.core.jit import compiled, entry, named

MEMORY_N2_S = 5000.0**2 * 60.0  # a minute at 5 kN; idle says more of the transducers' zeros
MAX_STEP_S = 1.0
SHARE, WEIGHT_N2_S = range(2)  # the memory of one engine
PUSH_TAU_S = 0.5
SHARE_TERM = "share_n"  # of `core.types.Terms`

ENGINE_MOUNTS = np.dtype(  # one engine's mount source at one step
    [
        ("force_n", np.float64),  # NaN: no mount is trusted
        ("std_n", np.float64),
        ("load_share", np.float64),  # upper mount's part, slow average, -
        ("push_n", np.float64),  # what both mounts were moved by within half a second; 0: they do not say the same
        ("only", np.int64),  # the mount that is used alone, or NO_MOUNT
        ("one_mount", np.bool_),
    ],
    align=True,
)


class _Work(NamedTuple):
    rows: Floats  # (n_engines, 2) SHARE, WEIGHT_N2_S
    mounts_of: Integers  # (n_engines, 2) see `Layout.places`
    n_held: int  # mounts that carry an engine, with a transducer or without
    lagged_mm: Floats  # (n_mounts,)
    stiffness_n_mm: float  # of an engine's mounts together
    share_std: float  # of one mount's part, when scaled from the other
    couple_n_g: float  # of what the weight does to one of both, one sigma, per g beyond 1
    out: Any  # (n_engines,) ENGINE_MOUNTS


class MountCombiner:
    """Keeps the slow load share of every engine."""

    def __init__(
        self,
        places: Sequence[Sequence[int]],
        spring_n_mm: Sequence[float],
        shares: Sequence[float] = (),
        share_std: float = UNKNOWN.share,
        couple_n_g: float = 0.0,
    ) -> None:
        """`places`: see `Layout`; spring rates of an engine's mounts; shares of the first to start from, or they say.

        `share_std`, `couple_n_g`: see `core.aircraft.Installed`.
        """
        stiffness_n_mm = sum(spring_n_mm)
        self.rows = np.tile((spring_n_mm[0] / stiffness_n_mm, MEMORY_N2_S), (len(places), 1))
        if shares:
            self.rows[:, SHARE] = shares
        self.shares = self.rows[:, SHARE].copy()  # before anything was learnt of them
        self.mounts = np.array(places)
        lagged_mm = np.full(1 + self.mounts.max(), nan)
        self._out = np.zeros(len(places), ENGINE_MOUNTS)
        at = self.rows, self.mounts, len(spring_n_mm), lagged_mm
        self._work = _Work(*at, stiffness_n_mm, share_std, couple_n_g, self._out)
        self._more_g = 0.0

    def step(self, mounts: Any, trusted: Flags, dt_s: float, load_g: float = 1.0) -> Any:
        """ENGINE_MOUNTS by engine, good until the next step.

        `mounts`: MOUNT_STATE by mount; `trusted` (n_mounts,); forces that are not finite are excluded, too; `load_g`:
        load factor.
        """
        self._more_g = load_g - 1.0 if isfinite(load_g) else 0.0
        _combine(self._work, mounts, trusted, dt_s, self._more_g)
        return self._out

    def terms_n(self, engine: int, of_mounts: Sequence[Mapping[str, float]], common: str) -> dict[str, float]:
        """Terms of an engine's `std_n` at the last step from those of its mounts, N; `common`: to the same side in all.

        NaN: no mount is trusted.
        """
        said = self._out[engine]
        if not isfinite(said["force_n"]):
            return dict.fromkeys((*of_mounts[0], SHARE_TERM), nan)
        if said["one_mount"]:
            places = self.mounts[engine].tolist()
            part = said["load_share"] if said["only"] == places[0] else 1.0 - said["load_share"]
            mine = of_mounts[[i for i in places if i != NO_MOUNT].index(said["only"])]
            found = {name: float(value / part) for name, value in mine.items()}
            one_sided_n = hypot(self._work.share_std * said["force_n"], self._work.couple_n_g * self._more_g)
            return found | {SHARE_TERM: float(one_sided_n / part)}
        found = {name: sqrt(sum(each[name] ** 2 for each in of_mounts)) for name in of_mounts[0]}
        return found | {common: sum(each[common] for each in of_mounts), SHARE_TERM: 0.0}  # a sum needs no share

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
def _both(mounts: Any, mine: Any) -> tuple[float, float]:
    """Force and one sigma of all mounts of an engine together."""
    force_n = variance_n2 = common_n = common_n2 = 0.0
    for i in mine:
        force_n += mounts[i].force_n
        variance_n2 += mounts[i].std_n ** 2
        common_n += mounts[i].common_n
        common_n2 += mounts[i].common_n ** 2
    return force_n, sqrt(variance_n2 + common_n**2 - common_n2)


@compiled
def _push_n(stiffness_n_mm: float, moved_mm: Floats, upper: int, lower: int) -> float:
    """NaN is no movement."""
    both = moved_mm[upper] * moved_mm[lower] > 0.0
    smaller = upper if abs(moved_mm[upper]) < abs(moved_mm[lower]) else lower
    return stiffness_n_mm * moved_mm[smaller] if both else 0.0


def _combine_all(work: _Work, mounts: Any, trusted: Any, dt_s: float, more_g: float) -> None:
    rows, mounts_of, n_held, lagged_mm, stiffness_n_mm, share_std, couple_n_g, out = work
    moved_mm = np.empty(len(lagged_mm))
    for i in range(len(lagged_mm)):
        measured_mm = mounts[i].deformation_mm
        moved_mm[i] = measured_mm - lagged_mm[i]
        known = isfinite(moved_mm[i])
        lagged_mm[i] = lagged_mm[i] + min(dt_s / PUSH_TAU_S, 1.0) * moved_mm[i] if known else measured_mm
    for e in range(len(rows)):
        n_usable = 0
        only = NO_MOUNT
        for i in mounts_of[e]:
            if i != NO_MOUNT and trusted[i] and isfinite(mounts[i].force_n):
                n_usable += 1
                only = i if only == NO_MOUNT else only
        engine, upper, lower = out[e], mounts_of[e, 0], mounts_of[e, 1]
        engine.force_n = engine.std_n = nan
        engine.one_mount, engine.only, engine.push_n = False, NO_MOUNT, 0.0
        if n_usable == n_held:
            engine.force_n, engine.std_n = _both(mounts, mounts_of[e, :n_held])
            if n_held == 2 and engine.force_n > 0.0:
                _learn(rows[e], mounts[upper].force_n, engine.force_n, min(dt_s, MAX_STEP_S))
            if n_held == 2:
                engine.push_n = _push_n(stiffness_n_mm, moved_mm, upper, lower)
        elif n_usable > 0:
            part = rows[e, SHARE] if only == upper else 1.0 - rows[e, SHARE]
            force_n = mounts[only].force_n / part
            engine.force_n, engine.one_mount, engine.only = force_n, True, only
            of_one_n2 = mounts[only].std_n ** 2 + (share_std * force_n) ** 2 + (couple_n_g * more_g) ** 2
            engine.std_n = sqrt(of_one_n2) / part
        engine.load_share = rows[e, SHARE]


_TABLE, _ROW = numba.float64[:, ::1], numba.float64[::1]
_OUT = numba.from_dtype(ENGINE_MOUNTS)[::1]
_WORK = named(_Work, _TABLE, numba.int64[:, ::1], numba.int64, _ROW, *[numba.float64] * 3, _OUT)
_TOLD = numba.from_dtype(MOUNT_STATE)[::1], numba.boolean[::1], numba.float64, numba.float64
_combine: Any = entry(compiled(_combine_all, numba.void(_WORK, *_TOLD), "numpy"))
