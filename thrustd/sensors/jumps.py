"""What no thrust does: mounts that are moved further within one fused step than an engine's thrust can move.

    moved = F - F_before         by mount, N
    jumped += moved              where the transducer, too, moved by more than the engine's part of `fastest dt`
    could += clip(sum moved)     of both mounts: what the thrust may have moved by

Both are counted from one row of the past to the next. An acceleration that jumps moves forces and no transducer.
Of a sudden fault alone a row's jumps are one more reading (see `evidence`),

    d = pattern b + noise        noise: what a thrust moves within a step, or the fuel flow that it may follow
"""

from math import exp, isfinite, log
from typing import Any

import numba
import numpy as np

from thrustd.core.columns import MOUNT_STATE, Floats, Integers
from thrustd.core.jit import compiled, entry
from thrustd.sensors.errors import Parts
from thrustd.sensors.past import JUMPED_N, STEP_N

# idle to take-off thrust takes some 8 s; a cut is quicker than N1 is read
FASTEST_RISE_N_S, FASTEST_FALL_N_S = 2000.0, 8000.0
JUMPS = np.dtype(  # of one engine since its last row
    [
        ("force_n", np.float64, 2),  # of the upper and the lower mount at the last step
        ("deformation_mm", np.float64, 2),
        ("jumped_n", np.float64, 2),
        ("could_n", np.float64),
        ("step_n", np.float64),  # the thrust moves by no more within a fused step
    ]
)


def no_jumps(n_engines: int) -> Any:
    """(n_engines,) of JUMPS."""
    jumps = np.zeros(n_engines, JUMPS)
    jumps["force_n"] = jumps["deformation_mm"] = np.nan
    return jumps


@compiled
def forget(jump: Any) -> None:
    """A row has taken what there was."""
    jump.jumped_n[:], jump.could_n, jump.step_n = 0.0, 0.0, 0.0


def _follow_all(jumps: Any, mounts: Integers, shares: Floats, spring_n_mm: Floats, states: Any, dt_s: float) -> None:
    for e in range(len(jumps)):
        jump, moved_n = jumps[e], 0.0
        jump.step_n = max(jump.step_n, FASTEST_FALL_N_S * dt_s)
        for i in range(2):
            if mounts[e, i] < 0:
                continue
            state, part = states[mounts[e, i]], shares[e] if i == 0 else 1.0 - shares[e]
            force_n, read_n = state.force_n - jump.force_n[i], state.deformation_mm - jump.deformation_mm[i]
            moved_n += force_n
            if min(abs(force_n), spring_n_mm[i] * abs(read_n)) > part * FASTEST_FALL_N_S * dt_s:  # NaN is not
                jump.jumped_n[i] += force_n
            jump.force_n[i], jump.deformation_mm[i] = state.force_n, state.deformation_mm
        if isfinite(moved_n):
            jump.could_n += min(max(moved_n, -FASTEST_FALL_N_S * dt_s), FASTEST_RISE_N_S * dt_s)


_ROW = numba.float64[::1]
follow: Any = entry(
    compiled(
        _follow_all,
        numba.void(
            numba.from_dtype(JUMPS)[::1], numba.int64[:, ::1], _ROW, _ROW, numba.from_dtype(MOUNT_STATE)[::1],
            numba.float64,
        ),
        "numpy",
    )
)  # fmt: skip


@compiled
def shaken(row: Floats, parts: Parts, sizes_n: tuple[float, float], prior: float) -> float:
    """ln of how likely a row's jumps are when all is well and the aircraft may be shaken, over noise alone."""
    most, sum_ = log(1.0 - prior), 1.0
    for size_n in sizes_n:
        log_p = log(prior / 2.0)
        for i in range(2):
            std_n = max(parts[i] * row[STEP_N], 1.0)
            wide_n2 = std_n**2 + (parts[i] * size_n) ** 2
            log_p += log(std_n) - 0.5 * log(wide_n2) + 0.5 * row[JUMPED_N + i] ** 2 * (1.0 / std_n**2 - 1.0 / wide_n2)
        sum_ = sum_ * exp(min(most - log_p, 0.0)) + exp(min(log_p - most, 0.0))
        most = max(most, log_p)
    return most + log(sum_)


@compiled
def see_jump(
    row: Floats, parts: Parts, pattern: Floats, shape: Floats, m: int, q: Floats, g: Floats
) -> tuple[Floats, Floats]:
    """L' G L (m, m) and g (m,) with what the mounts jumped by at the onset, the oldest of m rows."""
    q, g = q[:m, :m].copy(), g[:m].copy()
    for i in range(2):
        weight = pattern[i] / max(parts[i] * row[STEP_N], 1.0) ** 2
        g[m - 1] += weight * row[JUMPED_N + i]
        for j in range(m):
            for k in range(m):
                q[j, k] += weight * pattern[i] * shape[m - 1, j] * shape[m - 1, k]
    return q, g
