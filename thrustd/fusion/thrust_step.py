"""One step of a thrust filter as compiled code.

    predict -> [zero] -> mounts -> brochure -> [both moved: mounts, brochure again]

Every measurement is weighed, then taken or left. What that decides is said in `thrust_filter`, the equations of the
filter in `kalman`.
"""

from math import hypot, isfinite, nan, sqrt
from typing import Any

import numba
import numpy as np

from thrustd.core.columns import Floats
from thrustd.core.jit import compiled, entry
from thrustd.fusion.dynamics import (
    ENGINE,
    MOUNT,
    MOUNT_N2,
    N_STATE,
    RATE,
    SCALE_N,
    SHAPE,
    SHAPE_N2,
    THRUST,
    move,
)
from thrustd.fusion.fusion_inputs import INPUTS, silence
from thrustd.fusion.gate import agree_on_a_move, judge, surprise_n_s
from thrustd.fusion.kalman import predict, update
from thrustd.fusion.settings import SETTINGS

PAUSE_S = 1.0  # a restart, frames that were shed: nobody saw whether the throttle moved
MAX_STEP_S = 10.0  # longer silences are predicted as this long: the band is as wide as it gets by then
OFF_DOUBT_N = 150.0
STILL_TO_COME = 2.0  # of a move that began within the step that a mean is taken over
NEVER_NS = -1
BOUND = 3.0  # of its prior sigma: an error is no larger

FILTER = np.dtype(
    [
        ("f", np.float64, (N_STATE, N_STATE)),  # as in `kalman`
        ("q", np.float64, (N_STATE, N_STATE)),
        ("h", np.float64, (1, N_STATE)),
        ("r", np.float64),
        ("gain", np.float64, N_STATE),
        ("work", np.float64, (2, N_STATE, N_STATE)),
        ("sizes", np.float64, 3),  # of the slow errors: see `dynamics`
        ("t_ns", np.int64),  # of the last step
        ("read_ns", np.int64),  # of the last brochure reading used
        ("dt_s", np.float64),
        ("off_s", np.float64),
        ("surprise_n_s", np.float64),
        ("mount_age_s", np.float64),
        ("step_n", np.float64),  # one sigma of what no N1 spoke of yet, over the step that a mean is taken over
        ("moved_n", np.float64),  # a movement that both sources agree on
        ("z", np.float64),
        ("mount_nu_n", np.float64),  # verdicts of this step
        ("mount_nis", np.float64),
        ("nu_n", np.float64),
        ("nis", np.float64),
        ("last_nu_n", np.float64),  # of the last brochure reading
        ("mount_used", np.bool_),
        ("used", np.bool_),
        ("last_used", np.bool_),
        ("off", np.bool_),
        ("found", np.bool_),  # its thrust, since it began: a band that is wide again is no start
        ("contradicted", np.bool_),  # the mounts say that it runs, and nobody else does
        ("beyond_n2", np.float64),  # what the mounts of one that is off show beyond their own sigma
        ("calibrated", np.bool_),  # or never: it ran
        ("calibrated_now", np.bool_),  # at this step
        ("anchored", np.bool_),  # a measurement of this instant has said where T is: the next teaches the errors
        ("taken", np.bool_),  # the measurement that was weighed
        ("lead_n", np.float64),  # what the bank said last, and by how much more than the filter at that step
        ("apart_n", np.float64),
    ],
    align=True,
)


@compiled
def _begin(m: Any, t: Any, s: Any) -> None:
    silence(t)
    m.dt_s = 0.0 if m.t_ns == NEVER_NS else max((t.t_ns - m.t_ns) * 1e-9, 0.0)
    m.t_ns = t.t_ns
    m.anchored = False
    m.mount_nu_n = m.mount_nis = m.nu_n = m.nis = nan
    m.mount_used = m.used = m.calibrated_now = False
    if m.dt_s > PAUSE_S:
        m.found = False
        m.surprise_n_s = max(m.surprise_n_s, s.surprise_rate_n_s)


