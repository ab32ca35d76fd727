"""How wrong an estimate is, in the numbers of the thesis: RMSE, and mean |error| in % where the force exceeds 2 kN.

NaN: not known, it does not count.
"""

import numpy as np
from numpy.typing import NDArray

from thrustd.core.columns import Floats

GOLDEN = (5**0.5 - 1.0) / 2.0
ORDER = 3.0  # times more or less is another order of magnitude
FULL_N = 6500.0  # largest load of a mount for which edges, starts and figures of PH-LAB are made
OPERATING_N = 2000.0  # of a mount: the thesis' operating range; below it a per cent of the force means nothing
SIGMAS_95 = 1.96  # half the width of the 95 % band of a normal distribution


def rms(values: Floats) -> float:
    """Of any shape."""
    return float(np.sqrt(np.nanmean(np.square(values))))


def percents(error_n: Floats, reference_n: Floats, above_n: float = OPERATING_N) -> Floats:
    """|error| in % of |reference|, where that is larger than `above_n`: at most as many as (n,)."""
    counted = np.isfinite(error_n) & (np.abs(reference_n) > above_n)
    found: Floats = 100.0 * np.abs(error_n[counted] / reference_n[counted])
    return found


def order_of(size: float, usual: float) -> float:
    """How many times the usual a size is; 1 within an order of magnitude."""
    return 1.0 if size <= 0.0 or usual / ORDER <= size <= usual * ORDER else size / usual


def usual_load(force_n: Floats, *known_n: float) -> bool:
    """Whether the largest load of a record, and of what is known beside it, may be that of a mount of PH-LAB."""
    largest = float(np.nanquantile(np.abs(force_n), 0.999))
    return order_of(max((largest, *map(abs, known_n))), FULL_N) == 1.0


def held_out_groups(n_parts: int, n_groups: int) -> NDArray[np.intp]:
    """Which group (n_parts,) every part of a record belongs to, each held out in turn: as good as equally large.

    By the golden ratio: every n-th part would be the same phase of a motion that repeats, and a model without it would
    be asked for loads that it was never shown.
    """
    found: NDArray[np.intp] = (np.arange(n_parts) * GOLDEN % 1.0 * n_groups).astype(np.intp)
    return found
