"""A clock beside a sample rate that the user names: stamps that tremble, are rounded, or come in bursts.

The rate says how far apart rows are, the stamps where rows are missing. A stamp may be late as long as later ones catch
up; where all that follow stay late, rows are missing, and the hole stays.
"""

import numpy as np
from scipy.ndimage import maximum_filter1d

from thrustd.core.columns import Flags, Floats, Integers
from thrustd.core.errors import RecordingError

CLOCK_SHARE = 0.01  # of a step: so much may a clock be off the rate that was asked for
CAUGHT_UP = 50  # rows, or as many as share a stamp: until then a late one may be made good
HOLE = 0.5  # steps that all later rows are late by
ASIDE = " (to put its clock aside: --rename time_s=clock)"


def at_rate(name: str, time_s: Floats | None, rows: int, rate_hz: float) -> tuple[Floats, list[str]]:
    """(rows,) times, so many rows a second but for the holes of the clock; a word on the clock that they replace.

    RecordingError where the clock goes back, or goes otherwise than the rate by more than it trembles.
    """
    even_s = np.arange(rows) / rate_hz
    known = np.flatnonzero(np.isfinite(time_s)) if time_s is not None else np.zeros(0, np.int64)
    if time_s is None or rows < 2:
        return even_s, []
    stamps_s = time_s[known]
    if not np.any(np.diff(stamps_s)):
        return even_s, [f"time_s does not rise; replaced by {rate_hz:g} rows a second, as asked for"]
    _check_forward(name, stamps_s, known)
    late_s = stamps_s - even_s[known]
    holes_s = np.where(_shifted(late_s, stamps_s, HOLE / rate_hz), np.diff(stamps_s), 0.0)
    holes_s = np.round(holes_s * rate_hz - np.diff(known) * (holes_s > 0.0)) / rate_hz
    _check_rate(name, stamps_s, holes_s, known, rate_hz)
    stands = np.flatnonzero(_shifted(-late_s, stamps_s, HOLE / rate_hz))
    if len(stands):
        where = f"time_s = {stamps_s[stands[0] + 1]!s} in data row {known[stands[0] + 1] + 1}"
        raise RecordingError(f"{name}: {where} is a row more than its clock has room for; expected each once{ASIDE}")
    shift_s = np.zeros(rows)
    shift_s[known[1:]] = holes_s
    own_hz = (known[-1] - known[0]) / (stamps_s[-1] - stamps_s[0] - holes_s.sum())
    word = f"time_s, {own_hz:.4g} rows a second, replaced by {rate_hz:g} as asked for"
    return even_s + np.cumsum(shift_s), [word + _said(holes_s)]


def _check_forward(name: str, stamps_s: Floats, known: Integers) -> None:
    back = np.flatnonzero(np.diff(stamps_s) < 0.0)
    if len(back):
        before_s, after_s = stamps_s[back[0]], stamps_s[back[0] + 1]
        raise RecordingError(
            f"{name}: time_s = {after_s!s} in data row {known[back[0] + 1] + 1} follows {before_s!s};"
            f" expected a clock that does not go back{ASIDE}"
        )


def _shifted(late_s: Floats, stamps_s: Floats, least_s: float) -> Flags:
    """(n - 1,) where rows are missing: the next ones are all later than the last ones were, by least_s."""
    rises = np.flatnonzero(np.diff(stamps_s))
    reach = max(CAUGHT_UP, int(np.diff(rises).max(initial=0)))
    before, after = _most(late_s, reach), -_most(-late_s[::-1], reach)[::-1]
    return np.asarray(after[1:] - before[:-1] > least_s)


def _most(values: Floats, reach: int) -> Floats:
    """(n,) largest of each and the 2 * reach before it."""
    padded = np.pad(values, (2 * reach, 0), constant_values=-np.inf)
    return np.asarray(maximum_filter1d(padded, 2 * reach + 1, mode="nearest")[reach : reach + len(values)])


def _check_rate(name: str, stamps_s: Floats, holes_s: Floats, known: Integers, rate_hz: float) -> None:
    """The usual step may be off by what steps differ; rows against the whole span only by one stamp."""
    steps_s, rows = np.diff(stamps_s) / np.diff(known), int(known[-1] - known[0])
    low_s, usual_s, high_s = np.quantile(steps_s, [0.25, 0.5, 0.75])
    span_s = float(stamps_s[-1] - stamps_s[0])
    mean_s = (span_s - float(holes_s.sum())) / rows
    if usual_s > 0.0 and abs(1.0 / rate_hz - usual_s) > max(CLOCK_SHARE * usual_s, high_s - low_s):
        own = f"{1 / usual_s:.4g}"
    elif abs(1.0 / rate_hz - mean_s) > max(CLOCK_SHARE * mean_s, float((steps_s - holes_s).max()) / rows):
        own = f"{rows + 1} rows in {span_s:.6g} s, {rows / span_s:.4g} a second"
    else:
        return
    raise RecordingError(
        f"{name}: {rate_hz:g} rows a second were asked for, its time_s has {own}; expected one of both{ASIDE}"
    )


def _said(holes_s: Floats) -> str:
    count, sum_s = np.count_nonzero(holes_s), holes_s.sum()
    if count < 2:
        return f"; its hole of {sum_s:.4g} s stays" if count else ""
    return f"; its {count} holes, {sum_s:.4g} s in all, stay"
