"""The same recording given twice would count twice: told by its content, whatever the files are called."""

import hashlib
from collections.abc import Sequence

from thrustd.core.errors import UsageError
from thrustd.records.recording import Recording


def columns_sha256(record: Recording) -> str:
    """Hash of times and columns; the file they came from, its name and its type are not in it."""
    digest = hashlib.sha256(record.time_s.tobytes())
    for name in sorted(record.channels):
        digest.update(name.encode())
        digest.update(record.channels[name].tobytes())
    return digest.hexdigest()


def check_once(seen: dict[str, str], name: str, sha256: str) -> None:
    """UsageError when `seen` (hash -> name) has this content; else it is put there."""
    if sha256 in seen:
        raise UsageError(f"{name}: the same recording as {seen[sha256]}; expected every recording once")
    seen[sha256] = name


def check_each_once(*groups: Sequence[Recording]) -> None:
    """UsageError when two recordings of a group have the same content."""
    for records in groups:
        seen: dict[str, str] = {}
        for record in records if len(records) > 1 else ():
            check_once(seen, record.name, columns_sha256(record))
