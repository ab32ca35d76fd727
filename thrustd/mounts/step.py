"""One mount's samples through its model, and their means with one sigma, as compiled code.

The mount's force is wrong by what its model is (the error map), and by what the bench could not show: the transducer's
zero, where the mount is stiffer the more so, the mount's own stiffness and its own friction:

    sigma^2 = map^2 + (k(d) zero)^2 + (stiffness F)^2 + friction^2 + (0.2 k (x(d) - x(z)))^2

k(d): slope of the model's curve at rest. x: how far outside the identified range, k there that at its end. z: where the
zero was found, because there the force is known: a mount that rests outside and was told zero there is right there, and
off by all that lies between once it is inside. Below its bench a mount that the engine's weight presses on is as on the
other side (`model.calibrated`), or as a tethered run has found it; that run says where the zero is known best, too.
"""

from math import exp, hypot, isfinite, isnan, nan, sqrt
from typing import Any, NamedTuple

import numba
import numpy as np

from thrustd.core.columns import MOUNT_STATE
from thrustd.core.jit import compiled, entry, named
from thrustd.model.artifact import FORCE_RATE_TAU_S
from thrustd.model.region_error import region_std_n
from thrustd.model.stage import CHAIN, Chain, Floats, run_chain
from thrustd.sync.memory import MOUNT

EXTRAPOLATION_STD = 0.2  # outside the identified range the local stiffness is trusted to 20 %
# and where it is that of the other side: secants of 53 loops of a measured rubber bearing differ between its sides by
# 6.1 % RMS (Gallardo et al., 10.1016/j.engstruct.2023.116234)
IN_SHEAR_STD = 0.061
HELD_TAU_S = 1.0
TERMS = "calibration_n", "zero_n", "stiffness_n", "friction_n", "beyond_n"  # of `core.types.Terms`
CHORDS = 8  # of the model's curve, over its range: shorter ones show the segments that it is made of

MEANS = np.dtype(
    [
        ("sum_mm", np.float64),  # over the samples since the last fused step
        ("sum_n", np.float64),
        ("count", np.int64),
        ("since_restart", np.int64),  # samples
        ("gap", np.int64),  # one was bridged or restarted after, since the last fused step
        ("lagged_n", np.float64),
        ("period_s", np.float64),
        ("stiffness_n_mm", np.float64, CHORDS),  # of the chords
        ("zero_std_mm", np.float64),
        ("stiffness_std", np.float64),
        ("friction_std_n", np.float64),
        ("low_mm", np.float64),  # of the identified range
        ("high_mm", np.float64),
        ("below_std", np.float64),  # of the stiffness below the identified range
        ("told_mm", np.float64),  # where its zero was found
    ]
)


@compiled
def _stiffness_n_mm(m: Any, deformation_mm: float) -> float:
    """Straight lines between the middles of the chords."""
    at = (deformation_mm - m.low_mm) / (m.high_mm - m.low_mm) * CHORDS - 0.5
    at = min(max(at, 0.0), CHORDS - 1.0)
    left = min(int(at), CHORDS - 2)
    return m.stiffness_n_mm[left] + (at - left) * (m.stiffness_n_mm[left + 1] - m.stiffness_n_mm[left])


@compiled
def terms_n(m: Any, model_n: float, deformation_mm: float, force_n: float) -> tuple[float, float, float, float, float]:
    """One sigma each, N, as TERMS names them; `model_n`: of the model."""
    k = _stiffness_n_mm(m, deformation_mm)
    below_mm = max(m.low_mm - deformation_mm, 0.0) - max(m.low_mm - m.told_mm, 0.0)
    above_mm = max(deformation_mm - m.high_mm, 0.0) - max(m.told_mm - m.high_mm, 0.0)
    below_n = m.below_std * m.stiffness_n_mm[0] * below_mm
    above_n = EXTRAPOLATION_STD * m.stiffness_n_mm[CHORDS - 1] * above_mm
    return model_n, k * m.zero_std_mm, m.stiffness_std * abs(force_n), m.friction_std_n, hypot(below_n, above_n)


@compiled
def _variance_n2(m: Any, model_n: float, deformation_mm: float, force_n: float) -> float:
    a, b, c, d, e = terms_n(m, model_n, deformation_mm, force_n)
    return a**2 + b**2 + c**2 + d**2 + e**2


