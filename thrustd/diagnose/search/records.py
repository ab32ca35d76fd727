"""Records as the joint regression reads them: every stretch without a gap, with all channels complete enough to use."""

from collections.abc import Sequence

import numpy as np

from thrustd.identify.segments import Segment, bridged, segments_of
from thrustd.model.artifact import ModelSpec
from thrustd.model.compile import model_stages
from thrustd.records.recording import Recording

COMPLETE = 0.999  # share of a channel's samples that are there


def stretches(spec: ModelSpec, records: Sequence[Recording]) -> list[Segment]:
    """Segments with what the model reads and every channel that all records have."""
    needed = [name for stage in model_stages(spec, 1.0) for name in stage.channels]
    return segments_of(records, dict.fromkeys([*needed, *shared(records), "time_s"]))


def shared(records: Sequence[Recording]) -> list[str]:
    """Columns of every record that are complete enough to be used as an input."""
    names = [name for name in records[0].channels if all(name in record for record in records)]
    return [
        name
        for name in names
        if name != "force_N" and all(np.isfinite(bridged(record[name])).mean() > COMPLETE for record in records)
    ]
