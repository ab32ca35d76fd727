"""numpy archives: ours (one array per channel), and the two PH-LAB kinds, told apart by their arrays."""

import json
import math
import zipfile
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from thrustd.core.errors import RecordingError
from thrustd.records.loaded import Loaded, check_columns, check_expanded, read_metadata, vectors
from thrustd.records.phlab import from_ph_lab
from thrustd.records.recording import TIME, Recording

METADATA_NAME = "_metadata"
NAMES, UNITS = "_names", "_units"  # of PH-LAB's
OURS = METADATA_NAME, NAMES, UNITS


def read_npz(path: Path) -> Loaded:
    arrays = _arrays(path)
    found = vectors({name: array for name, array in arrays.items() if name not in OURS}, path.name)
    metadata = read_metadata(str(arrays[METADATA_NAME]), path.name) if METADATA_NAME in arrays else {}
    return from_ph_lab(found.columns, _units(arrays), path.name) or found._replace(metadata=metadata)


def _arrays(path: Path) -> dict[str, npt.NDArray[Any]]:
    try:
        with zipfile.ZipFile(path) as archive:
            members = {_name(member): member for member in archive.infolist()}
            if twice := [name for name, n in Counter(map(_name, archive.infolist())).items() if n > 1]:
                raise RecordingError(f"{path.name}: '{twice[0]}' is in it more than once, expected one array of a name")
            check_columns(len(members), path.name)
            check_expanded(path.stat().st_size, sum(member.file_size for member in members.values()), path.name)
            return {name: _array(archive, member) for name, member in members.items()}
    except RecordingError:
        raise
    except Exception as error:  # damage shows as zlib.error, KeyError, NotImplementedError, MemoryError ...
        said = " ".join(str(error).split())[:160] or type(error).__name__
        raise RecordingError(f"{path.name}: not a readable npz archive: {said}") from error


def _name(member: zipfile.ZipInfo) -> str:
    return member.filename.removesuffix(".npy")


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> npt.NDArray[Any]:
    """What the header promises must fit into the member before anything is allocated."""
    with archive.open(member) as stream:
        version = np.lib.format.read_magic(stream)
        read_header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, kind = read_header(stream)
    if kind.itemsize * math.prod(shape) > member.file_size:
        raise ValueError(f"{member.filename}: {shape} of {kind} do not fit into {member.file_size} bytes")
    with archive.open(member) as stream:
        return np.lib.format.read_array(stream, allow_pickle=False)


def write_npz(record: Recording, path: Path) -> None:
    arrays = {TIME: record.time_s, **record.channels, METADATA_NAME: np.array(json.dumps(record.metadata))}
    # np.savez takes names as keyword arguments, which collide with its own: write the members directly
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, array, allow_pickle=False)


def _units(arrays: dict[str, npt.NDArray[Any]]) -> dict[str, str]:
    names, units = (np.atleast_1d(arrays.get(key, ())) for key in (NAMES, UNITS))
    return dict(zip(map(str, names), map(str, units), strict=False))