@compiled
def _take(m: Any, x: Floats, p: Floats) -> None:
    """What was weighed, when it is to be taken. The first measurement of an instant says where T is, and must not teach
    the errors: they are as before it.
    """
    if not m.taken:
        return
    x_before, p_before = x.copy(), p.copy()
    update(x, p, m.z, m.h, m.r, m.gain, m.work)
    if not m.anchored:
        for i in range(MOUNT, N_STATE):  # no slices: numba compiles 2 s for what one may refuse of another
            x[i, 0] = x_before[i, 0]
            for j in range(MOUNT, N_STATE):
                p[i, j] = p_before[i, j]
    m.anchored, m.taken = True, False


@compiled
def _zero(m: Any, t: Any, s: Any) -> None:
    """An engine is off when nobody says that it runs; then its thrust is known: none, or that of one that windmills.

    Before it ran for the first time, on the ground, what the mounts show is their zeros. Later they say that it runs by
    more than their own sigma and the installation's; what they show beyond their own may be a thrust, and is in the
    band. Where they say that it runs and nobody else does, they are followed, and the 95 % hold an engine that is off,
    too: two measurements that exclude each other are no mean of both.

    What a flight leaves in their friction and creep is as large as a zero: nothing else calibrates it.
    """
    stands = abs(t.off_n) <= s.engine_off_std_n
    unlit = t.unlit and not (stands and t.n1_pct >= s.engine_off_n1_pct)  # it runs down
    own_n2 = s.engine_off_std_n**2 + t.off_std_n**2 + t.installed_n**2 + t.mount_std_n**2
    shown_n2 = (t.mount_n - t.off_n) ** 2
    zeros_known = m.calibrated or not stands
    m.contradicted = unlit and zeros_known and shown_n2 > s.gate_chi2 * own_n2  # NaN says nothing
    m.off_s = m.off_s + m.dt_s if unlit and not m.contradicted else 0.0
    m.off = m.off_s >= s.engine_off_after_s
    m.beyond_n2 = max(shown_n2 - t.mount_std_n**2, 0.0) if m.off and isfinite(t.mount_n) else 0.0
    m.calibrated_now = m.off and stands and not m.calibrated and isfinite(t.mount_n)
    m.calibrated |= m.off or t.burns or t.n1_pct >= s.engine_off_n1_pct
    if m.contradicted:
        t.brochure_n, t.brochure_std_n = t.off_n, hypot(s.engine_off_std_n, t.off_std_n)  # said, not measured with
    if m.off:
        m.h[0] = 0.0
        m.h[0, THRUST] = 1.0
        m.z, m.r, m.taken = t.off_n, s.engine_off_std_n**2 + t.off_std_n**2, True


@compiled
def _measure(m: Any, s: Any, y: float, doubt_n2: float, x: Floats, p: Floats) -> tuple[float, float, bool]:
    """Gate one scalar measurement, opened by `doubt_n2`; -> the verdict on it."""
    if not isfinite(y):
        return nan, nan, False
    verdict = judge(s, y, m.h, m.r, doubt_n2, x, p)
    m.z, m.taken = y, verdict[2]
    return verdict


@compiled
def _mounts(m: Any, t: Any, s: Any, x: Floats, p: Floats) -> None:
    """With the engine off the mounts show their own error, whatever the filter held it for: a wider gate."""
    m.h[0] = 0.0
    m.h[0, THRUST] = m.h[0, MOUNT] = 1.0
    m.h[0, RATE] = -m.mount_age_s
    m.r = s.mount_noise_std_n**2
    doubt_n2 = OFF_DOUBT_N**2 if m.off else 0.0
    m.mount_nu_n, m.mount_nis, m.mount_used = _measure(m, s, t.mount_n, doubt_n2, x, p)


