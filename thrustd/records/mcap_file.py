"""MCAP: a recording as JSON rows on `/recording`, or a thrustd flight log as columns.

Our own files carry one message per sample with the channel names as fields, so Foxglove and PlotJuggler plot them as
they are; a missing value is null. JSON writes a double with the shortest digits that read back to the same double.

A flight log becomes columns by topic: field `thrust_n` of `/estimate/left` is `estimate_thrust_n_left`, except where
the catalogue has a name for it (readings, mount deformations). The grid is the times of one estimate topic; other
topics are held from their last value before it.
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from thrustd.errors import RecordingError
from thrustd.records.loaded import Loaded
from thrustd.records.recording import TIME, FloatArray, Recording

TOPIC = "/recording"
METADATA_NAME = "thrustd.recording"
CHUNK_BYTES = 1 << 20


class Topic(NamedTuple):
    """Times and fields of one topic, as they came."""

    times_ns: list[int]
    fields: dict[str, list[float]]


def read_mcap(path: Path) -> Loaded:
    topics, metadata = _read_topics(path)
    if TOPIC in topics:
        return Loaded({name: np.array(column) for name, column in topics[TOPIC].fields.items()}, metadata)
    if not topics:
        raise RecordingError(f"{path.name}: no JSON messages; expected topic {TOPIC!r} or a thrustd flight log")
    return _flight_columns(path, topics, metadata)


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


def _read_topics(path: Path) -> tuple[dict[str, Topic], dict[str, str]]:
    topics: dict[str, Topic] = {}
    decode = msgspec.json.Decoder().decode
    try:
        with path.open("rb") as file:
            reader = make_reader(file, validate_crcs=True)
            metadata = {key: text for entry in reader.iter_metadata() for key, text in entry.metadata.items()}
            for _, channel, message in reader.iter_messages(log_time_order=False):
                if channel.message_encoding == "json":
                    topic = topics.setdefault(channel.topic, Topic([], {}))
                    _append(topic, message.log_time, decode(message.data))
    except (McapError, msgspec.DecodeError, EOFError, OSError) as error:
        raise RecordingError(f"{path.name}: not a readable MCAP file: {_one_line(error)}") from error
    for topic in topics.values():
        _level(topic)
    return topics, metadata


def _one_line(error: Exception) -> str:
    return " ".join(f"{type(error).__name__} {error}".split())[:160]


def _append(topic: Topic, time_ns: int, message: Any) -> None:
    """One row; a field that is missing, null or not a number is NaN there."""
    if not isinstance(message, dict):
        return
    _level(topic)
    topic.times_ns.append(time_ns)
    for name, value in message.items():
        if value is None or isinstance(value, int | float):
            column = topic.fields.get(name)
            if column is None:
                column = topic.fields[name] = [np.nan] * (len(topic.times_ns) - 1)
            column.append(np.nan if value is None else float(value))


def _level(topic: Topic) -> None:
    """Fill up the columns that the last row did not have."""
    count = len(topic.times_ns)
    for column in topic.fields.values():
        if len(column) < count:
            column.append(np.nan)


def _flight_columns(path: Path, topics: dict[str, Topic], metadata: dict[str, str]) -> Loaded:
    base = _base_topic(topics)
    if base is None:
        raise RecordingError(
            f"{path.name}: topics {', '.join(sorted(topics))}; expected {TOPIC!r} or '/estimate/...' of a thrustd log"
        )
    times_ns = np.unique(np.array(topics[base].times_ns, dtype=np.int64))
    columns: dict[str, FloatArray] = {TIME: times_ns / 1e9}
    for name, topic in sorted(topics.items()):
        if len(topic.times_ns) and not name.startswith("/fault"):
            columns |= _held(name, topic, times_ns)
    return Loaded(columns, {**metadata, "grid": base}, (f"flight log: columns held onto the times of {base}",))


def _base_topic(topics: dict[str, Topic]) -> str | None:
    for kind in ("/estimate/", "/mount/", "/truth/", "/reading/"):
        found = sorted(name for name in topics if name.startswith(kind) and topics[name].times_ns)
        if found:
            return found[0]
    return None


def _held(name: str, topic: Topic, times_ns: np.ndarray[Any, np.dtype[np.int64]]) -> dict[str, FloatArray]:
    order = np.argsort(topic.times_ns, kind="stable")
    at = np.searchsorted(np.array(topic.times_ns, dtype=np.int64)[order], times_ns, side="right") - 1
    kind, *rest = name.strip("/").split("/")
    held: dict[str, FloatArray] = {}
    for field, values in topic.fields.items():
        column = np.array(values)[order]
        held[_column_name(kind, rest, field)] = np.where(at >= 0, column[np.maximum(at, 0)], np.nan)
    return held


def _column_name(kind: str, rest: list[str], field: str) -> str:
    """`/reading/n1_pct/left` value -> n1_pct_left; `/mount/left_upper` deformation_mm -> deformation_mm_left_upper."""
    if kind == "reading" and field == "value":
        return "_".join(rest)
    plain = kind == "mount" and field == "deformation_mm"
    return "_".join(([] if plain else [kind]) + [field, *rest])
