"""Min/max pyramid: any stretch of a column as a few hundred (lowest, highest) pairs, in well under a millisecond.

Level j holds the lowest and the highest of every `BASE * FACTOR**j` samples. A zoom takes the coarsest level that still
has `OVERSAMPLE` entries per bucket and reduces those, so that its cost does not depend on the length of the record.
Because every sample takes part in a minimum and a maximum, a one-sample outlier is on the screen at every zoom.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from thrustd.core.columns import Floats

BASE = 16  # samples of one entry of the finest level
FACTOR = 4  # entries merged from level to level
OVERSAMPLE = 4  # entries per bucket at least, so that buckets are equal within a quarter

Singles = npt.NDArray[np.float32]
Ints = npt.NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Zoom:
    """A stretch as buckets; `low is high` when every bucket is one sample."""

    first: Ints  # (k,) index of the first sample of a bucket
    low: npt.NDArray[Any]  # (k,)
    high: npt.NDArray[Any]  # (k,)

    @property
    def raw(self) -> bool:
        return self.low is self.high


def level_sizes(n: int) -> list[int]:
    """Entries of every level of a column of n samples; the last has fewer than FACTOR."""
    sizes, entries = [], -(-n // BASE)
    while True:
        sizes.append(entries)
        if entries < FACTOR:
            return sizes
        entries = -(-entries // FACTOR)


def build(column: Floats) -> Singles:
    """All levels one after the other (2, total): lowest and highest, NaN where a bucket has no number."""
    low, high = _reduce(np.fmin, column, BASE), _reduce(np.fmax, column, BASE)
    lows, highs = [low], [high]
    for _ in level_sizes(len(column))[1:]:
        low, high = _reduce(np.fmin, low, FACTOR), _reduce(np.fmax, high, FACTOR)
        lows.append(low)
        highs.append(high)
    return np.stack([np.concatenate(lows), np.concatenate(highs)]).astype(np.float32)


def _reduce(lowest: np.ufunc, values: Floats, width: int) -> Floats:
    whole = len(values) // width * width
    head = lowest.reduce(values[:whole].reshape(-1, width), axis=1)
    if whole == len(values):
        return np.asarray(head, float)
    return np.append(head, lowest.reduce(values[whole:]))


def zoom(column: Floats, levels: Singles, start: int, stop: int, buckets: int) -> Zoom:
    """Samples start..stop of `column` in at most `buckets` buckets; every sample where they are few enough."""
    n = stop - start
    if n <= 2 * buckets:
        part = np.asarray(column[start:stop])
        return Zoom(np.arange(start, stop), part, part)
    per_bucket = n / buckets
    if per_bucket < BASE * OVERSAMPLE:
        part = np.asarray(column[start:stop])
        return _buckets(part, part, 1, start, buckets)
    width, at = BASE, 0
    for entries in level_sizes(len(column)):
        if per_bucket < width * FACTOR * OVERSAMPLE:
            break
        width, at = width * FACTOR, at + entries
    first, last = start // width, -(-stop // width)
    return _buckets(levels[0, at + first : at + last], levels[1, at + first : at + last], width, first * width, buckets)


def _buckets(low: npt.NDArray[Any], high: npt.NDArray[Any], width: int, start: int, buckets: int) -> Zoom:
    edges = np.arange(buckets) * len(low) // buckets
    return Zoom(start + edges * width, np.fmin.reduceat(low, edges), np.fmax.reduceat(high, edges))
