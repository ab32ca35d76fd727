"""From the forces of single mounts to the force on the engine, with whichever mounts are believed.

both mounts    F = sum F_i,  share = sum F_upper F dt / sum F^2 dt      (least squares: F_upper = share F)
               sigma^2 = sum sigma_i^2 + (sum c_i)^2 - sum c_i^2        c_i: what both have to the same side
one mount      F = F_i / share_i,  share from the time when both were believed; one sigma of share widens the band

At idle the ratio F_upper / F says more of the transducers' zeros than of the share: least squares weigh it little.
"""

from math import hypot, isfinite, nan, sqrt
from typing import NamedTuple

UPPER_SHARE = 5079.0 / (5079.0 + 5954.0)  # fore and aft spring rates of the two isolators, thesis table 4.1
PRIOR_N2_S = 2000.0**2 * 5.0  # what the spring rates are worth: five seconds at 2 kN
MEMORY_N2_S = 5000.0**2 * 60.0  # a minute at 5 kN: slower than a throttle movement
MAX_STEP_S = 1.0
SHARE_STD = 0.02  # of one mount's part, when scaled from the other


class EngineMounts(NamedTuple):
    """One engine's mount route at one step; NaN force = none is believed."""

    force_n: float
    std_n: float
    load_share: float  # upper mount's part, slow average, -
    one_mount: bool


class MountCombiner:
    """Keeps the slow load share of one engine. Starts from the spring rates."""

    def __init__(self) -> None:
        self._share = UPPER_SHARE
        self._weight_n2_s = PRIOR_N2_S

    @property
    def share(self) -> float:
        """The first (upper) mount's part of the engine's mount force, slow average, -."""
        return self._share

    def step(
        self,
        forces_n: tuple[float, ...],
        stds_n: tuple[float, ...],
        commons_n: tuple[float, ...],
        believed: tuple[bool, ...],
        dt_s: float,
    ) -> EngineMounts:
        """All per mount; forces that are not finite are not believed either."""
        usable = [i for i, force in enumerate(forces_n) if believed[i] and isfinite(force)]
        if len(usable) == len(forces_n) and len(forces_n) > 0:
            total = sum(forces_n)
            if len(forces_n) == 2 and total > 0.0:
                self._learn(forces_n[0], total, min(dt_s, MAX_STEP_S))
            std = sqrt(hypot(*stds_n) ** 2 + sum(commons_n) ** 2 - hypot(*commons_n) ** 2)
            return EngineMounts(total, std, self._share, False)
        if not usable:
            return EngineMounts(nan, nan, self._share, False)
        only = usable[0]
        part = self._share if only == 0 else 1.0 - self._share
        force = forces_n[only] / part
        std = sqrt((stds_n[only] / part) ** 2 + (SHARE_STD / part * force) ** 2)
        return EngineMounts(force, std, self._share, True)

    def snapshot(self) -> list[float]:
        return [self._share, self._weight_n2_s]

    def restore(self, state: list[float]) -> None:
        self._share, self._weight_n2_s = state

    def _learn(self, upper_n: float, total_n: float, dt_s: float) -> None:
        news = total_n * total_n * dt_s
        self._weight_n2_s = min(self._weight_n2_s + news, MEMORY_N2_S)
        self._share += news / self._weight_n2_s * (min(max(upper_n / total_n, 0.2), 0.8) - self._share)
