"""Parquet: one float64 column per channel, recording metadata as key-value pairs of the file."""

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import parquet

from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError
from thrustd.records.dates import CALLED, seconds
from thrustd.records.loaded import NUMBER_BYTES, Loaded, check_columns, check_expanded, read_metadata
from thrustd.records.recording import TIME, Recording, signal_of

METADATA_KEY = b"thrustd.metadata"


def read_parquet(path: Path) -> Loaded:
    """Columns of numbers alone are unpacked: a kilobyte of lists or texts may stand for all memory."""
    try:
        with parquet.ParquetFile(path, pre_buffer=True) as file:
            names, notes = _numbers(file, path)
            table = file.read(columns=names)
            text = (file.schema_arrow.metadata or {}).get(METADATA_KEY)
        columns = {name: _floats(table.column(name)) for name in names}
    except RecordingError:
        raise
    except Exception as error:  # damage shows as ArrowInvalid, OSError, UnicodeDecodeError, MemoryError ...
        said = " ".join(str(error).split())[:160] or type(error).__name__
        raise RecordingError(f"{path.name}: not a readable Parquet file: {said}") from error
    return Loaded(columns, read_metadata(text, path.name) if text else {}, notes)


def _numbers(file: parquet.ParquetFile, path: Path) -> tuple[list[str], tuple[str, ...]]:
    """Names of the columns of numbers, and a word on each of the others."""
    about, schema = file.metadata, file.schema_arrow
    check_columns(about.num_columns, path.name)
    check_expanded(path.stat().st_size, NUMBER_BYTES * about.num_rows * about.num_columns, path.name)
    names: list[str] = []
    notes: list[str] = []
    for field in schema:
        if schema.names.count(field.name) > 1:
            raise RecordingError(f"{path.name}: column {field.name!r} appears twice; expected once")
        if _numeric(field.type) or (field.name == TIME and pa.types.is_temporal(field.type)):
            names.append(field.name)
        elif signal_of(field.name):
            raise RecordingError(f"{path.name}: {field.name} holds {field.type}; expected numbers")
        else:
            times = TIME not in schema.names and pa.types.is_temporal(field.type)
            notes.append(f"{field.name}: {field.type} column left out{CALLED if times else ''}")
    return names, tuple(notes)


def write_parquet(record: Recording, path: Path) -> None:
    table = pa.table({TIME: record.time_s, **record.channels})
    table = table.replace_schema_metadata({METADATA_KEY: json.dumps(record.metadata).encode()})
    parquet.write_table(table, path, compression="zstd", use_dictionary=False)


def _floats(column: pa.ChunkedArray) -> Floats:
    since_s = seconds(column) if pa.types.is_temporal(column.type) else None
    return np.asarray(column.to_numpy(), dtype=np.float64) if since_s is None else since_s


def _numeric(kind: pa.DataType) -> bool:
    return bool(pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_boolean(kind))
