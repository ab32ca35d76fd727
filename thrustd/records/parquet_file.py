"""Parquet: one float64 column per channel, recording metadata as key-value pairs of the file."""

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import parquet

from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError
from thrustd.records.loaded import NUMBER_BYTES, Loaded, check_columns, check_expanded, read_metadata
from thrustd.records.recording import TIME, Recording, signal_of

METADATA_KEY = b"thrustd.metadata"


def read_parquet(path: Path) -> Loaded:
    try:
        about = parquet.read_metadata(path)
        check_columns(about.num_columns, path.name)
        check_expanded(path.stat().st_size, NUMBER_BYTES * about.num_rows * about.num_columns, path.name)
        table = parquet.read_table(path)
        names = table.column_names
    except RecordingError:
        raise
    except Exception as error:  # damage shows as ArrowInvalid, OSError, UnicodeDecodeError, MemoryError ...
        said = " ".join(str(error).split())[:160] or type(error).__name__
        raise RecordingError(f"{path.name}: not a readable Parquet file: {said}") from error
    columns: dict[str, Floats] = {}
    notes: list[str] = []
    for name, column in zip(names, table.columns, strict=True):
        if name in columns:
            raise RecordingError(f"{path.name}: column {name!r} appears twice; expected once")
        if _numeric(column.type):
            columns[name] = np.asarray(column.to_numpy(), dtype=np.float64)
        elif signal_of(name):
            raise RecordingError(f"{path.name}: {name} holds {column.type}; expected numbers")
        else:
            notes.append(f"{name}: {column.type} column left out")
    text = (table.schema.metadata or {}).get(METADATA_KEY)
    return Loaded(columns, read_metadata(text, path.name) if text else {}, tuple(notes))


def write_parquet(record: Recording, path: Path) -> None:
    table = pa.table({TIME: record.time_s, **record.channels})
    table = table.replace_schema_metadata({METADATA_KEY: json.dumps(record.metadata).encode()})
    parquet.write_table(table, path, compression="zstd", use_dictionary=False)


def _numeric(kind: pa.DataType) -> bool:
    return bool(pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_boolean(kind))
