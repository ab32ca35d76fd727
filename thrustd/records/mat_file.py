"""MATLAB v5 files: a vector per channel, in a structure or not, or the `flightdata` of a PH-LAB FTIS export."""

import math
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat, savemat, whosmat

from thrustd.core.errors import RecordingError
from thrustd.records.loaded import NUMBER_BYTES, Loaded, check_expanded, most_expanded, vectors
from thrustd.records.mat_tags import HEAD_BYTES, check_elements
from thrustd.records.phlab import from_ph_lab
from thrustd.records.recording import TIME, Recording

VERSION_5 = 1


def read_mat(path: Path) -> Loaded:
    variables = _variables(path)
    units: dict[str, str] = {}
    if "flightdata" in variables:
        variables, units = _ftis_fields(variables["flightdata"])
    arrays = {name: np.atleast_1d(value) for name, value in _flat(variables).items() if not name.startswith("__")}
    found = vectors(arrays, path.name)
    return from_ph_lab(found.columns, units, path.name) or found


def _variables(path: Path) -> dict[str, Any]:
    try:
        numbers = sum(math.prod(shape) for _, shape, _ in whosmat(path))
        check_expanded(path.stat().st_size, NUMBER_BYTES * numbers, path.name)
        _check_tags(path)
        variables: dict[str, Any] = loadmat(path, squeeze_me=True, struct_as_record=False)
    except RecordingError:
        raise
    except NotImplementedError as error:
        raise RecordingError(f"{path.name}: MATLAB 7.3 file; save it with '-v7' for thrustd") from error
    except Exception as error:  # a damaged file makes scipy raise almost anything
        raise RecordingError(
            f"{path.name}: not a readable MATLAB v5 file: {' '.join(str(error).split())[:160]}"
        ) from error
    return variables


def _check_tags(path: Path) -> None:
    """ValueError on tags that would crash scipy's reader."""
    with path.open("rb") as file:
        head = file.read(HEAD_BYTES)
        if len(head) < HEAD_BYTES or 0 in head[:4] or head[125 if head[126:127] == b"I" else 124] != VERSION_5:
            return  # of another version: scipy says which, and reads the fourth without compiled code
        content = memoryview(mmap(file.fileno(), 0, access=ACCESS_READ))
        check_elements(content, most_expanded(len(content)))


def write_mat(record: Recording, path: Path) -> None:
    for name in record.channels:
        if not name.isidentifier() or name.startswith("_") or len(name) > 63:
            raise RecordingError(f"{path.name}: column name {name!r} is not a MATLAB variable name; rename it")
    with path.open("wb") as file:
        savemat(file, {TIME: record.time_s, **record.channels}, oned_as="column", do_compression=True)


def _flat(variables: dict[str, Any]) -> dict[str, Any]:
    """A structure gives its fields, under their own names where these are free."""
    flat: dict[str, Any] = {}
    for name, value in variables.items():
        for field in getattr(value, "_fieldnames", ()):
            flat[field if field not in variables and field not in flat else f"{name}_{field}"] = getattr(value, field)
        if not hasattr(value, "_fieldnames"):
            flat[name] = value
    return flat


def _ftis_fields(flightdata: Any) -> tuple[dict[str, Any], dict[str, str]]:
    """`flightdata.<name>.data` and `.units`, as the FTIS export lays them out."""
    fields = getattr(flightdata, "_fieldnames", [])
    data = {name: getattr(getattr(flightdata, name), "data", np.empty(0)) for name in fields}
    units = {name: str(getattr(getattr(flightdata, name), "units", "")) for name in fields}
    return data, units
