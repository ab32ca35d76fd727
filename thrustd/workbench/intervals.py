"""Samples that have something in common, as stretches of time the page can shade and jump to."""

import numpy as np

from thrustd.core.columns import Flags, Floats

Intervals = list[tuple[float, float]]

MOST = 400  # stretches kept; nearer ones are joined until they are so few


def intervals_of(mask: Flags, time_s: Floats, most: int = MOST) -> Intervals:
    """[first, last] time of every run of True samples, in order; at most `most`, the smallest gaps closed."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(np.int8), [0]))))
    starts, stops = edges[::2], edges[1::2] - 1
    if len(starts) > most:
        gaps = time_s[starts[1:]] - time_s[stops[:-1]]
        kept = np.sort(np.argsort(gaps, kind="stable")[len(gaps) - (most - 1) :])
        starts, stops = starts[np.concatenate(([0], kept + 1))], stops[np.concatenate((kept, [len(stops) - 1]))]
    return [(float(time_s[a]), float(time_s[b])) for a, b in zip(starts, stops, strict=True)]
