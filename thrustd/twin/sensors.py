"""The twin's transducers: what they make of the truth.

LVDT: white noise, its own zero offset, 24-bit counts (ICD section 1). Load cell: 12 N of white noise, as on the
thesis' rig. Accelerometers and everything else: white noise of a stated size.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from thrustd.core.columns import Floats

IntArray = npt.NDArray[np.int32]

LVDT_STROKE_MM = 5.0
COUNT_MM = LVDT_STROKE_MM / 2**24  # ICD section 1
COARSE_COUNT_MM = LVDT_STROKE_MM / 2**16
COUNT_LIMIT = 2**23 - 1
LOAD_CELL_STD_N = 12.0


class Lvdt(NamedTuple):
    """One deformation transducer."""

    noise_mm: float = 3e-5  # one sigma per sample; thesis 12.1.2: 0.07 um variation over a minute
    count_mm: float = COUNT_MM
    zero_mm: float = 0.0  # reading of the unloaded mount


def to_counts(lvdt: Lvdt, reading_mm: Floats) -> IntArray:
    """Signed counts (n,) of a reading (n,), clipped to 24 bits."""
    return np.clip(np.rint(reading_mm / lvdt.count_mm), -COUNT_LIMIT - 1, COUNT_LIMIT).astype(np.int32)


def lvdt_reading(lvdt: Lvdt, deformation_mm: Floats, rng: np.random.Generator) -> Floats:
    """What the transducer says of a true deformation (n,): zero and noise added, a multiple of one count."""
    seen_mm = deformation_mm + lvdt.zero_mm + rng.normal(0.0, lvdt.noise_mm, len(deformation_mm))
    return np.asarray(to_counts(lvdt, seen_mm) * lvdt.count_mm, dtype=np.float64)


def load_cell_reading(force_n: Floats, rng: np.random.Generator, std_n: float = LOAD_CELL_STD_N) -> Floats:
    """Force with the load cell's noise, (n,)."""
    return np.asarray(force_n + rng.normal(0.0, std_n, len(force_n)))
