"""What the filter says at one step, as the fields of an Estimate: its numbers, and the bits that say why."""

from math import isfinite, nan, sqrt
from typing import Any

import numba

from thrustd.core.columns import Floats
from thrustd.core.jit import compiled, entry, named
from thrustd.core.measures import SIGMAS_95
from thrustd.core.types import Status
from thrustd.fusion.dynamics import ENGINE, MOUNT, RATE, SCALE_FLOOR_N, SCALE_N, SHAPE, THRUST
from thrustd.fusion.fusion_inputs import INPUTS
from thrustd.fusion.mixture import Weighed, mix
from thrustd.fusion.thrust_step import FILTER

MOUNT_LOST, BROCHURE_LOST = int(Status.MOUNT_LOST), int(Status.BROCHURE_LOST)
MOUNT_REJECTED, BROCHURE_REJECTED = int(Status.MOUNT_REJECTED), int(Status.BROCHURE_REJECTED)
MODEL_EXTRAPOLATING, DECK_EXTRAPOLATING = int(Status.MODEL_EXTRAPOLATING), int(Status.DECK_EXTRAPOLATING)
TRANSIENT, GAP, ONE_MOUNT = int(Status.TRANSIENT), int(Status.GAP), int(Status.ONE_MOUNT)
LOAD_FACTOR_STALE, ENGINE_OFF = int(Status.LOAD_FACTOR_STALE), int(Status.ENGINE_OFF)
CONVERGING, DISAGREE = int(Status.CONVERGING), int(Status.DISAGREE)


@compiled
def _mount_bits(there: bool, used: bool) -> int:
    """`there`: the mounts say something at this step, `used`: and it was trusted."""
    if not there:
        return MOUNT_LOST
    return 0 if used else MOUNT_REJECTED


@compiled
def _brochure_bits(there: bool, rejected: bool, off: bool) -> int:
    """`rejected`: the last reading was, a value that is repeated is not judged again. `off`: nobody asks the deck."""
    if off:
        return ENGINE_OFF
    if not there:
        return BROCHURE_LOST
    return BROCHURE_REJECTED if rejected else 0


@compiled
def _apart_n(m: Any, thrust_n: float, lead_n: float) -> float:
    """What the bank says of the thrust, less the filter's; as it was when the bank, which looks less often, said it."""
    if not isfinite(lead_n):
        m.apart_n = 0.0
    elif lead_n != m.lead_n:
        m.apart_n = lead_n - thrust_n
    m.lead_n = lead_n
    return float(m.apart_n)


def _row(memory: Any, told: Any, x: Floats, p: Floats, engine: int, weighed: Weighed) -> tuple[Any, ...]:
    """The fields of an Estimate: the filter's, mixed with what other hypotheses say (see `mixture`).

    A measurement that was gated out while its source is trusted says that one of both is wrong: the band holds what
    it says, too; so it does an engine that is off where all but the mounts say so, and what nobody corrected (see
    `sensors.evidence`).
    """
    m, t = memory[0], told[0]
    status = t.status
    status |= MODEL_EXTRAPOLATING if t.mount_extrapolating else 0
    status |= DECK_EXTRAPOLATING if t.brochure_extrapolating else 0
    status |= TRANSIENT if t.transient else 0
    status |= GAP if t.gap else 0
    status |= ONE_MOUNT if t.one_mount else 0
    status |= LOAD_FACTOR_STALE if t.load_factor_stale else 0
    status |= _mount_bits(isfinite(t.mount_n), m.mount_used)
    rejected = isfinite(m.last_nu_n) and not m.last_used
    status |= _brochure_bits(isfinite(t.brochure_n), rejected, m.off)
    status |= DISAGREE if m.contradicted else 0
    variance_n2 = p[THRUST, THRUST] + m.beyond_n2
    if m.contradicted:
        variance_n2 += ((x[THRUST, 0] - t.off_n) / SIGMAS_95) ** 2
    if isfinite(m.mount_nu_n) and not m.mount_used:
        variance_n2 += m.mount_nu_n**2
    if rejected:
        variance_n2 += m.last_nu_n**2
    status |= 0 if m.found else CONVERGING
    nis = m.mount_nis if m.mount_used else m.nis if m.used else nan
    if m.mount_used and m.used:
        nis = (m.mount_nis + m.nis) / 2
    deviation = x[ENGINE, 0] + x[SHAPE, 0] / max(m.sizes[SCALE_N], SCALE_FLOOR_N)
    apart_n = _apart_n(m, x[THRUST, 0], weighed.lead_n)
    thrust_n, std_n = mix(x[THRUST, 0], sqrt(variance_n2), weighed, m.off, apart_n)
    return (
        t.t_ns, engine, thrust_n, std_n, x[RATE, 0], t.mount_n, t.mount_std_n, t.brochure_n,
        t.brochure_std_n, m.mount_nu_n, m.nu_n, nis, x[MOUNT, 0], deviation, t.load_share, status,
        m.nis if m.used else nan,
    )  # fmt: skip


_F, _I, _TABLE = numba.float64, numba.int64, numba.float64[:, ::1]
_RECORDS = numba.from_dtype(FILTER)[::1], numba.from_dtype(INPUTS)[::1]
_ESTIMATE = vars(numba.types)["Tuple"]((_I, _I, *[_F] * 13, _I, _F))  # untyped in the package
_SIGNATURE = _ESTIMATE(*_RECORDS, _TABLE, _TABLE, _I, named(Weighed, _TABLE, _I, _F, numba.float64[::1], _F))
estimate_row: Any = entry(compiled(_row, _SIGNATURE, "numpy"))
