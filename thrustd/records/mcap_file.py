"""MCAP: a recording as JSON rows on `/recording`, or a thrustd flight log (see `flight_log`).

Our own files carry one message per sample with the channel names as fields, so Foxglove and PlotJuggler plot them as
they are; a missing value is null. JSON writes a double with the shortest digits that read back to the same double.
"""

from collections.abc import Callable, Iterator
from itertools import chain
from pathlib import Path

import msgspec
import numpy as np
from mcap.writer import CompressionType, Writer

from thrustd.core.errors import LogError, RecordingError
from thrustd.records.flight_log import open_flight_log, read_flight_log
from thrustd.records.loaded import Loaded
from thrustd.records.recording import TIME, Recording
from thrustd.records.topics import Topic, append, level
from thrustd.sources.mcap_walk import McapWalk

TOPIC = "/recording"
METADATA_NAME = "thrustd.recording"
CHUNK_BYTES = 1 << 20


def read_mcap(path: Path, salvage: bool = False) -> Loaded:
    """`salvage`: what is whole of a damaged file; the notes say what is lost."""
    log = open_flight_log(path, salvage)
    if log is not None:
        return read_flight_log(log)
    topic, notes = Topic([], {}), list[str]()
    decode = msgspec.json.Decoder().decode
    try:
        with path.open("rb") as file:
            walk = McapWalk(file, path.name, lambda topic: topic == TOPIC, salvage)
            for message in chain.from_iterable(walk.records()):
                append(topic, message.log_ns, decode(message.data))
    except (LogError, msgspec.DecodeError, OSError) as error:
        raise RecordingError(f"{path.name}: not a readable MCAP file: {error}") from None
    level(topic)
    if walk.cut and not salvage:
        raise RecordingError(f"{path.name}: not a readable MCAP file: cut off; convert --salvage reads what is whole")
    if not topic.fields:
        raise RecordingError(f"{path.name}: no rows on topic {TOPIC!r} and not a thrustd flight log")
    notes += [walk.account()] if walk.gaps else []
    notes += ["file was cut off: read up to its last whole chunk"] if walk.cut else []
    metadata = walk.metadata.get(METADATA_NAME, {})
    return Loaded({name: np.array(column) for name, column in topic.fields.items()}, metadata, tuple(notes))


def write_mcap(record: Recording, path: Path) -> None:
    names = [TIME, *record.channels]
    schema = {
        "type": "object",
        "properties": {name: {"type": "number"} if name == TIME else {"type": ["number", "null"]} for name in names},
    }
    origin_s = min(0.0, float(record.time_s[0]))  # log times are unsigned
    encode = msgspec.json.Encoder().encode
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
        writer.start(profile="", library="thrustd")
        schema_id = writer.register_schema("thrustd.Recording", "jsonschema", encode(schema))
        channel_id = writer.register_channel(TOPIC, "json", schema_id)
        writer.add_metadata(METADATA_NAME, record.metadata)
        for number, row in enumerate(_rows(record)):
            log_ns = round((row[0] - origin_s) * 1e9)
            writer.add_message(channel_id, log_ns, encode(dict(zip(names, row, strict=True))), log_ns, number)
        finish: Callable[[], None] = writer.finish  # the library leaves it untyped
        finish()


def _rows(record: Recording, block: int = 1 << 16) -> Iterator[tuple[float, ...]]:
    columns = [record.time_s, *record.channels.values()]
    for start in range(0, len(record), block):
        yield from zip(*(column[start : start + block].tolist() for column in columns), strict=True)
