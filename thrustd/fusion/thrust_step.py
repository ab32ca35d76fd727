"""One step of a thrust filter as compiled code, up to the next thing that filterpy is to do.

    BEGIN -> predict -> [look back] -> [tare] -> mounts -> brochure -> [both moved: mounts, brochure again] -> DONE

`go_on` weighs what the filter was told, says what is next and lays H, z and R out for it; afterwards it is called
again. What it decides is said in `thrust_filter`.
"""

from math import isfinite, nan
from typing import Any

import numba
import numpy as np

from thrustd.compiled import compiled
from thrustd.fusion.dynamics import ENGINE, MOUNT, N_STATE, RATE, SCALE_N, SHAPE, THRUST, ZERO, Matrix, move
from thrustd.fusion.fusion_inputs import INPUTS, silence
from thrustd.fusion.gate import FAILED, agree_on_a_move, judge, surprise_n_s
from thrustd.fusion.settings import SETTINGS
from thrustd.types import Status

PAUSE_S = 1.0  # a restart, frames that were shed: nobody saw whether the throttle moved
MAX_STEP_S = 10.0  # longer silences are predicted as this long: the band is as wide as it gets by then
OFF_DOUBT_N = 150.0
STILL_TO_COME = 2.0  # of a move that began within the step that a mean is taken over
PAST_S = 5.0  # what lied is named within 3.4 s
NEVER_NS = -1
LIED = int(Status.SENSOR_DOUBTED | Status.MOUNTS_DISAGREE | Status.STUCK)
DONE, PREDICT, LOOK_BACK, UPDATE = range(4)  # for whoever has the filter
BEGIN, PAST, TARE, MOUNTS, BROCHURE, MOUNTS_AGAIN, BROCHURE_AGAIN, END = range(8)  # places in a step
SIZES, MOUNT_GATE, BROCHURE_GATE = range(3)  # rows of what is slow: see `dynamics` and `gate`
NEWS = ("tare", "mount_failed", "mount_recovered", "brochure_failed", "brochure_recovered")
_TARED, _MOUNT_FAILED, _BROCHURE_FAILED = 0, 1, 3  # places in NEWS; a recovery is the one behind
MOST_NEWS = 5  # of one step

FILTER = np.dtype(
    [
        ("place", np.int64),  # in the step
        ("t_ns", np.int64),  # of the last step
        ("read_ns", np.int64),  # of the last brochure reading used
        ("dt_s", np.float64),
        ("off_s", np.float64),
        ("off", np.bool_),
        ("tared", np.bool_),
        ("anchored", np.bool_),  # a measurement of this instant has said where T is: the next teaches the errors
        ("updated", np.bool_),  # filterpy has just done so, and knows nothing of errors that stay
        ("doubts", np.int64),  # the `LIED` bits of the last step
        ("past_s", np.float64),
        ("surprise_n_s", np.float64),
        ("mount_age_s", np.float64),
        ("step_n", np.float64),  # one sigma of what no N1 spoke of yet, over the step that a mean is taken over
        ("moved_n", np.float64),  # a movement that both routes agree on
        ("z", np.float64),
        ("mount_nu_n", np.float64),  # verdicts of this step
        ("mount_nis", np.float64),
        ("mount_used", np.bool_),
        ("nu_n", np.float64),
        ("nis", np.float64),
        ("used", np.bool_),
        ("last_nu_n", np.float64),  # of the last brochure reading
        ("last_used", np.bool_),
        ("bounded_n2", np.float64),  # what is taken off the printed variance: see `estimate_row`
        ("n_news", np.int64),
    ]
)


@compiled
def _begin(m: Any, t: Any, s: Any) -> None:
    silence(t)
    m.dt_s = 0.0 if m.t_ns == NEVER_NS else max((t.t_ns - m.t_ns) * 1e-9, 0.0)
    m.t_ns = t.t_ns
    m.anchored = False
    m.mount_nu_n = m.mount_nis = m.nu_n = m.nis = nan
    m.mount_used = m.used = False
    m.n_news = 0
    if m.dt_s > PAUSE_S:
        m.surprise_n_s = max(m.surprise_n_s, s.surprise_rate_n_s)


