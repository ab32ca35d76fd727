"""What no thrust does: mounts that are moved further within one fused step than an engine's thrust can move.

    moved = F - F_before         by mount, N
    jumped += moved              where the transducer, too, moved by more than the engine's part of `fastest dt`, up or
                                 down: a throttle that is opened is for a step as quick as one that is cut
    could += clip(sum moved)     of both mounts: what the thrust may have moved by, where the transducers moved, too; up
                                 by `leads dt` at most, because fuel and spools come before a thrust that rises

Both are counted from one row of the past to the next. An acceleration that jumps moves forces and no transducer.
Of a sudden fault alone a row's jumps are one more reading (see `evidence`),

    d = pattern b + parts t + noise        noise: what a thrust moves within a step, by mount
                                           t: 0 to what the fuel flow moved by besides, of both mounts
"""

from math import erfc, exp, hypot, isfinite, log, pi, sqrt
from typing import Any

import numba
import numpy as np

from thrustd.core.columns import MOUNT_STATE, Floats, Integers
from thrustd.core.jit import compiled, entry
from thrustd.sensors.errors import Parts
from thrustd.sensors.past import FOLLOWED_N, JUMPED_N, STEP_N, fuelled_n

# of a thrust within one step, up or down: recorded N1 raise it by 3.9 kN/s for 0.1 s, and mounts show 4.6 kN/s
FASTEST_N_S = 8000.0
LEADS_UP_N_S = 2000.0  # of one that nobody but the mounts has shown yet: idle to take-off takes some 8 s
LEAST_INSIDE = 1e-300
HALF = 0.5  # of a force, by nominal springs
JUMPS = np.dtype(  # of one engine since its last row
    [
        ("force_n", np.float64, 2),  # of the upper and the lower mount at the last step
        ("deformation_mm", np.float64, 2),
        ("jumped_n", np.float64, 2),
        ("could_n", np.float64),
        ("step_n", np.float64),  # a thrust that its fuel flow does not move moves by no more in the steps that jumped
        ("along_g", np.float64),  # what the accelerometer showed, summed over so many steps
        ("steps", np.float64),
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
    jump.jumped_n[:], jump.could_n, jump.step_n, jump.along_g, jump.steps = 0.0, 0.0, 0.0, 0.0, 0.0


def _follow_all(
    jumps: Any, mounts: Integers, shares: Floats, spring_n_mm: Floats, states: Any, dt_s: float, along_g: float
) -> None:
    for e in range(len(jumps)):
        jump, moved_n, shown_n, before = jumps[e], 0.0, 0.0, jumps[e].jumped_n.any()
        if isfinite(along_g):
            jump.along_g, jump.steps = jump.along_g + along_g, jump.steps + 1.0
        now = False
        jump.step_n = max(jump.step_n, FASTEST_N_S * dt_s)
        for i in range(2):
            if mounts[e, i] < 0:
                continue
            state, part = states[mounts[e, i]], shares[e] if i == 0 else 1.0 - shares[e]
            force_n, read_n = state.force_n - jump.force_n[i], state.deformation_mm - jump.deformation_mm[i]
            moved_n, shown_n = moved_n + force_n, shown_n + spring_n_mm[i] * read_n
            undone = jump.jumped_n[i] * force_n < 0.0  # by an acceleration that is read later than the mounts
            moved_both_n = abs(force_n) if undone else min(abs(force_n), spring_n_mm[i] * abs(read_n))
            if moved_both_n > part * FASTEST_N_S * dt_s:  # NaN is not
                jump.jumped_n[i] += force_n
                now = True
            jump.force_n[i], jump.deformation_mm[i] = state.force_n, state.deformation_mm
        if now and before:  # a thrust may have moved by as much in each of them
            jump.step_n = hypot(jump.step_n, FASTEST_N_S * dt_s)
        if moved_n * shown_n > 0.0 and abs(shown_n) > HALF * abs(moved_n):  # NaN is not
            jump.could_n += min(max(moved_n, -FASTEST_N_S * dt_s), LEADS_UP_N_S * dt_s)


_ROW = numba.float64[::1]
follow: Any = entry(
    compiled(
        _follow_all,
        numba.void(
            numba.from_dtype(JUMPS)[::1], numba.int64[:, ::1], _ROW, _ROW, numba.from_dtype(MOUNT_STATE)[::1],
            numba.float64, numba.float64,
        ),
        "numpy",
    )
)  # fmt: skip


@compiled
def _noise(rows: Floats, m: int, parts: Parts) -> tuple[float, float, float, float]:
    """Of the jumps of row m - 1 when no mount failed: variances of the two mounts, and mean and variance of a thrust's.

    A thrust that jumps moves both mounts by their parts, and is made of fuel: by 0 to what its flow moved then, or one
    row earlier or later, and no mount showed: any part of it is as likely. Where the mounts moved further than the flow
    there is nothing left of it.
    """
    own_n, now_n, then_n = rows[m - 1, STEP_N], fuelled_n(rows, m), rows[m - 1, FOLLOWED_N]
    moved_n = now_n if abs(now_n) > abs(then_n) else then_n
    one_n2, other_n2 = max(parts[0] * own_n, 1.0) ** 2, max(parts[1] * own_n, 1.0) ** 2
    return one_n2, other_n2, moved_n / 2.0, moved_n**2 / 12.0


@compiled
def _inverse(one_n2: float, other_n2: float, thrust_n2: float, parts: Parts) -> tuple[float, float, float, float]:
    """Of [[one + p p t, p q t], [p q t, other + q q t]]: its three numbers, and the determinant."""
    p, q = parts[0], parts[1]
    a, b, c = one_n2 + p * p * thrust_n2, p * q * thrust_n2, other_n2 + q * q * thrust_n2
    det = a * c - b * b
    return c / det, -b / det, a / det, det


@compiled
def _beyond(sigmas: float) -> float:
    """Of a Gaussian's one side."""
    return 0.5 * erfc(sigmas / sqrt(2.0))


@compiled
def _log_fuelled(noise: tuple[float, float, float, float], jumped_n: tuple[float, float], parts: Parts) -> float:
    """ln of how likely these jumps are of a thrust from 0 to what its fuel flow moved, over a Gaussian of that spread.

    A fuel flow that rises lets no thrust fall, whatever it rises by.
    """
    one_n2, other_n2, mean_n, thrust_n2 = noise
    most_n, per_n2 = abs(2.0 * mean_n), parts[0] ** 2 / one_n2 + parts[1] ** 2 / other_n2
    std_n = 1.0 / sqrt(per_n2)
    if most_n < 1e-3 * std_n:
        return 0.0
    way = 1.0 if mean_n > 0.0 else -1.0
    thrust_n = way * (parts[0] * jumped_n[0] / one_n2 + parts[1] * jumped_n[1] / other_n2) / per_n2
    out_n = max(-thrust_n, thrust_n - most_n)  # below 0: inside
    inside = _beyond(out_n / std_n) - _beyond((out_n + most_n) / std_n)
    wide_n2 = std_n**2 + thrust_n2
    flat = sqrt(2.0 * pi * wide_n2) / most_n * max(inside, LEAST_INSIDE)
    return log(flat) + 0.5 * (thrust_n - 0.5 * most_n) ** 2 / wide_n2


@compiled
def _log_back(rows: Floats, m: int, noise_n2: tuple[float, float]) -> float:
    """ln of how likely the jumps of the row after m - 1 are if they undo its own, over noise alone."""
    log_p = 0.0
    for i in range(2):
        after_n, both_n = rows[m - 2, JUMPED_N + i], rows[m - 1, JUMPED_N + i] + rows[m - 2, JUMPED_N + i]
        log_p += 0.5 * (after_n**2 - 0.5 * both_n**2) / noise_n2[i] - 0.5 * log(2.0)
    return log_p


@compiled
def shaken(rows: Floats, m: int, parts: Parts, sizes_n: tuple[float, float], prior: float) -> float:
    """ln of how likely the jumps of row m - 1 are when all is well and the aircraft may be shaken, over noise alone.

    What was shaken is back by the next row: its jumps are the opposite ones.
    """
    noise = _noise(rows, m, parts)
    one_n2, other_n2, mean_n, thrust_n2 = noise
    x, y = rows[m - 1, JUMPED_N] - parts[0] * mean_n, rows[m - 1, JUMPED_N + 1] - parts[1] * mean_n
    u, v, w, det = _inverse(one_n2, other_n2, thrust_n2, parts)
    most, sum_, far = log(1.0 - prior), 1.0, u * x * x + 2.0 * v * x * y + w * y * y
    back = _log_back(rows, m, (one_n2, other_n2)) if m > 1 else 0.0
    most += _log_fuelled(noise, (rows[m - 1, JUMPED_N], rows[m - 1, JUMPED_N + 1]), parts)
    for size_n in sizes_n:
        more = (parts[0] * size_n) ** 2, (parts[1] * size_n) ** 2
        u, v, w, wide = _inverse(one_n2 + more[0], other_n2 + more[1], thrust_n2, parts)
        log_p = log(prior / 2.0) + back + 0.5 * (log(det / wide) + far - (u * x * x + 2.0 * v * x * y + w * y * y))
        sum_ = sum_ * exp(min(most - log_p, 0.0)) + exp(min(log_p - most, 0.0))
        most = max(most, log_p)
    return most + log(sum_)


@compiled
def see_jump(rows: Floats, parts: Parts, pattern: Floats, m: int) -> tuple[float, float]:
    """What the mounts jumped by at the onset, the oldest of m rows, as `more` and `more_g` of `onsets.answer`."""
    one_n2, other_n2, mean_n, thrust_n2 = _noise(rows, m, parts)
    u, v, w, _ = _inverse(one_n2, other_n2, thrust_n2, parts)
    x, y = rows[m - 1, JUMPED_N] - parts[0] * mean_n, rows[m - 1, JUMPED_N + 1] - parts[1] * mean_n
    a, b = pattern[0] * u + pattern[1] * v, pattern[0] * v + pattern[1] * w
    return a * pattern[0] + b * pattern[1], a * x + b * y
