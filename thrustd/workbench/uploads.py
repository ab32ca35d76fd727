"""Files dropped on the page: bounded, kept aside until the worker has read them whole, never over an existing one."""

import os
import secrets

from starlette.requests import Request

from thrustd.core.errors import UsageError
from thrustd.workbench.folder import MODEL_TYPE, RECORDING_TYPES, Folder

MAX_UPLOAD_BYTES = 2 << 30


async def receive(folder: Folder, name: str, request: Request) -> str:
    """Store the body under `.thrustd/incoming/`; returns the name it has there."""
    target = folder.new_path(name)
    if target.suffix.lower() not in (*RECORDING_TYPES, MODEL_TYPE):
        types = ", ".join((*RECORDING_TYPES, MODEL_TYPE))
        raise UsageError(f"{name}: type {target.suffix or '(none)'!r}; expected one of {types}")
    if target.exists():
        raise UsageError(f"{name}: is already in the folder; rename the file first")
    incoming = folder.state / "incoming"
    incoming.mkdir(parents=True, exist_ok=True)
    part = incoming / f"{secrets.token_hex(8)}{target.suffix.lower()}"
    try:
        await _store(part, name, request)
    except OSError as problem:
        part.unlink(missing_ok=True)
        raise UsageError(f"{name}: cannot be stored here: {problem.strerror or problem}") from None
    except BaseException:
        part.unlink(missing_ok=True)
        raise
    return part.name


async def _store(part: "os.PathLike[str]", name: str, request: Request) -> None:
    size = 0
    with open(part, "xb") as file:
        async for block in request.stream():
            size += len(block)
            if size > MAX_UPLOAD_BYTES:
                raise UsageError(f"{name}: more than {MAX_UPLOAD_BYTES >> 20} MiB; copy it into the folder instead")
            file.write(block)
