"""Times that are written as dates (ISO 8601) or as times of day, in seconds."""

import numpy as np
import pyarrow as pa
from pyarrow import compute

from thrustd.core.columns import Floats

DAY_S = 86400.0
EXPECTED = "expected seconds, or times such as 2026-03-01T10:00:00.05 or 10:00:00.05"
CALLED = " (times are read where the column is called time_s)"  # behind a word that it is left out
KINDS = pa.timestamp("ns"), pa.timestamp("ns", "UTC"), pa.time64("ns"), pa.duration("ns")


def seconds(column: pa.ChunkedArray) -> Floats | None:
    """(n,) since the first of dates or times of day, also past midnight; None where it holds anything else."""
    since_s, of_day = _since(column), pa.types.is_time(column.type)
    if since_s is None and pa.types.is_string(column.type):
        since_s, of_day = _since(compute.binary_join_element_wise("1970-01-01T", column, "")), True
    if since_s is not None and of_day:
        since_s += DAY_S * np.cumsum(np.diff(since_s, prepend=since_s[:1]) < -DAY_S / 2)
    return since_s


def _since(column: pa.ChunkedArray) -> Floats | None:
    for kind in KINDS:
        try:
            ticks = column.cast(kind).cast(pa.int64())
        except (pa.ArrowInvalid, pa.ArrowNotImplementedError):
            continue
        since_s = compute.subtract(ticks, compute.min(ticks)).to_numpy().astype(np.float64) / 1e9
        return np.asarray(since_s - since_s[:1])
    return None
