"""Physical structures: springs and dashpots (thesis section 13.1), parameters estimated instead of tuned by hand.

maxwell              spring and dashpot in series: relaxes to no force at all
kelvin-voigt         spring and dashpot in parallel (the dashpot behind a 0.1 s lag, as no sensor gives a true rate)
zener                spring in parallel with one Maxwell branch (standard linear solid)
generalised-maxwell  cubic spring in parallel with three Maxwell branches (Prony series)

    F = F_0 + sum_k c_k u^k + sum_i E_i (u - s_i),    tau_i s_i' = u - s_i

A branch is a spring E_i in series with a dashpot E_i tau_i. Forces are linear in c and E, so only the logarithms of
tau are searched and the rest solved by linear least squares (variable projection, Golub & Pereyra 1973).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

from thrustd.core.columns import Floats
from thrustd.identify.regression.solve import Progress
from thrustd.identify.segments import Segment
from thrustd.identify.structures.block_fits import BlockFits
from thrustd.identify.structures.structure import Fitted, Structure, deformation
from thrustd.model.linear import discretise_mode

RATE_LAG_S = 0.1
ROWS = 60_000  # samples that count


@dataclass(frozen=True, slots=True)
class Branches:
    """Powers of the spring, time constants and coefficients (offset, powers, branches)."""

    powers: tuple[int, ...]
    tau_s: tuple[float, ...]
    coefficients: Floats

    def simulate(self, segment: Segment) -> Floats:
        force_n: Floats = _columns(segment, self.powers, self.tau_s) @ self.coefficients
        return force_n


def fit_branches(segments: Sequence[Segment], powers: tuple[int, ...], free: int, fixed: tuple[float, ...]) -> Branches:
    """Spring with these powers, `free` branches with time constants to find and some with `fixed` ones."""
    longest_s = max(len(s) * s.dt_s for s in segments)
    dt_s = min(s.dt_s for s in segments)
    stride = max(1, sum(map(len, segments)) // ROWS)
    target = np.concatenate([s.force_n[::stride] for s in segments])
    good = np.isfinite(target)
    start = np.log(np.geomspace(5 * dt_s, longest_s / 5, free + 2)[1:-1]) if free else np.empty(0)

    def solve(logs: Floats) -> tuple[Floats, Floats]:
        tau_s = (*np.exp(logs), *fixed)
        table = np.concatenate([_columns(s, powers, tau_s)[::stride] for s in segments])[good]
        size = np.maximum(np.linalg.norm(table, axis=0), 1e-300)
        coefficients = np.linalg.lstsq(table / size, target[good], rcond=1e-10)[0] / size
        return coefficients, table @ coefficients - target[good]

    if free:
        bounds = (np.log(dt_s), np.log(3 * longest_s))
        start = least_squares(lambda logs: solve(logs)[1], start, bounds=bounds, diff_step=1e-3, max_nfev=15).x
    return Branches(powers, (*map(float, np.exp(start)), *fixed), solve(start)[0])


def _columns(segment: Segment, powers: tuple[int, ...], tau_s: Sequence[float]) -> Floats:
    u = deformation(segment)
    branches = [u - _relaxed(u, tau, segment.dt_s) for tau in tau_s]
    return np.column_stack([np.ones(len(u)), *(u**k for k in powers), *branches])


def _relaxed(u: Floats, tau_s: float, dt_s: float) -> Floats:
    """tau s' = u - s for a ramp between samples, at rest at first (n,)."""
    a, b0, b1 = (float(np.real(value)) for value in discretise_mode(complex(-1 / tau_s), dt_s, "foh"))
    out, _ = lfilter([b1, b0], [1.0, -a], u, zi=[(1 - b1) * u[0]])
    return np.asarray(out, float)


def _structure(name: str, title: str, powers: tuple[int, ...], free: int, fixed: tuple[float, ...] = ()) -> Structure:
    def fit(segments: Sequence[Segment], fits: BlockFits, progress: Progress | None) -> Fitted:
        branches = fit_branches(segments, powers, free, fixed)
        return Fitted(1 + len(powers) + 2 * free + len(fixed), branches.simulate)

    return Structure(name, title, "physical", fit)


STRUCTURES = (
    _structure("maxwell", "Maxwell", (), 1),
    _structure("kelvin-voigt", "Kelvin-Voigt", (1,), 0, (RATE_LAG_S,)),
    _structure("zener", "standard linear solid (Zener)", (1,), 1),
    _structure("generalised-maxwell", "generalised Maxwell, nonlinear spring", (1, 2, 3), 3),
)
