"""The ten lines that connect a source, the pipeline and the sinks."""

from collections.abc import Callable, Iterable

from thrustd.pipeline import Pipeline
from thrustd.types import Event, Fault, Output

Listen = Callable[[Output], None]
Record = Callable[[Event | Fault], None]


def run(events: Iterable[Event | Fault], pipeline: Pipeline, record: Record, listen: Listen) -> None:
    """Every event is recorded before it is worked on, every output handed to `listen`."""
    for event in events:
        record(event)
        for output in pipeline.feed(event):
            listen(output)
