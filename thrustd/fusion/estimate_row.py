"""What the filter says at one step, as the fields of an Estimate: its numbers, and the bits that say why."""

from math import isfinite, nan, sqrt
from typing import Any

import numba

from thrustd.compiled import compiled
from thrustd.fusion.dynamics import ENGINE, MOUNT, RATE, SCALE_FLOOR_N, SCALE_N, SHAPE, THRUST, ZERO, Matrix
from thrustd.fusion.gate import FAILED
from thrustd.fusion.settings import SETTINGS
from thrustd.types import Status

MOUNT_LOST, BROCHURE_LOST = int(Status.MOUNT_LOST), int(Status.BROCHURE_LOST)
MOUNT_REJECTED, BROCHURE_REJECTED = int(Status.MOUNT_REJECTED), int(Status.BROCHURE_REJECTED)
MOUNT_FAILED, BROCHURE_FAILED = int(Status.MOUNT_FAILED), int(Status.BROCHURE_FAILED)
MODEL_EXTRAPOLATING, DECK_EXTRAPOLATING = int(Status.MODEL_EXTRAPOLATING), int(Status.DECK_EXTRAPOLATING)
TRANSIENT, GAP, ONE_MOUNT = int(Status.TRANSIENT), int(Status.GAP), int(Status.ONE_MOUNT)
LOAD_FACTOR_STALE, ENGINE_OFF = int(Status.LOAD_FACTOR_STALE), int(Status.ENGINE_OFF)
CONVERGING = int(Status.CONVERGING)


@compiled
def _mount_bits(there: bool, used: bool, failed: float) -> int:
    """`there`: the mounts say something at this step, `used`: and it was believed."""
    status = MOUNT_FAILED if failed != 0.0 else 0
    if not there:
        return status | MOUNT_LOST
    return status if used else status | MOUNT_REJECTED


@compiled
def _brochure_bits(there: bool, rejected: bool, failed: float, off: bool) -> int:
    """`rejected`: the last reading was, a value that is repeated is not judged again. `off`: nobody asks the deck."""
    status = BROCHURE_FAILED if failed != 0.0 else 0
    if off:
        return status | ENGINE_OFF
    if not there:
        return status | BROCHURE_LOST
    return status | BROCHURE_REJECTED if rejected else status


def _row(
    x: Matrix, p: Matrix, sizes: Matrix, mount_gate: Matrix, brochure_gate: Matrix, settings: Any, engine: int,
    off: bool, last_nu_n: float, last_used: bool, mount_nu_n: float, mount_nis: float, mount_used: bool,
    nu_n: float, nis: float, used: bool, t_ns: int, mount_n: float, mount_std_n: float, brochure_n: float,
    brochure_std_n: float, n1_pct: float, n1_rate_pct_s: float, lag_n: float, age_s: float, push_n: float,
    load_share: float, mount_extrapolating: bool, deck_extrapolating: bool, transient: bool, gap: bool, one_mount: bool,
    load_factor_stale: bool, status: int,
) -> tuple[Any, ...]:  # fmt: skip
    """The fields of an Estimate.

    Of the filter: state, covariance, sizes, gates, settings, engine; engine off; the last reading of the brochure. Then
    the verdicts of this step on mounts and brochure, and the fields of FusionInputs. A measurement that was gated out
    while its route is believed says that one of both is wrong: the band holds what it says, too.
    """
    status |= MODEL_EXTRAPOLATING if mount_extrapolating else 0
    status |= DECK_EXTRAPOLATING if deck_extrapolating else 0
    status |= TRANSIENT if transient else 0
    status |= GAP if gap else 0
    status |= ONE_MOUNT if one_mount else 0
    status |= LOAD_FACTOR_STALE if load_factor_stale else 0
    status |= _mount_bits(isfinite(mount_n), mount_used, mount_gate[FAILED])
    rejected = isfinite(last_nu_n) and not last_used
    status |= _brochure_bits(isfinite(brochure_n), rejected, brochure_gate[FAILED], off)
    variance_n2 = p[THRUST, THRUST]
    if isfinite(mount_nu_n) and not mount_used and mount_gate[FAILED] == 0.0:
        variance_n2 += mount_nu_n**2
    if rejected and brochure_gate[FAILED] == 0.0:
        variance_n2 += last_nu_n**2
    status |= CONVERGING if p[THRUST, THRUST] > settings[0].converging_std_n ** 2 else 0
    both_nis = (mount_nis + nis) / 2 if mount_used and used else mount_nis if mount_used else nis if used else nan
    deviation = x[ENGINE, 0] + x[SHAPE, 0] / max(sizes[SCALE_N], SCALE_FLOOR_N)
    return (
        t_ns, engine, x[THRUST, 0], sqrt(variance_n2), x[RATE, 0], mount_n, mount_std_n, brochure_n,
        brochure_std_n, mount_nu_n, nu_n, both_nis, x[ZERO, 0] + x[MOUNT, 0], deviation, load_share, status,
        nis if used else nan,
    )  # fmt: skip


_F, _I, _B, _TABLE = numba.float64, numba.int64, numba.boolean, numba.float64[:, ::1]
_tuple = vars(numba.types)["Tuple"]  # untyped in the package
_MEMORY = _TABLE, _TABLE, _F[::1], _F[::1], _F[::1], numba.from_dtype(SETTINGS)[::1], _I
estimate_row: Any = compiled(
    _row,
    _tuple((_I, _I, *[_F] * 13, _I, _F))(
        *_MEMORY, _B, _F, _B, _F, _F, _B, _F, _F, _B, _I, *[_F] * 10, *[_B] * 6, _I
    ),
    "numpy",
)  # fmt: skip
