"""What a record can tell and what not, said before anything is computed from it: one line each.

Its turns, strokes, frequencies and channels decide which effects can be told apart: one frequency gives one stiffness
and one loss whatever makes them; a motion that never turns back shows no loop; a channel that goes with another or with
time cannot be told from it.
"""

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.signal import periodogram

from thrustd.core.columns import Floats
from thrustd.diagnose.compare.loop_energy import loop_energy
from thrustd.diagnose.compare.motion import Motion, motion_of
from thrustd.diagnose.compare.reference import is_own_output
from thrustd.diagnose.search.candidates import moves
from thrustd.identify.checks import stuck
from thrustd.identify.segments import DEFORMATION, FORCE, segments_of
from thrustd.records.recording import Recording
from thrustd.records.roles import roles_of, units_trusted

ONE_TONE = 0.98  # of the power of the motion
TONE_WIDTH = 0.15  # of its frequency
CYCLES = 3.0  # at least, for a frequency to be one
ALIKE = 0.1  # scatter of strokes that are one amplitude
ONE_LEVEL = 0.05  # of the level: a record that stays there
TOGETHER = 0.9995  # correlation of two channels that go together
ALONG_G = 1.0  # an aircraft's thrust and drag are smaller than its weight
MOST_PAIRS = 3
MOST_CHANNELS = 24


class FirstLook(NamedTuple):
    """Facts of the longest stretch of the first record, and what follows from them."""

    turns: int
    one_amplitude: bool
    frequency_hz: float | None  # where nearly all of the motion has one
    one_level: bool
    fastest_s: float  # time constants between these two can be told
    slowest_s: float
    delivers_energy: bool
    lines: tuple[str, ...]


def first_look(records: Sequence[Recording]) -> FirstLook:
    """Of recordings with `deformation_mm` and `force_N`; RecordingError when they have no stretch with both."""
    segment = max(segments_of(records), key=len)
    x, roles = segment.inputs[DEFORMATION], roles_of(records)
    motion = motion_of(x, segment.dt_s)
    turns, strokes = _turns(motion)
    tone = _tone(x, segment.dt_s)
    alike = len(strokes) >= CYCLES and float(np.std(strokes)) < ALIKE * float(np.mean(strokes))
    low, high = np.quantile(x, [0.005, 0.995])
    level = abs(float(np.median(x)))
    one_level = bool(high - low < ONE_LEVEL * level)
    energy = loop_energy(records)
    where = ", ".join(record.name for record in records)
    said = [
        (energy.delivers, energy.sentence(records)),
        (
            one_level,
            f"{where}: {roles.input} stays at one level ({level:.3g} {roles.input_unit}".rstrip()
            + "): only the slope there can be told",
        ),
        (turns == 0, f"{where}: {roles.input} never turns back: stiffness and hysteresis cannot be told apart"),
        (
            tone is not None and not alike,
            f"{where}: moves at one frequency ({tone or 0:.3g} Hz): delay and viscous damping cannot be told apart",
        ),
        (
            tone is None and alike,
            f"{where}: turns at one amplitude: friction, free play and softening by amplitude can hardly be told apart",
        ),
        (
            tone is not None and alike,
            f"{where}: moves at one frequency ({tone or 0:.3g} Hz) and one amplitude:"
            " delay, damping, relaxation and creep cannot be told apart, nor friction and free play from softening",
        ),
    ]
    held = tuple(f"{record.name}: {line}" for record in records if (line := stuck(record)))
    lines = held + _accels(records) + tuple(line for true, line in said if true) + _channels(records, where)
    return FirstLook(turns, alike, tone, one_level, 2 * segment.dt_s, len(x) * segment.dt_s / 4, energy.delivers, lines)


def _accels(records: Sequence[Recording]) -> tuple[str, ...]:
    """Asked, not refused: a shaker gives a mount more, and what is in m/s2 is seldom so large that nothing is."""
    found = []
    for record in records:
        for axis in ("accel_x_g", "accel_y_g"):
            column = record.channels.get(axis, np.array([np.nan]))
            if units_trusted(record, axis) or not np.isfinite(column).any():
                continue
            reaches = float(np.nanquantile(np.abs(column), 0.999))
            if reaches > ALONG_G:
                found.append(
                    f"{record.name}: {axis} reaches {reaches:.2g}: more than an aircraft is moved by; in m/s2?"
                )
    return tuple(found)


def _turns(motion: Motion) -> tuple[int, Floats]:
    """How often it turned, and the ways between one reversal and the next."""
    turned = np.flatnonzero((np.diff(motion.direction) != 0) & (motion.direction[:-1] != 0))
    return len(turned), np.diff(motion.travel[turned])


def _tone(x: Floats, dt_s: float) -> float | None:
    frequency, power = periodogram(x, 1.0 / dt_s, window="hann", detrend="linear")
    total = float(power.sum())
    if total <= 0:
        return None
    top = float(frequency[int(np.argmax(power))])
    if top * len(x) * dt_s < CYCLES:
        return None
    width = max(TONE_WIDTH * top, 2.5 / (len(x) * dt_s))
    return top if float(power[np.abs(frequency - top) <= width].sum()) > ONE_TONE * total else None


def _channels(records: Sequence[Recording], where: str) -> tuple[str, ...]:
    """Channels that there are not, or that go together."""
    record = max(records, key=len)
    others = [n for n in record.channels if n != FORCE and not n.startswith(DEFORMATION) and not is_own_output(n)]
    names = [name for name in others if moves(record[name])]
    if not names:
        return (f"{where}: no other column that moves: only effects of motion and time can be told",)
    step = max(1, len(record) // 20_000)
    table = {name: record[name][::step] for name in names[:MOST_CHANNELS]} | {"time_s": record.time_s[::step]}
    two = [(a, b) for a, b in combinations(table, 2) if not (a.startswith(f"{b}_") or b.startswith(f"{a}_"))]
    pairs = [(abs(_correlation(table[a], table[b])), a, b) for a, b in two]
    found = sorted((pair for pair in pairs if pair[0] > TOGETHER), reverse=True)[:MOST_PAIRS]
    return tuple(f"{where}: {a} goes with {b} (correlation {r:.3f}): their effects look alike" for r, a, b in found)


def _correlation(a: Floats, b: Floats) -> float:
    good = np.isfinite(a) & np.isfinite(b)
    if good.sum() < CYCLES or np.ptp(a[good]) == 0 or np.ptp(b[good]) == 0:
        return 0.0
    return float(np.corrcoef(a[good], b[good])[0, 1])
