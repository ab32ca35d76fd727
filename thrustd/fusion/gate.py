"""Chi-square gate with memory: one odd measurement is left out, a route that stays odd is declared failed.

    nu = y - H x,   S = H P H^T + R     innovation of a scalar measurement and its predicted variance

accepted  if  nu^2 / S <= gate
failed    once the time spent outside exceeds the time spent inside by `fail_after_s`
recovered once the innovation has stayed inside the gate for `recover_after_s`
"""

from math import isfinite, nan
from typing import Any, NamedTuple

import numba
import numpy as np
import numpy.typing as npt

from thrustd.compiled import compiled
from thrustd.fusion.settings import SETTINGS, FusionSettings

MOVING_PCT_S = 0.5  # N1 of a throttle that rests stays within 0.3 %/s
PUSHED = 2.0  # rubber is stiffer than its spring rate, and lags
MAX_STEP_S = 1.0  # a long silence says nothing about agreement
OUTSIDE_S, INSIDE_S, FAILED = range(3)  # the memory of one route
Floats = npt.NDArray[np.float64]


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


def agree_on_a_move(mount: Verdict, brochure: Verdict, n1_rate_pct_s: float, n_per_pct: float, push_n: float) -> bool:
    """Mounts gated out, and brochure too or N1 itself goes to the same side: the thrust moved, no sensor lies.

    The deck lags what a throttle that is cut does to the mounts, so its own innovation may stay inside. N1 speaks for
    no more than it moves the thrust by, `n_per_pct`, in a second; a tenth of a second before it, both mounts were
    pushed by `push_n`.
    """
    if mount.used:
        return False
    if mount.innovation_n * push_n > 0.0 and abs(mount.innovation_n) < PUSHED * abs(push_n):
        return True
    both = not brochure.used and mount.innovation_n * brochure.innovation_n > 0.0
    if abs(n1_rate_pct_s) > MOVING_PCT_S and mount.innovation_n * n1_rate_pct_s > 0.0:
        return both or abs(mount.innovation_n) < abs(n1_rate_pct_s) * n_per_pct
    return both


class Gate:
    """The memory of one route. Mutable."""

    __slots__ = ("_settings", "row")

    def __init__(self, settings: Any) -> None:
        """`settings`: see `settings_row`."""
        self._settings = settings
        self.row = np.zeros(3)  # for the checkpoint, too

    @property
    def failed(self) -> bool:
        """Odd for so long that it is not believed."""
        return self.row.item(FAILED) != 0.0

    def judge(self, y: float, h: Floats, r: float, doubt: float, dt_s: float, x: Floats, p: Floats) -> Verdict:
        """A measurement y = h x + v, h (1, n), of variance r, of a state x (n, 1) with covariance p (n, n).

        `doubt`: variance by which the gate opens; `dt_s`: since the last one of this route.
        """
        verdict: Verdict = tuple.__new__(Verdict, _judge(self.row, self._settings, y, h, r, doubt, dt_s, x, p))
        return verdict


def _weigh(
    row: Floats, settings: Any, y: float, h: Floats, r: float, doubt: float, dt_s: float, x: Floats, p: Floats
) -> tuple[float, float, bool]:
    s, expected, spread = settings[0], 0.0, 0.0
    for i in range(len(x)):
        expected += h[0, i] * x[i, 0]
        for j in range(len(x)):
            spread += h[0, i] * p[i, j] * h[0, j]
    nu, variance = y - expected, spread + r
    dt_s = min(max(dt_s, 0.0), MAX_STEP_S)
    inside = isfinite(nu) and nu * nu <= s.gate_chi2 * (variance + doubt)
    row[OUTSIDE_S] = max(row[OUTSIDE_S] - dt_s, 0.0) if inside else row[OUTSIDE_S] + dt_s
    row[INSIDE_S] = row[INSIDE_S] + dt_s if inside else 0.0
    if row[FAILED] == 0.0 and row[OUTSIDE_S] >= s.fail_after_s:
        row[FAILED], row[INSIDE_S] = 1.0, 0.0
    elif row[FAILED] != 0.0 and row[INSIDE_S] >= s.recover_after_s:
        row[FAILED] = row[OUTSIDE_S] = 0.0
    return nu, nu * nu / variance, inside and row[FAILED] == 0.0


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


_F, _TABLE = numba.float64, numba.float64[:, ::1]
_VERDICT = vars(numba.types)["Tuple"]((_F, _F, numba.boolean))  # untyped in the package
_judge: Any = compiled(
    _weigh, _VERDICT(_F[::1], numba.from_dtype(SETTINGS)[::1], _F, _TABLE, _F, _F, _F, _TABLE, _TABLE), "numpy"
)
