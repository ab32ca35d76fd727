"""What the page draws of a time history: a window of some channels in one small binary answer.

    u32 length of the header | header (JSON, padded to 8 bytes) | float64 time_s (k,) | per channel float32 low (k,)
    and, unless `raw`, float32 high (k,)                                                            all little-endian

The header says the channels, whether every bucket is one sample (`raw`), and after which buckets a gap follows.
"""

import struct
from collections.abc import Sequence
from typing import NamedTuple

import msgspec
import numpy as np

from thrustd.workbench.columns import Columns
from thrustd.workbench.pyramid import zoom

MAX_BYTES = 96_000  # of one answer
HEADER_BYTES = 1_500  # room left for the header
MIN_BUCKETS = 50
GAP = 1.5  # a bucket this much longer than the median one holds a gap


class Line(NamedTuple):
    """One channel of one set of columns."""

    label: str
    columns: Columns
    channel: str


def window(lines: Sequence[Line], start_s: float, stop_s: float, buckets: int) -> bytes:
    """The answer for lines of one recording (all on the same time axis)."""
    time_s = lines[0].columns.time_s
    first = max(0, int(np.searchsorted(time_s, start_s, "right")) - 1)
    last = min(len(time_s), int(np.searchsorted(time_s, stop_s, "left")) + 1)
    last = max(last, first + 1)
    buckets = max(MIN_BUCKETS, min(buckets, _affordable(len(lines))))
    zooms = [zoom(line.columns.column(line.channel), line.columns.levels(line.channel), first, last, buckets)
             for line in lines]  # fmt: skip
    times = np.ascontiguousarray(time_s[zooms[0].first], dtype="<f8")
    header = {
        "channels": [line.label for line in lines],
        "raw": zooms[0].raw,
        "count": len(times),
        "samples": last - first,
        "breaks": _breaks(times),
        "end_s": float(time_s[last - 1]),
    }
    parts = [_head(header), times.tobytes()]
    for found in zooms:
        parts.append(np.ascontiguousarray(found.low, dtype="<f4").tobytes())
        if not found.raw:
            parts.append(np.ascontiguousarray(found.high, dtype="<f4").tobytes())
    return b"".join(parts)


def _affordable(lines: int) -> int:
    """Buckets that fit; a raw answer holds up to twice as many samples, at half the bytes per value."""
    return (MAX_BYTES - HEADER_BYTES) // (2 * 8 + 2 * 4 * lines)


def _head(header: dict[str, object]) -> bytes:
    text = msgspec.json.encode(header)
    text += b" " * (-(len(text) + 4) % 8)
    return struct.pack("<I", len(text)) + text


def _breaks(times: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> list[int]:
    if len(times) < 3:
        return []
    steps = np.diff(times)
    found: list[int] = np.flatnonzero(steps > GAP * np.median(steps)).tolist()
    return found[:100]
