"""The ten lines that connect a source, the pipeline and the sinks."""

from collections.abc import Callable, Iterable, Sequence

from thrustd.core.types import Output
from thrustd.pipeline.pipeline import Pipeline
from thrustd.wire.event_batch import EventBatch

Listen = Callable[[Sequence[Output]], None]
Record = Callable[[EventBatch], None]


def run(batches: Iterable[EventBatch], pipeline: Pipeline, record: Record, listen: Listen) -> None:
    """Every event is recorded before it is worked on; what a batch gives is handed to `listen` together."""
    for batch in batches:
        record(batch)
        listen(pipeline.take(batch))
