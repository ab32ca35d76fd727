"""Files that are read whole: plain ones of a bounded size. A device would never end, a pipe would never begin."""

import os
import stat
from pathlib import Path

from thrustd.core.errors import ThrustdError, UsageError

TEXT_BYTES = 8_000_000  # enough for any model, deck or list of marks
KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}


def read_text(path: Path, error: type[ThrustdError] = UsageError) -> str:
    """What a file of text says; an `error` where it is none."""
    try:
        return read_plain(path, TEXT_BYTES, error).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise error(f"{path}: not a text file") from None


def file_bytes(path: Path, error: type[ThrustdError], where: str = "") -> int:
    """The size of a plain file; an `error` that calls it `where` when it is none or is not there."""
    try:
        found = path.stat()
    except (OSError, ValueError) as problem:  # ValueError: a name with a zero byte
        raise error(f"{where or path}: cannot be read: {getattr(problem, 'strerror', problem)}") from None
    if not stat.S_ISREG(found.st_mode):
        kind = KINDS.get(stat.S_IFMT(found.st_mode), "something else")
        raise error(f"{where or path}: cannot be read: it is {kind}, expected a file")
    return found.st_size


def read_plain(path: Path, max_bytes: int, error: type[ThrustdError], where: str = "") -> bytes:
    """What is in a plain file of at most `max_bytes`; an `error` that calls it `where` otherwise."""
    size = file_bytes(path, error, where)
    try:
        # not blocking: what has become a pipe since then would wait for its writer
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK), "rb") as stream:
            content = stream.read(max_bytes + 1) if size <= max_bytes else None
    except OSError as problem:
        raise error(f"{where or path}: cannot be read: {problem.strerror}") from None
    if content is None or len(content) > max_bytes:
        raise error(f"{where or path}: {max(size, max_bytes + 1)} bytes, expected at most {max_bytes}")
    return content
