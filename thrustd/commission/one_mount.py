"""One mount's benches identified, here or in a process of its own: `python -m thrustd.commission.one_mount`.

A long bench takes half a minute, and models of different benches share nothing. Numbers travel as their bits, the model
as its file: it is the same to the byte whichever process has made it.
"""

from collections.abc import Callable, Sequence

import msgspec
import numpy as np

from thrustd.commission.beside import answers, serve
from thrustd.core.errors import RecordingError, ThrustdError
from thrustd.identify.identify import identify
from thrustd.model.artifact import write_model
from thrustd.records.recording import Recording


class Answer(msgspec.Struct, frozen=True):
    """What came of it."""

    model: str = ""  # as its file
    train_n: float = 0.0
    unseen_n: float = 0.0  # on data not used
    lines: tuple[str, ...] = ()  # to tell of it
    problem: str = ""  # why there is none


class _Bench(msgspec.Struct, frozen=True):
    name: str
    time_s: bytes
    channels: dict[str, bytes]
    metadata: dict[str, str]
    sha256: str
    notes: tuple[str, ...]


class _Question(msgspec.Struct, frozen=True):
    mount: str
    benches: tuple[_Bench, ...]


def identified(mount: str, records: Sequence[Recording]) -> Answer:
    """RecordingError where a constant would do better."""
    found = identify(records, name=mount.replace("_", "-"))
    if not found.usable:
        raise RecordingError(f"--bench {mount}: {found.warnings[0]}")
    best = min((s for s in found.scores if s.validation.stable), key=lambda s: s.validation.rmse_n)
    return Answer(write_model(found.spec), best.train.rmse_n, best.validation.rmse_n, found.warnings)


def all_identified(given: Sequence[tuple[str, Sequence[Recording]]], told: Callable[[int], None]) -> list[Answer]:
    """The same of several mounts, side by side."""
    asked = [msgspec.msgpack.encode(_Question(mount, tuple(map(_packed, records)))) for mount, records in given]
    found = [msgspec.msgpack.decode(said, type=Answer) for said in answers(__name__, asked, told)]
    for answer in found:
        if answer.problem:
            raise RecordingError(answer.problem)
    return found


def _packed(record: Recording) -> _Bench:
    channels = {name: column.tobytes() for name, column in record.channels.items()}
    return _Bench(record.name, record.time_s.tobytes(), channels, record.metadata, record.sha256, record.notes)


def _unpacked(bench: _Bench) -> Recording:
    channels = {name: np.frombuffer(column).copy() for name, column in bench.channels.items()}
    return Recording(
        bench.name, np.frombuffer(bench.time_s).copy(), channels, bench.metadata, bench.sha256, bench.notes
    )


def _answered(asked: bytes) -> bytes:
    question = msgspec.msgpack.decode(asked, type=_Question)
    try:
        said = identified(question.mount, [_unpacked(bench) for bench in question.benches])
    except ThrustdError as problem:
        said = Answer(problem=str(problem))
    return msgspec.msgpack.encode(said)


if __name__ == "__main__":
    serve(_answered)
