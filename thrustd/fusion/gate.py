"""Chi-square gate with memory: one odd measurement is left out, a route that stays odd is declared failed.

accepted  if  nu^2 / S <= gate,      nu = innovation, S = its predicted variance
failed    once the time spent outside exceeds the time spent inside by `fail_after_s`
recovered once the innovation has stayed inside the gate for `recover_after_s`
"""

from dataclasses import dataclass
from math import isfinite, nan
from typing import NamedTuple

from thrustd.fusion.settings import FusionSettings

MOVING_PCT_S = 0.5  # N1 of a throttle that rests stays within 0.3 %/s
MAX_STEP_S = 1.0  # a long silence says nothing about agreement


class Verdict(NamedTuple):
    """What became of one measurement."""

    innovation_n: float = nan
    nis: float = nan
    used: bool = False

    @property
    def odd(self) -> bool:
        """There, and gated out."""
        return not self.used and isfinite(self.innovation_n)


NOTHING = Verdict()


def agree_on_a_move(mount: Verdict, brochure: Verdict, n1_rate_pct_s: float, n_per_pct: float) -> bool:
    """Mount gated out, and brochure too or N1 itself goes to the same side: the thrust moved, no sensor lies.

    The deck lags what a throttle that is cut does to the mounts, so its own innovation may stay inside. N1 speaks for
    no more than it moves the thrust by, `n_per_pct`, in a second.
    """
    if mount.used:
        return False
    both = not brochure.used and mount.innovation_n * brochure.innovation_n > 0.0
    if abs(n1_rate_pct_s) > MOVING_PCT_S and mount.innovation_n * n1_rate_pct_s > 0.0:
        return both or abs(mount.innovation_n) < abs(n1_rate_pct_s) * n_per_pct
    return both


@dataclass(slots=True)
class Gate:
    """The memory of one route."""

    gate_chi2: float
    fail_after_s: float
    recover_after_s: float
    outside_s: float = 0.0
    inside_s: float = 0.0
    failed: bool = False

    def judge(self, innovation: float, variance: float, dt_s: float) -> bool:
        """True when the measurement may be used; innovation and variance in the measurement's unit."""
        dt_s = min(max(dt_s, 0.0), MAX_STEP_S)
        inside = isfinite(innovation) and innovation * innovation <= self.gate_chi2 * variance
        self.outside_s = max(self.outside_s - dt_s, 0.0) if inside else self.outside_s + dt_s
        self.inside_s = self.inside_s + dt_s if inside else 0.0
        if not self.failed and self.outside_s >= self.fail_after_s:
            self.failed, self.inside_s = True, 0.0
        elif self.failed and self.inside_s >= self.recover_after_s:
            self.failed, self.outside_s = False, 0.0
        return inside and not self.failed

    def state(self) -> list[float]:
        """For the checkpoint."""
        return [self.outside_s, self.inside_s, float(self.failed)]

    def load(self, state: list[float]) -> None:
        """From the checkpoint."""
        self.outside_s, self.inside_s, self.failed = state[0], state[1], bool(state[2])


def surprise_n_s(settings: FusionSettings, *routes: tuple[Verdict, Gate]) -> float:
    """Rate that the thrust may have had, N/s, when a measurement was gated out that is not given up yet.

    When nobody else holds the thrust where it was, the thrust moved: before N1, read ten times a second, says so.
    When the other route holds it, a sensor lies and its gate stays shut.
    """
    odd = [gate for verdict, gate in routes if verdict.odd]
    if not odd:
        return 0.0
    if not any([verdict.used for verdict, _ in routes]):
        return settings.agreed_surprise_rate_n_s
    return 0.0 if odd[0].failed else settings.surprise_rate_n_s
