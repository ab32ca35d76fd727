"""numpy archives: ours (one array per channel), and the two PH-LAB kinds, told apart by their arrays."""

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from thrustd.core.errors import RecordingError
from thrustd.records.loaded import Loaded
from thrustd.records.phlab import from_ftis, from_openap, is_ftis, is_openap
from thrustd.records.recording import TIME, FloatArray, Recording, signal_of

METADATA_NAME = "_metadata"


def read_npz(path: Path) -> Loaded:
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except (OSError, ValueError, zipfile.BadZipFile, EOFError) as error:
        raise RecordingError(
            f"{path.name}: not a readable npz archive: {' '.join(str(error).split())[:160]}"
        ) from error
    columns: dict[str, FloatArray] = {}
    notes: list[str] = []
    for name, array in arrays.items():
        if array.dtype.kind in "fiub" and array.ndim == 1:
            columns[name] = array.astype(np.float64, copy=False)
        elif not name.startswith("_") and signal_of(name):
            raise RecordingError(f"{path.name}: {name} has shape {array.shape} of {array.dtype}; expected 1-D numbers")
        elif not name.startswith("_"):
            notes.append(f"{name}: shape {array.shape} of {array.dtype} left out")
    if is_ftis(columns):
        return from_ftis(columns, _units(arrays))
    if is_openap(columns):
        return from_openap(columns)
    metadata = json.loads(str(arrays[METADATA_NAME])) if METADATA_NAME in arrays else {}
    return Loaded(columns, metadata, tuple(notes))


def write_npz(record: Recording, path: Path) -> None:
    arrays = {TIME: record.time_s, **record.channels, METADATA_NAME: np.array(json.dumps(record.metadata))}
    # np.savez takes names as keyword arguments, which collide with its own: write the members directly
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, array, allow_pickle=False)


def _units(arrays: dict[str, npt.NDArray[Any]]) -> dict[str, str]:
    if "_names" not in arrays or "_units" not in arrays:
        return {}
    return dict(zip(map(str, arrays["_names"]), map(str, arrays["_units"]), strict=False))
