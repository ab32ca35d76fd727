"""What the page is looking at: chosen model and recordings, kept in a file so that a reload finds them."""

import re
from collections.abc import Mapping
from typing import Any

import msgspec

from thrustd.core.errors import UsageError
from thrustd.sinks.whole_file import write_whole
from thrustd.workbench.folder import Folder


class Session(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Names of files of the folder; empty = not chosen yet."""

    model: str = ""
    measured: tuple[str, ...] = ()  # recordings the model is asked about
    heldout: tuple[str, ...] = ()  # recordings kept back for the error ledger
    bench: tuple[str, ...] = ()  # recordings a first model is identified from
    exercise: str = ""  # folder of the running exercise
    unchecked: bool = False  # to go on without a recording to check on


CHECK = r"(holdout|heldout|test|valid)"  # how the file of a recording to check on begins
MEASURED, BENCH = r".*measured", r".*(bench|rig)"


def read_session(folder: Folder) -> Session:
    """The stored choice, less what is no longer in the folder, and with an obvious choice made."""
    try:
        kept = msgspec.json.decode((folder.state / "session.json").read_bytes(), type=Session)
    except (OSError, msgspec.DecodeError):
        kept = Session()
    models, records = set(folder.models()), folder.recordings()

    def there(names: tuple[str, ...], said: str) -> tuple[str, ...]:
        return tuple(name for name in names if name in records) or _named(records, said, kept.exercise)

    measured, bench = there(kept.measured, MEASURED), there(kept.bench, BENCH)
    heldout = there(kept.heldout, CHECK) if not kept.unchecked else ()
    return msgspec.structs.replace(
        kept,
        model=kept.model if kept.model in models else "",
        measured=measured,
        heldout=tuple(name for name in heldout if name not in (*measured, *bench)),
        bench=bench,
    )


def _named(records: list[str], said: str, exercise: str) -> tuple[str, ...]:
    """The recording whose name says what it is for, of the running exercise if there is one."""
    found = [name for name in records if re.match(said, name.rsplit("/", 1)[-1], re.I) and name.startswith(exercise)]
    return tuple(found[:1])


def write_session(folder: Folder, session: Session) -> None:
    write_whole(folder.state / "session.json", msgspec.json.encode(session))


def change_session(folder: Folder, body: bytes) -> Session:
    """Take the fields given in a JSON object; UsageError for anything else."""
    try:
        changes = msgspec.json.decode(body, type=dict[str, object])
        kept = msgspec.to_builtins(read_session(folder))
        session = msgspec.convert({**kept, **changes}, Session)
    except (msgspec.DecodeError, RecursionError) as problem:
        raise UsageError(f"session: {problem}") from None
    if session.model and session.model not in folder.models():
        raise UsageError(f"session: {session.model!r} is no model of the folder")
    fitted = {*session.measured, *session.bench} & set(session.heldout)
    if fitted and "heldout" in changes:
        raise UsageError(f"{min(fitted)}: what a model is fitted to cannot check it; expected another recording")
    rest = tuple(name for name in session.heldout if name not in fitted)  # what was the check is the measured one now
    session = msgspec.structs.replace(session, heldout=rest)
    write_session(folder, session)
    return session


def after_job(folder: Folder, kind: str, result: Mapping[str, Any]) -> None:
    """What a finished job makes the obvious choice, whether or not a page is open to see it."""
    session = read_session(folder)
    if kind == "exercise":
        write_session(folder, Session(exercise=result["exercise"]))
    elif kind in ("fit", "extend"):
        write_session(folder, msgspec.structs.replace(session, model=result["model"]))
