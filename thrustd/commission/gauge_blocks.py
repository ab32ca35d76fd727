"""A transducer's curve from gauge blocks: what it shows when something of known thickness is between its ends.

Readings of one block, in whatever order and as often as it was put in, make one knot; how they scatter about it, with
the blocks' own sigma, is the curve's. Straight between knots, the end segments go on.
"""

from dataclasses import dataclass
from math import hypot, sqrt

import msgspec
import numpy as np

from thrustd.core.calibration import Calibration, MountCalibration
from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError
from thrustd.records.recording import Recording

BLOCK_STD_MM = 0.0003  # grade 1 of ISO 3650 up to 10 mm, and the contact
SLOPE = (0.8, 1.25)  # of reading over block; another one is another unit or another transducer
WHOLE_MM, BLOCK_MM = 0.001, 0.0002  # blocks come in whole micrometres; how far one is off: ISO 3650, grade 1
GAUGE, READING = "gauge_mm", "deformation_mm"


@dataclass(frozen=True, slots=True)
class BlockCurve:
    read_mm: tuple[float, ...]
    true_mm: tuple[float, ...]
    std_mm: float
    largest_mm: float  # how far a straight line of slope one is off at most


def block_curve(record: Recording) -> BlockCurve:
    """From columns gauge_mm and deformation_mm; RecordingError, one line, when they are no calibration."""
    gauge, reading = record[GAUGE], record[READING]
    good = np.isfinite(gauge) & np.isfinite(reading)
    blocks = np.unique(np.round(gauge[good], 6))
    if len(blocks) < 3 or len(blocks) > 200:
        raise RecordingError(f"{record.name}: {len(blocks)} different blocks in {GAUGE}; expected 3 to 200")
    groups = [reading[good & (np.abs(gauge - block) < 1e-6)] for block in blocks]
    knots = np.array([np.mean(group) for group in groups])
    if np.any(np.diff(knots) <= 0):
        at = blocks[int(np.argmax(np.diff(knots) <= 0))]
        raise RecordingError(f"{record.name}: {READING} does not grow behind the block of {at:g} mm, expected more")
    slope = float((knots[-1] - knots[0]) / (blocks[-1] - blocks[0]))
    if not SLOPE[0] < slope < SLOPE[1]:
        raise RecordingError(f"{record.name}: {slope:.3g} of {READING} per mm of {GAUGE}, expected about 1: was it mm?")
    if _whole(knots, 1e-6) and not _whole(blocks, BLOCK_MM):
        raise RecordingError(
            f"{record.name}: {READING} comes in whole micrometres, {GAUGE} does not: are they swapped?"
        )
    scatter = [float(np.var(group, ddof=1)) for group in groups if len(group) > 1]
    std = hypot(sqrt(float(np.mean(scatter))) if scatter else BLOCK_STD_MM, BLOCK_STD_MM)
    off = knots - blocks - np.mean(knots - blocks)
    return BlockCurve(tuple(knots.tolist()), tuple(blocks.tolist()), std, float(np.max(np.abs(off))))


def _whole(mm: Floats, within_mm: float) -> bool:
    return bool(np.all(np.abs(mm - WHOLE_MM * np.round(mm / WHOLE_MM)) < within_mm))


def with_curve(calibration: Calibration, mount: str, curve: BlockCurve) -> Calibration:
    changed = msgspec.structs.replace(
        calibration.mount.get(mount, MountCalibration()),
        read_mm=tuple(round(value, 6) for value in curve.read_mm),
        true_mm=tuple(round(value, 6) for value in curve.true_mm),
        curve_std_mm=max(round(curve.std_mm, 6), 1e-6),
    )
    return msgspec.structs.replace(calibration, mount=calibration.mount | {mount: changed})
