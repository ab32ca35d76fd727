"""CSV with one header line of canonical names: fast by pyarrow, exact to the last bit both ways.

Comma or tab separated, or semicolon with a decimal comma; where numbers have one, points stand between thousands. An
empty cell or `nan` is a missing value. A column outside the catalogue that holds no number at all (remarks, dates) is
left out and reported; text among numbers is an error.
"""

import re
from collections import Counter
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import csv

from thrustd.core.columns import Floats
from thrustd.core.errors import RecordingError
from thrustd.records.dates import CALLED, EXPECTED, seconds
from thrustd.records.loaded import Loaded, check_columns
from thrustd.records.recording import TIME, Recording, signal_of

MISSING = ["", "nan", "NaN", "NAN", "null"]
SHOWN_NAMES = 4
HEADER_BYTES = 1 << 20
THOUSANDS = re.compile(r"\s*[+-]?[1-9]\d{0,2}(\.\d{3})+(,\d*)?\s*")  # 1.027 or 1.027,30, beside decimal commas
BLOCK_BYTES = 16 << 20  # parsed at a time; pyarrow's own 1 MiB takes a fifth longer


def read_csv(path: Path) -> Loaded:
    names, delimiter = _header(path)
    parse = csv.ParseOptions(delimiter=delimiter)
    options = csv.ReadOptions(block_size=BLOCK_BYTES, column_names=names, skip_rows=1)
    try:
        table = csv.read_csv(path, options, parse, _convert(names, pa.float64(), delimiter))
    except pa.ArrowInvalid as error:
        return _read_text(path, names, delimiter, error)
    return Loaded({name: _numbers(table.column(name)) for name in names}, {})


def write_csv(record: Recording, path: Path) -> None:
    for name in record.channels:
        if any(sign in name for sign in ',;"\t\r\n'):
            raise RecordingError(f"{path.name}: column name {name!r} cannot stand in a CSV header; rename it")
    table = pa.table({TIME: record.time_s, **record.channels})
    with path.open("wb") as file:
        file.write((",".join(table.column_names) + "\n").encode())
        for batch in table.to_batches(max_chunksize=1 << 16):
            csv.write_csv(batch, file, csv.WriteOptions(include_header=False))


def _header(path: Path) -> tuple[list[str], str]:
    with path.open("rb") as file:
        raw = file.readline(HEADER_BYTES)
    if len(raw) == HEADER_BYTES:
        raise RecordingError(f"{path.name}: its first line has more than {HEADER_BYTES} bytes; expected channel names")
    line = raw.decode("utf-8-sig", errors="replace").strip("\r\n")
    if "\ufffd" in line or not line.replace("\t", "").isprintable():
        what = "not UTF-8 text" if "\ufffd" in line or "\0" in line else "control characters in its first line"
        raise RecordingError(f"{path.name}: {what}; expected a CSV file with one header line of channel names")
    delimiter = max((sign for sign in ";\t," if sign in line), key=line.count, default=",")
    names = [name.strip().strip('"') for name in line.split(delimiter)]
    if all(_number(name.replace(",", ".")) is not None for name in names):
        shown = ", ".join(names[:SHOWN_NAMES])
        raise RecordingError(
            f"{path.name}: its first line is no header: {shown or 'nothing in it'}; "
            "expected one line of channel names, such as time_s,deformation_mm,force_N"
        )
    check_columns(len(names), path.name)
    counts = Counter(names)
    name, times = max(counts.items(), key=lambda item: (item[1] > 1, item[0]))
    if times > 1:
        raise RecordingError(f"{path.name}: column {name!r} appears {times} times; expected once")
    return names, delimiter


def _convert(names: list[str], kind: pa.DataType, delimiter: str) -> csv.ConvertOptions:
    return csv.ConvertOptions(
        column_types=dict.fromkeys(names, kind),
        null_values=MISSING,
        strings_can_be_null=False,
        decimal_point="," if delimiter == ";" else ".",
    )


def _numbers(column: pa.ChunkedArray) -> Floats:
    return np.asarray(column.to_numpy(), dtype=np.float64)  # nulls become NaN


def _read_text(path: Path, names: list[str], delimiter: str, error: Exception) -> Loaded:
    """The slow way, after pyarrow refused: find the cell, or leave remark columns out."""
    try:
        table = csv.read_csv(
            path,
            csv.ReadOptions(column_names=names, skip_rows=1),
            csv.ParseOptions(delimiter=delimiter),
            _convert(names, pa.string(), delimiter),
        )
    except pa.ArrowInvalid as broken:
        raise RecordingError(
            f"{path.name}: not a rectangular CSV: {_one_line(broken)}; expected a line of names, then as many numbers"
        ) from error
    texts = {name: table.column(name).to_pylist() for name in names}
    comma = delimiter == ";" and any(
        "," in cell and _number(cell, True) is not None for cells in texts.values() for cell in cells
    )
    columns: dict[str, Floats] = {}
    notes: list[str] = []
    for name, cells in texts.items():
        values = [_number(cell, comma) for cell in cells]
        bad = [row for row, value in enumerate(values) if value is None]
        if not bad:
            columns[name] = np.array(values, dtype=np.float64)
        elif name == TIME and (since_s := seconds(table.column(name))) is not None:
            columns[name] = since_s
            notes.append(f"{TIME}: seconds since {cells[0]}")
        elif len(bad) == len(cells) and signal_of(name) is None:
            times = TIME not in names and seconds(table.column(name).slice(0, 1)) is not None
            notes.append(f"{name}: text column left out{CALLED if times else ''}")
        else:
            raise RecordingError(
                f"{path.name}: {name} is {cells[bad[0]]!r} in data row {bad[0] + 1}; {_expected(name, cells[bad[0]])}"
            )
    return Loaded(columns, {}, tuple(notes))


def _number(cell: str, comma: bool = False) -> float | None:
    """What a cell stands for, None where it is no number; comma: the file's numbers have decimal commas."""
    if cell in MISSING:
        return np.nan
    if comma and "." in cell and not THOUSANDS.fullmatch(cell):
        return None
    try:
        return float(cell.replace(".", "").replace(",", ".") if comma else cell)
    except ValueError:
        return None


def _expected(name: str, cell: str) -> str:
    if _number(cell) is None:
        return EXPECTED if name == TIME else "expected a number"
    return "expected a decimal comma, as elsewhere in the file, and points between thousands only"


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())[:160]