@compiled
def _tell(m: Any, news: Any, what: int) -> None:
    news[m.n_news] = what
    m.n_news += 1


@compiled
def _settle(m: Any, x_before: Matrix, p_before: Matrix, x: Matrix, p: Matrix) -> None:
    """Errors that a measurement must not teach are as they were before it."""
    if m.updated:
        end = N_STATE if not m.anchored else ZERO if m.off else ZERO + 1
        for i in range(ZERO, end):
            x[i, 0] = x_before[i, 0]
            for j in range(ZERO, end):
                p[i, j] = p_before[i, j]
        m.anchored, m.updated = True, False


@compiled
def _tare(m: Any, t: Any, s: Any, news: Any, h: Matrix, r: Matrix) -> None:
    """Once the engine is off there is no thrust."""
    turning = not t.n1_pct < s.engine_off_n1_pct  # NaN counts as turning
    m.off_s = 0.0 if turning else m.off_s + m.dt_s
    m.off = m.off_s >= s.engine_off_after_s
    if m.off and not m.tared and isfinite(t.mount_n):
        _tell(m, news, _TARED)
        m.tared = True
    if turning:
        m.tared = False
    if m.off:
        h[0] = 0.0
        h[0, THRUST] = 1.0
        m.z, r[0, 0], m.updated = 0.0, s.tare_std_n**2, True


@compiled
def _measure(
    m: Any, s: Any, gate: Matrix, failed: int, news: Any, y: float, doubt_n2: float, dt_s: float, h: Matrix, r: Matrix,
    x: Matrix, p: Matrix,
) -> tuple[float, float, bool]:  # fmt: skip
    """Gate one scalar measurement, opened by `doubt_n2`; -> the verdict on it. `failed`: the news when it is."""
    if not isfinite(y):
        return nan, nan, False
    before = gate[FAILED]
    verdict = judge(gate, s, y, h, r[0, 0], doubt_n2, dt_s, x, p)
    if gate[FAILED] != before:
        _tell(m, news, failed if gate[FAILED] != 0.0 else failed + 1)
    m.z, m.updated = y, verdict[2]
    return verdict


@compiled
def _mounts(
    m: Any, t: Any, s: Any, slow: Matrix, news: Any, dt_s: float, h: Matrix, r: Matrix, x: Matrix, p: Matrix
) -> None:
    """With the engine off the mounts show their own error, whatever the filter held it for: a wider gate."""
    h[0] = 0.0
    h[0, THRUST] = h[0, ZERO] = h[0, MOUNT] = 1.0
    h[0, RATE] = -m.mount_age_s
    r[0, 0] = s.mount_noise_std_n**2
    doubt_n2 = OFF_DOUBT_N**2 if m.off else 0.0
    m.mount_nu_n, m.mount_nis, m.mount_used = _measure(
        m, s, slow[MOUNT_GATE], _MOUNT_FAILED, news, t.mount_n, doubt_n2, dt_s, h, r, x, p
    )


@compiled
def _brochure(
    m: Any, t: Any, s: Any, slow: Matrix, news: Any, again: bool, h: Matrix, r: Matrix, x: Matrix, p: Matrix
) -> None:
    """Once per reading of the engine; in between the last verdict stands."""
    if m.off or t.n1_pct < s.engine_off_n1_pct or not isfinite(t.brochure_n):
        m.last_nu_n, m.last_used = nan, False  # no deck says anything of an engine that stands
        return
    read_ns = t.t_ns - round(t.brochure_age_s * 1e9)
    if read_ns <= m.read_ns and not again:
        return
    dt_s = 0.0 if m.read_ns == NEVER_NS else (read_ns - m.read_ns) * 1e-9
    m.read_ns = read_ns
    h[0] = 0.0
    h[0, THRUST] = h[0, SHAPE] = 1.0
    h[0, RATE], h[0, ENGINE] = -t.brochure_age_s, slow[SIZES, SCALE_N]
    r[0, 0] = s.brochure_noise_std_n**2 + t.brochure_lag_n**2
    m.nu_n, m.nis, m.used = _measure(
        m, s, slow[BROCHURE_GATE], _BROCHURE_FAILED, news, t.brochure_n, 0.0, dt_s, h, r, x, p
    )
    m.last_nu_n, m.last_used = m.nu_n, m.used