@compiled
def _brochure(m: Any, t: Any, s: Any, again: bool, x: Floats, p: Floats) -> None:
    """Once per reading of the engine; in between the last verdict stands."""
    stopping = t.unlit and t.n1_pct < s.engine_off_n1_pct
    if m.off or m.contradicted or stopping or not isfinite(t.brochure_n):
        m.last_nu_n, m.last_used = nan, False  # no deck says anything of an engine that stands
        return
    read_ns = t.t_ns - round(t.brochure_age_s * 1e9)
    if read_ns <= m.read_ns and not again:
        return
    m.read_ns = read_ns
    m.h[0] = 0.0
    m.h[0, THRUST] = m.h[0, SHAPE] = 1.0
    m.h[0, RATE], m.h[0, ENGINE] = -t.brochure_age_s, m.sizes[SCALE_N]
    m.r = s.brochure_noise_std_n**2 + t.brochure_lag_n**2
    m.nu_n, m.nis, m.used = _measure(m, s, t.brochure_n, 0.0, x, p)
    m.last_nu_n, m.last_used = m.nu_n, m.used


@compiled
def _open(p: Floats, q: Floats, moved_n: float) -> None:
    """The thrust may be elsewhere than it was predicted."""
    p[THRUST, THRUST] += moved_n**2
    q[THRUST, THRUST] += moved_n**2


@compiled
def _moved(m: Any, t: Any, s: Any) -> bool:
    m.moved_n = m.mount_nu_n
    push_n = 0.0 if t.mount_extrapolating else t.push_n  # no thrust of this engine does that
    sources = m.mount_nu_n, m.nu_n, m.used
    return not m.mount_used and agree_on_a_move(*sources, t.n1_rate_pct_s, s.throttle_rate_gain_n_per_pct, push_n)


@compiled
def _follow_a_move(m: Any, t: Any, s: Any, x: Floats, p: Floats) -> None:
    """Both sources say that the thrust is elsewhere than it was predicted."""
    _open(p, m.q, m.moved_n)
    _mounts(m, t, s, x, p)
    _take(m, x, p)
    left_n = STILL_TO_COME * m.moved_n
    _open(p, m.q, left_n if abs(left_n) <= abs(m.step_n) else m.step_n)
    if isfinite(m.nu_n) and not m.used:
        _brochure(m, t, s, True, x, p)
        _take(m, x, p)


@compiled
def _bound(m: Any, s: Any, x: Floats) -> None:
    """No error is larger than three sigmas of its own prior: what does not fit is a fault of somebody (`sensors`)."""
    for place, size in (
        (MOUNT, sqrt(m.sizes[MOUNT_N2])),
        (ENGINE, s.brochure_bias_std),
        (SHAPE, sqrt(m.sizes[SHAPE_N2])),
    ):
        x[place, 0] = min(max(x[place, 0], -BOUND * size), BOUND * size)


def _go_on(memory: Any, told: Any, settings: Any, x: Floats, p: Floats) -> None:
    """x (n, 1) and p (n, n) to the instant of what was told, in place."""
    m, t, s = memory[0], told[0], settings[0]
    _begin(m, t, s)
    move(m, t, s, min(m.dt_s, MAX_STEP_S), x[RATE, 0])
    predict(x, p, m.f, m.q, m.work[0])
    _zero(m, t, s)
    _take(m, x, p)
    _mounts(m, t, s, x, p)  # before the brochure: they are what knows where the thrust is while the throttle moves
    _take(m, x, p)
    _brochure(m, t, s, False, x, p)
    _take(m, x, p)
    if _moved(m, t, s):
        _follow_a_move(m, t, s, x, p)
    _bound(m, s, x)
    if m.off:  # whatever the mounts show: in flight the drag of their nacelle, too
        x[THRUST, 0], x[RATE, 0] = t.off_n, 0.0
        p[THRUST, THRUST] = max(p[THRUST, THRUST], t.off_std_n**2)
    m.found |= p[THRUST, THRUST] <= s.converging_std_n**2
    m.surprise_n_s = surprise_n_s(s, (m.mount_nu_n, m.mount_used), (m.last_nu_n, m.last_used))


_TABLE = numba.float64[:, ::1]
_RECORDS = numba.from_dtype(FILTER)[::1], numba.from_dtype(INPUTS)[::1], numba.from_dtype(SETTINGS)[::1]
go_on: Any = entry(compiled(_go_on, numba.void(*_RECORDS, _TABLE, _TABLE), "numpy"))
