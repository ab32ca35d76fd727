"""Parts of a record that are held back: the model runs through them, their samples carry no weight."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from thrustd.identify.segments import Segment

PARTS, EVERY = 40, 4  # blocks of a record; every such one is held back
SHOWN = 20_000  # samples that count while hypotheses meet


def spread(segments: Sequence[Segment]) -> list[Segment]:
    """With every n-th reference left, so that about SHOWN remain; the memory runs through all samples."""
    step = max(1, round(sum(map(len, segments)) / SHOWN))
    counted = [np.arange(len(segment)) % step == 0 for segment in segments]
    return [replace(s, force_n=np.where(c, s.force_n, np.nan)) for s, c in zip(segments, counted, strict=True)]


def parts(segment: Segment) -> list[slice]:
    edges = np.linspace(0, len(segment), PARTS + 1).astype(int)
    return [slice(edges[i], edges[i + 1]) for i in range(EVERY - 2, PARTS, EVERY)]


def hidden(segment: Segment) -> Segment:
    force_n = segment.force_n.copy()
    for part in parts(segment):
        force_n[part] = np.nan
    return replace(segment, force_n=force_n)