@compiled
def _open(p: Matrix, q: Matrix, moved_n: float) -> None:
    """The thrust may be elsewhere than it was predicted."""
    p[THRUST, THRUST] += moved_n**2
    q[THRUST, THRUST] += moved_n**2


@compiled
def _moved(m: Any, t: Any, s: Any) -> bool:
    m.moved_n = m.mount_nu_n
    push_n = 0.0 if t.mount_extrapolating else t.push_n  # no thrust of this engine does that
    routes = m.mount_nu_n, m.nu_n, m.used
    return not m.mount_used and agree_on_a_move(*routes, t.n1_rate_pct_s, s.throttle_rate_gain_n_per_pct, push_n)


@compiled
def _weigh(
    place: int, m: Any, t: Any, s: Any, slow: Matrix, news: Any, q: Matrix, h: Matrix, r: Matrix, x: Matrix, p: Matrix
) -> None:
    if place == TARE:
        m.doubts = t.status & LIED
        _tare(m, t, s, news, h, r)
    elif place == MOUNTS:
        # before the brochure: they are what knows where the thrust is while the throttle moves
        _mounts(m, t, s, slow, news, m.dt_s, h, r, x, p)
    elif place == BROCHURE:
        _brochure(m, t, s, slow, news, False, h, r, x, p)
    elif place == MOUNTS_AGAIN and not _moved(m, t, s):
        m.place = END
    elif place == MOUNTS_AGAIN:
        _open(p, q, m.moved_n)
        _mounts(m, t, s, slow, news, 0.0, h, r, x, p)
    else:
        left_n = STILL_TO_COME * m.moved_n
        _open(p, q, left_n if abs(left_n) <= abs(m.step_n) else m.step_n)
        if isfinite(m.nu_n) and not m.used:
            _brochure(m, t, s, slow, news, True, h, r, x, p)


def _go_on(
    memory: Any, told: Any, settings: Any, slow: Matrix, news: Any, f: Matrix, q: Matrix, h: Matrix, r: Matrix,
    x_before: Matrix, p_before: Matrix, x: Matrix, p: Matrix,
) -> int:  # fmt: skip
    """-> what filterpy is to do next. `x_before`, `p_before`: of before it did what was asked for last."""
    m, t, s = memory[0], told[0], settings[0]
    _settle(m, x_before, p_before, x, p)
    while m.place != END:
        place = m.place
        m.place += 1
        if place == BEGIN:
            _begin(m, t, s)
            routes = t.mount_std_n, t.brochure_n, t.brochure_std_n
            dt_s = min(m.dt_s, MAX_STEP_S)
            move(f, q, slow[SIZES], settings, dt_s, x[RATE, 0], t.n1_rate_pct_s, m.surprise_n_s, *routes)
            return PREDICT
        if place == PAST:
            m.past_s += min(m.dt_s, MAX_STEP_S)
            if m.past_s >= PAST_S or t.status & LIED & ~m.doubts:
                return LOOK_BACK
            continue
        _weigh(place, m, t, s, slow, news, q, h, r, x, p)
        if m.updated:
            return UPDATE
    m.place = BEGIN
    mount, brochure = (m.mount_nu_n, m.mount_used), (m.last_nu_n, m.last_used)
    m.surprise_n_s = surprise_n_s(s, (*mount, slow[MOUNT_GATE, FAILED]), (*brochure, slow[BROCHURE_GATE, FAILED]))
    return DONE


_TABLE = numba.float64[:, ::1]
_RECORDS = numba.from_dtype(FILTER)[::1], numba.from_dtype(INPUTS)[::1], numba.from_dtype(SETTINGS)[::1]
go_on: Any = compiled(_go_on, numba.int64(*_RECORDS, _TABLE, numba.int64[::1], *[_TABLE] * 8), "numpy")
