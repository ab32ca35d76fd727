"""Tables of named values, a row per thing (a test point, a flight, an engine): CSV or Parquet, whole or not at all."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
from pyarrow import csv

from thrustd.core.errors import RecordingError, UsageError
from thrustd.sinks.whole_file import whole_file

Row = dict[str, Any]
TYPES = ".csv", ".parquet"


def write_rows(rows: Sequence[Row], path: Path) -> None:
    """By extension; a value that a row does not have is null, an empty cell in a CSV."""
    if path.suffix.lower() not in TYPES:
        raise UsageError(f"{path}: expected a name that ends in {' or '.join(TYPES)}")
    names = list(dict.fromkeys(name for row in rows for name in row))
    table = pa.Table.from_pydict({name: [row.get(name) for row in rows] for name in names})
    with whole_file(path, RecordingError) as part:
        if path.suffix.lower() == ".csv":
            csv.write_csv(table, part)
        else:
            pq.write_table(table, part)
