"""Read and write recordings by file extension; a file is written whole or not at all."""

import hashlib
from collections.abc import Callable
from pathlib import Path

from thrustd.core.errors import RecordingError, one_line, printable
from thrustd.records.csv_file import read_csv, write_csv
from thrustd.records.loaded import Loaded
from thrustd.records.mat_file import read_mat, write_mat
from thrustd.records.mcap_file import read_mcap, write_mcap
from thrustd.records.npz_file import read_npz, write_npz
from thrustd.records.parquet_file import read_parquet, write_parquet
from thrustd.records.recording import Recording, make_recording
from thrustd.sinks.whole_file import whole_file
from thrustd.sources.plain_file import file_bytes

SHOWN_NOTES = 4
MAX_FILE_BYTES = 8 << 30  # read whole into memory: beyond this, cut the recording first

READERS: dict[str, Callable[[Path], Loaded]] = {
    ".csv": read_csv,
    ".parquet": read_parquet,
    ".npz": read_npz,
    ".mat": read_mat,
    ".mcap": read_mcap,
}
WRITERS: dict[str, Callable[[Recording, Path], None]] = {
    ".csv": write_csv,
    ".parquet": write_parquet,
    ".npz": write_npz,
    ".mat": write_mat,
    ".mcap": write_mcap,
}


def read_recording(path: Path | str, digest: bool = True) -> Recording:
    """Read a recording of any supported type; `digest`: with the SHA-256 of the file.

    Raises RecordingError with one line that names the file, the column or row, what stands there and what should.
    """
    path = Path(path)
    loaded = load(path)
    sha256 = file_sha256(path) if digest else ""
    return make_recording(path.name, loaded.columns, loaded.metadata, sha256, loaded.notes)


def load(path: Path, salvage: bool = False) -> Loaded:
    """The columns of a file as they are called there; at least one.

    `salvage`: what is whole of a damaged MCAP file; the notes say what is lost.
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise RecordingError(f"{path.name}: type {path.suffix or '(none)'!r}; expected one of {', '.join(READERS)}")
    _check_size(path)
    loaded = read_mcap(path, salvage) if reader is read_mcap else reader(path)
    for name in loaded.columns:
        if printable(name) != name or set(name) & {"\n", "\t"}:
            raise RecordingError(f"{path.name}: column name {name!r} holds control characters; expected plain text")
    loaded = loaded._replace(
        notes=tuple(map(one_line, loaded.notes)),
        metadata={printable(key): printable(text) for key, text in loaded.metadata.items()},
    )
    if not loaded.columns:
        found = "; ".join(loaded.notes[:SHOWN_NOTES]) or "it holds nothing"
        raise RecordingError(f"{path.name}: no column of numbers: {found}; expected one per channel (time_s, ...)")
    return loaded


def write_recording(record: Recording, path: Path | str) -> None:
    """Write by extension, whole or not at all."""
    path = Path(path)
    writer = WRITERS.get(path.suffix.lower())
    if writer is None:
        raise RecordingError(f"{path.name}: type {path.suffix or '(none)'!r}; expected one of {', '.join(WRITERS)}")
    with whole_file(path, RecordingError) as part:
        writer(record, part)


def _check_size(path: Path) -> None:
    size = file_bytes(path, RecordingError)
    try:
        path.open("rb").close()  # a reader that may not look inside would call it damaged
    except OSError as problem:
        raise RecordingError(f"{path}: cannot be read: {problem.strerror}") from None
    if size == 0:
        raise RecordingError(f"{path.name}: is empty")
    if size > MAX_FILE_BYTES:
        raise RecordingError(
            f"{path.name}: {size / 2**30:.1f} GiB; expected at most {MAX_FILE_BYTES / 2**30:.0f} GiB: cut it first"
        )


def file_sha256(path: Path) -> str:
    """Hexadecimal SHA-256 of the file as it is."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
