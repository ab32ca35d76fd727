"""From the forces of single mounts to the force on the engine, with whichever mounts are believed.

both mounts    F = sum F_i,  share = F_upper / F
one mount      F = F_i / share_i,  share from the time when both were believed; one sigma of share widens the band
"""

from math import isfinite, nan, sqrt
from typing import NamedTuple

SHARE_FLOOR_N = 400.0  # below this total the share is noise
SHARE_TAU_S = 60.0  # slower still than a throttle movement; averages of what there was so far before that
SHARE_STD = 0.02  # of one mount's part, when scaled from the other


class EngineMounts(NamedTuple):
    """One engine's mount route at one step; NaN force = none is believed."""

    force_n: float
    std_n: float
    load_share: float  # upper mount's part, slow average, -
    one_mount: bool


class MountCombiner:
    """Keeps the slow load share of one engine. Starts from equal parts."""

    def __init__(self) -> None:
        self._share = 0.5
        self._age_s = 0.0

    @property
    def share(self) -> float:
        """The first (upper) mount's part of the engine's mount force, slow average, -."""
        return self._share

    def step(
        self, forces_n: tuple[float, ...], stds_n: tuple[float, ...], believed: tuple[bool, ...], dt_s: float
    ) -> EngineMounts:
        """`believed` per mount; forces that are not finite are not believed either."""
        usable = [i for i, force in enumerate(forces_n) if believed[i] and isfinite(force)]
        if len(usable) == len(forces_n) and len(forces_n) > 0:
            total = sum(forces_n)
            if len(forces_n) == 2 and total > SHARE_FLOOR_N:
                self._age_s = min(self._age_s + dt_s, SHARE_TAU_S)
                gain = min(dt_s / max(self._age_s, 1.0), 1.0)
                self._share += gain * (min(max(forces_n[0] / total, 0.2), 0.8) - self._share)
            # models of one rig share their errors: sigmas add, they do not average out
            return EngineMounts(total, sum(stds_n), self._share, False)
        if not usable:
            return EngineMounts(nan, nan, self._share, False)
        only = usable[0]
        part = self._share if only == 0 else 1.0 - self._share
        force = forces_n[only] / part
        std = sqrt((stds_n[only] / part) ** 2 + (SHARE_STD / part * force) ** 2)
        return EngineMounts(force, std, self._share, True)

    def snapshot(self) -> list[float]:
        return [self._share, self._age_s]

    def restore(self, state: list[float]) -> None:
        self._share, self._age_s = state
