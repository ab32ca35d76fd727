"""A file that is written whole or not at all: under a temporary name beside it first."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from thrustd.core.errors import ThrustdError, UsageError


@contextmanager
def whole_file(path: Path, error: type[ThrustdError] = UsageError) -> Iterator[Path]:
    """The name to write to; becomes `path` when the block ends well, else nothing is left. An OSError is an `error`."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        yield part
        os.replace(part, path)
    except OSError as problem:
        raise error(f"{path}: cannot be written: {problem.strerror or problem}") from problem
    finally:
        part.unlink(missing_ok=True)
