"""Undo: the newest model of a chain is put aside (not deleted), and its parent is chosen again."""

import hashlib
import time

import msgspec

from thrustd.core.errors import ModelError, UsageError
from thrustd.model.artifact import write_model
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
        if wanted and name != model and wanted in _hashes(folder, name):
            return name
    raise UsageError(f"{model}: its parent is not in the folder; nothing to go back to")


def _hashes(folder: Folder, name: str) -> tuple[str, str]:
    """Of the file as it stands, and of the model written anew: numbers may be spelled differently."""
    plain = folder.path(name).read_bytes()
    try:
        again = write_model(folder.model(name)).encode()
    except ModelError:
        again = plain  # another model of the folder that cannot be read is no parent
    return hashlib.sha256(plain).hexdigest(), hashlib.sha256(again).hexdigest()
