"""The worker's part of drawing: recordings to columns, uploads to files, answers to reports."""

import os
from typing import Any

import msgspec
import numpy as np

from thrustd.core.errors import ThrustdError, UsageError
from thrustd.core.types import Progress
from thrustd.model.compile import read_proven_model
from thrustd.records.files import load
from thrustd.records.loaded import Loaded
from thrustd.records.recording import TIME, Recording
from thrustd.records.time_axis import timed
from thrustd.sinks.whole_file import write_whole
from thrustd.workbench.columns import forget_old, write_columns
from thrustd.workbench.folder import MODEL_TYPE, Folder
from thrustd.workbench.mapping import ColumnNames, table_of, table_wanted

ESTIMATE = "estimate_thrust_n_"


def prepare(folder: Folder, name: str, progress: Progress) -> dict[str, Any]:
    """Columns and pyramids of a recording, unless they are there already; of a file without time only its table."""
    if folder.columns(name) is None:
        progress(0.05, "reading")
        loaded = load(folder.path(name))
        mapping = _mapping(folder, name, loaded)
        if mapping.rate_hz is None and TIME not in {*loaded.columns, *(column.ours for column in mapping.columns)}:
            return {"recording": name, "unmapped": True}
        record = with_errors(timed(name.rsplit("/", 1)[-1], loaded, mapping.axis, mapping.renames))
        progress(0.7, "min/max pyramid")
        forget_old(folder.state)
        write_columns(folder.columns_folder(name), record)
    return {"recording": name}


def with_errors(record: Recording) -> Recording:
    """A flight whose truth is known, with the error of its fused thrust, estimate minus truth, N, per engine."""
    errors = {}
    for channel in record.channels:
        engine = channel.removeprefix(ESTIMATE)
        truth = next((name for name in (f"thrust_N_{engine}", f"truth_thrust_n_{engine}") if name in record), None)
        if channel.startswith(ESTIMATE) and truth is not None:
            errors[f"fused_minus_truth_{engine}_N"] = record[channel] - record[truth]
    return record.with_channels(**errors) if errors else record


def _mapping(folder: Folder, name: str, loaded: Loaded) -> ColumnNames:
    """How this file is read here; its table is kept for the page."""
    table = folder.table_path(name)
    if not table.exists() and table_wanted(name):
        table.parent.mkdir(parents=True, exist_ok=True)
        write_whole(table, msgspec.json.encode(table_of(loaded)))
    return folder.mapping(name)


def adopt(folder: Folder, incoming: str, name: str, progress: Progress) -> dict[str, Any]:
    """An uploaded file, read whole to prove it, then moved into the folder; else removed, with one line why."""
    part = folder.state / "incoming" / os.path.basename(incoming)
    try:
        progress(0.1, "checking")
        try:
            if part.suffix == MODEL_TYPE:
                read_proven_model(part.read_bytes(), name)
            else:
                load(part)
        except ThrustdError as problem:
            raise type(problem)(str(problem).replace(part.name, name)) from None
        target = folder.new_path(name)
        if target.exists():
            raise UsageError(f"{name}: is already in the folder")
        target.parent.mkdir(exist_ok=True)
        os.replace(part, target)
    finally:
        part.unlink(missing_ok=True)
    if target.suffix.lower() != MODEL_TYPE:
        prepare(folder, name, progress)
    return {"name": name}


def plain(value: Any) -> Any:
    """numpy's own numbers as Python's: a report may carry either."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value).__name__} has no place in a report")


def write_report(folder: Folder, number: str, value: Any) -> str:
    """Keep a report as JSON; returns its number."""
    reports = folder.state / "reports"
    reports.mkdir(parents=True, exist_ok=True)
    write_whole(reports / f"{number}.json", msgspec.json.encode(value, enc_hook=plain))
    return f"{number}.json"
