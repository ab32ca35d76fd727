"""A file that is written whole or not at all: under a temporary name beside it first."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from errno import EINVAL
from pathlib import Path

from thrustd.core.errors import ThrustdError, UsageError


@contextmanager
def whole_file(path: Path, error: type[ThrustdError] = UsageError) -> Iterator[Path]:
    """The name to write to; becomes `path` when the block ends well, else nothing is left. An OSError is an `error`."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        refuse_device(path)
        yield part
        os.replace(part, path)
    except OSError as problem:
        raise error(f"{path}: cannot be written: {problem.strerror or problem}") from problem
    finally:
        part.unlink(missing_ok=True)


def write_whole(path: Path, content: str | bytes, error: type[ThrustdError] = UsageError) -> None:
    """`content`, text as UTF-8, under `path`."""
    with whole_file(path, error) as part:
        part.write_bytes(content.encode() if isinstance(content, str) else content)


def refuse_device(path: Path) -> None:
    """A device, a pipe or a socket is never replaced by a file: root could. OSError."""
    if path.exists() and not (path.is_file() or path.is_dir()):  # a folder refuses by itself
        raise OSError(EINVAL, "it is a device, expected a file")


def sync_folder(folder: Path) -> None:
    """A name that was just given survives a power cut too. OSError goes through."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