class Samples(NamedTuple):
    """One mount's samples that wait, and the model they go through; always the same objects."""

    row: Any  # MOUNT (1,)
    means: Any  # MEANS (1,)
    u: Floats
    mm: Floats
    n: Floats  # room for what the model makes of them
    chain: Chain


class Held(NamedTuple):
    """What the model's channels are held at between readings."""

    channels: Floats
    lagged: Floats  # (2, n): a second's mean, and the last fused step's
    unmeasured_s: Floats  # NaN: it is measured


class Cells(NamedTuple):
    """The model's error map, for `region_std_n`."""

    force_edges_n: Floats
    rate_edges_n_s: Floats
    std_n: Floats


def _add_samples(samples: Samples, state: Floats) -> None:
    """The model over the samples that wait."""
    row, means, waiting_mm, waiting_n = samples.row, samples.means, samples.mm, samples.n
    m, n = means[0], row[0].waiting
    row[0].waiting = 0
    if n > 0:
        for i in range(n):  # no slices: see `_take` of fusion/thrust_step
            waiting_n[i] = waiting_mm[i]
        run_chain(samples.chain, state, samples.u[:n], waiting_n[:n])
    for i in range(n):
        m.sum_mm += waiting_mm[i]
        m.sum_n += waiting_n[i]
    m.count += n
    m.since_restart += n


def _fuse_samples(
    dt_s: float, samples: Samples, x: Floats, held: Held, doubts: Floats, cells: Cells, said: Any
) -> bool:
    """Writes a MOUNT_STATE; -> whether its common part is all of it."""
    add(samples, x)
    row, channels, lagged, unmeasured_s = samples.row, held.channels, held.lagged, held.unmeasured_s
    m, state, complete = samples.means[0], said[0], True
    state.extrapolating, state.gap = row[0].beyond != 0, m.gap != 0
    state.deformation_mm = state.force_n = state.std_n = state.common_n = nan
    row[0].beyond = m.gap = 0
    for i in range(len(channels)):
        lagged[0, i] += (1.0 - exp(-dt_s / HELD_TAU_S)) * (lagged[1, i] - lagged[0, i])
        lagged[1, i] = channels[i]
        unmeasured_s[i] += dt_s
        complete &= isnan(unmeasured_s[i])
    if m.count == 0:
        m.lagged_n = nan
        return True
    deformation_mm, force_n = m.sum_mm / m.count, m.sum_n / m.count
    m.sum_mm = m.sum_n = 0.0
    m.count = 0
    if not isfinite(m.lagged_n):
        m.lagged_n = force_n
    m.lagged_n += (1.0 - exp(-dt_s / FORCE_RATE_TAU_S)) * (force_n - m.lagged_n)
    rate_n_s = abs((force_n - m.lagged_n) / FORCE_RATE_TAU_S)
    model_n = region_std_n(cells.force_edges_n, cells.rate_edges_n_s, cells.std_n, force_n, rate_n_s)
    doubt_n = 0.0
    for i in range(len(doubts)):
        doubt_n += doubts[i, 0] * exp(-m.since_restart * m.period_s / doubts[i, 1])
    state.deformation_mm, state.force_n, state.common_n = deformation_mm, force_n, abs(doubt_n)
    state.std_n = hypot(sqrt(_variance_n2(m, model_n, deformation_mm, force_n)), doubt_n)
    state.extrapolating |= not m.low_mm <= deformation_mm <= m.high_mm
    return complete


_ROW, _TABLE = numba.float64[::1], numba.float64[:, ::1]
_RECORDS = numba.from_dtype(MOUNT)[::1], numba.from_dtype(MEANS)[::1]
_SAMPLES = named(Samples, *_RECORDS, _TABLE, _ROW, _ROW, CHAIN)
add: Any = compiled(_add_samples, numba.void(_SAMPLES, _ROW))
_HELD, _CELLS = named(Held, _ROW, _TABLE, _ROW), named(Cells, _ROW, _ROW, _TABLE)
_STATE = numba.from_dtype(MOUNT_STATE)[::1]
fuse: Any = entry(compiled(_fuse_samples, numba.boolean(numba.float64, _SAMPLES, _ROW, _HELD, _TABLE, _CELLS, _STATE)))
