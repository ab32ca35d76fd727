"""Records as the joint regression reads them: every stretch without a gap, with all channels complete enough to use."""

from collections.abc import Sequence

import numpy as np

from thrustd.core.columns import Floats
from thrustd.identify.segments import Segment, bridged, segments_of
from thrustd.model.artifact import ModelSpec
from thrustd.model.compile import model_stages
from thrustd.records.recording import Recording

COMPLETE = 0.999  # share of a channel's samples that are there, from its first to its last
EDGES = 0.01  # of a record may lie before and after them: a slow sensor has not spoken yet


def stretches(spec: ModelSpec, records: Sequence[Recording], also: Sequence[str] = ()) -> list[Segment]:
    """Segments with what the model reads, what else is needed, and every channel that all records have."""
    needed = [*also] + [name for stage in model_stages(spec, 1.0) for name in stage.channels]
    return segments_of(records, dict.fromkeys([*needed, *shared(records), "time_s"]))


def shared(records: Sequence[Recording]) -> list[str]:
    """Columns of every record that are complete enough to be used as an input."""
    names = [name for name in records[0].channels if all(name in record for record in records)]
    return [name for name in names if name != "force_N" and all(complete(record[name]) for record in records)]


def complete(column: Floats) -> bool:
    """Whether a column misses so little that records can be read with it."""
    there = np.isfinite(bridged(column))
    inside = there[np.argmax(there) : len(there) - np.argmax(there[::-1])]
    return bool(inside.mean() > COMPLETE and len(inside) >= (1.0 - EDGES) * len(there))
