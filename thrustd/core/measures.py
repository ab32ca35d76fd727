"""How wrong an estimate is, in the numbers of the thesis: RMSE, and mean |error| in % where the force exceeds 2 kN.

NaN: not known, it does not count.
"""

import numpy as np

from thrustd.core.columns import Floats

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
