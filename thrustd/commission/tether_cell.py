"""The load cell's record of a tethered run: on the log's clock, in newtons, without what no run could have made.

A sample is not of the run where it lies beyond all that the mounts say around its time, as far as the clocks may be
apart, and all that an installation, a cell's zero and a clock may add to that. One such sample moves every gain.
"""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from thrustd.core.columns import Flags, Floats
from thrustd.core.errors import RecordingError
from thrustd.records.recording import Recording

FORCE = "force_N"
CLOCK_S = 3.0  # that the cell's clock may be off
UNITS = {"kN": 1e-3, "kgf": 0.102, "lbf": 0.2248}  # per newton
RATIO = (0.5, 2.0)  # of the cell's range over the models'; outside it is another unit or another load path
HOLE = 5.0  # times the usual step of the cell's record
FAR = 5.0  # sigmas of what is known before
FEW = 0.01  # of the samples: more are no glitch, but another run, unit or sign


class Heard(NamedTuple):
    cell: Recording  # NaN where a sample is none of this run
    remarks: list[str]


def at_times(cell: Recording, at_s: Floats) -> Floats:
    """The cell at these times; NaN where it said nothing, nor around."""
    read_n = np.interp(at_s, cell.time_s, cell[FORCE], left=np.nan, right=np.nan)
    after = np.clip(np.searchsorted(cell.time_s, at_s), 1, len(cell) - 1)
    hole = np.diff(cell.time_s)[after - 1] > HOLE * np.median(np.diff(cell.time_s))
    return np.asarray(np.where(hole, np.nan, read_n))


def check_unit(cell: Recording, base_n: Floats, cell_n: Floats) -> None:
    good = np.isfinite(cell_n) & np.isfinite(base_n)
    spans = [float(np.ptp(np.percentile(each[good], (1, 99)))) for each in (cell_n, base_n)]
    ratio = spans[0] / max(spans[1], 1e-9)
    if not RATIO[0] < ratio < RATIO[1]:
        near = next((f" is it {unit}?" for unit, one in UNITS.items() if one / 1.5 < ratio < 1.5 * one), "")
        raise RecordingError(
            f"{cell.name}: force_N spans {spans[0]:.4g}, the models of all mounts {spans[1]:.4g} N;{near} expected N"
        )


def heard(cell: Recording, time_s: Floats, base_n: Floats, std_n: Floats) -> Heard:
    """`base_n`: what all mounts say at these times, NaN where that does not count; `std_n`: what is not known of it."""
    strange = _strange(cell, time_s, base_n, FAR * std_n)
    n = int(np.count_nonzero(strange))
    if not 0 < n <= FEW * len(cell):
        return Heard(cell, [])
    worst = int(np.argmax(np.where(strange, np.abs(np.nan_to_num(cell[FORCE])), 0.0)))
    said = f"{n} of {len(cell)} samples left out that no run could have made"
    said += f", the largest {cell[FORCE][worst]:.0f} N at {cell.time_s[worst]:.2f} s"
    return Heard(cell.with_channels(**{FORCE: np.where(strange, np.nan, cell[FORCE])}), [f"{cell.name}: {said}"])


def _strange(cell: Recording, time_s: Floats, base_n: Floats, allowed_n: Floats) -> Flags:
    around = 2 * round(CLOCK_S / float(np.median(np.diff(time_s)))) + 1
    known, n = np.isfinite(base_n + allowed_n), np.clip(np.searchsorted(time_s, cell.time_s), 0, len(time_s) - 1)
    least_n = minimum_filter1d(np.where(known, base_n - allowed_n, -np.inf), around)[n]
    most_n = maximum_filter1d(np.where(known, base_n + allowed_n, np.inf), around)[n]
    return np.asarray((cell[FORCE] < least_n) | (cell[FORCE] > most_n))
