"""A file, or a folder of files, that is written whole or not at all: under a temporary name beside it first."""

import os
import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from errno import EINVAL
from fcntl import LOCK_EX, LOCK_NB, flock
from glob import escape
from pathlib import Path
from tempfile import mkdtemp

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


@contextmanager
def whole_folder(path: Path) -> Iterator[Path]:
    """The name to make; becomes `path`, absent or an empty folder, when the block ends well, else nothing is left.

    What a process that was killed left beside it goes first: nobody locks that any more.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    for left in path.parent.glob(f".{escape(path.name)}.draft.*"):
        with _locked(left, LOCK_EX | LOCK_NB) as abandoned:
            if abandoned:
                shutil.rmtree(left, ignore_errors=True)
    try:
        with _draft(path) as draft:
            yield draft / path.name
            if path.exists():
                path.rmdir()
            os.replace(draft / path.name, path)
    except OSError as problem:
        if problem.filename is None:  # a disk that is full: who writes is not told where
            problem.filename = str(path)
        raise


@contextmanager
def _draft(path: Path) -> Iterator[Path]:
    """A folder beside `path` that this process has locked; it goes with the block."""
    with ExitStack() as held:
        draft = None
        while draft is None or not draft.exists():  # another process may take it away before it is locked
            draft = Path(mkdtemp(dir=path.parent, prefix=f".{path.name}.draft."))
            held.callback(shutil.rmtree, draft, ignore_errors=True)
            held.enter_context(_locked(draft, LOCK_EX))
        yield draft


@contextmanager
def _locked(folder: Path, how: int) -> Iterator[bool]:
    """Whether it is this process's; the kernel unlocks it whichever way the process ends."""
    with ExitStack() as opened:
        try:
            descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
            opened.callback(os.close, descriptor)
            flock(descriptor, how)
            mine = True
        except OSError:  # another's, gone, no folder, or on a disk without locks
            mine = False
        yield mine


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
