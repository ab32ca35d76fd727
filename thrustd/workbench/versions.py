"""Undo: the newest model of a chain is put aside (not deleted), and its parent is chosen again."""

import time

import msgspec

from thrustd.errors import UsageError
from thrustd.workbench.folder import Folder
from thrustd.workbench.session import Session, read_session, write_session


def undo(folder: Folder, model: str) -> Session:
    """Move `model` to `.thrustd/undone/`; UsageError when it is nobody's child."""
    parent = parent_of(folder, model)
    undone = folder.state / "undone"
    undone.mkdir(parents=True, exist_ok=True)
    path = folder.path(model)
    path.rename(undone / f"{time.time_ns()}-{path.name}")
    session = msgspec.structs.replace(read_session(folder), model=parent)
    write_session(folder, session)
    return session


def parent_of(folder: Folder, model: str) -> str:
    """The file in the folder that `model` was extended from."""
    ledger = folder.model(model).ledger
    wanted = ledger[-1].parent_sha256 if ledger else ""
    for name in folder.models():
        if wanted and name != model and file_sha256(folder, name) == wanted:
            return name
    raise UsageError(f"{model}: its parent is not in the folder; nothing to go back to")


def file_sha256(folder: Folder, name: str) -> str:
    import hashlib

    return hashlib.sha256(folder.path(name).read_bytes()).hexdigest()
