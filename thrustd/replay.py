"""Run a log through the pipeline again: write the estimates, score them against the truth where there is one."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec

from thrustd.errors import LogError
from thrustd.flight_picture import FlightPicture
from thrustd.flight_score import FlightScore, Score, TruthRow
from thrustd.installation import WARM_START, Installation, WarmStart, installation_from_files
from thrustd.loop import run
from thrustd.sinks.mcap_log import LogWriter, new_log
from thrustd.sources.mcap_log import LogFile
from thrustd.types import Estimate, Event, Fault, Output

PROGRESS_EVERY = 5000  # events


class ReplaySummary(msgspec.Struct, frozen=True):
    """What a replay did."""

    log: str
    length_s: float
    events: int
    missing_events: int
    cut: bool  # the log ended without a summary: the recorder was killed
    estimates: int
    scores: dict[str, dict[str, Score]]  # engine or mount -> route -> error against the truth; empty without truth
    faults: dict[str, int]  # "where kind" -> count


def open_installation(log: LogFile, config: Installation | None) -> Installation:
    """The given installation, or the one kept in the log."""
    if config is not None:
        return config
    files = {name: text.encode() for name, text in log.header.files.items()}
    return installation_from_files(files, str(log.path))


def replay(
    path: Path,
    out: Path | None,
    config: Installation | None = None,
    pace: Callable[[Iterator[Event]], Iterator[Event]] = iter,
    advance: Callable[[float], None] = lambda fraction: None,
    picture: FlightPicture | None = None,
) -> ReplaySummary:
    """Replay the log at `path`; outputs and truth go to the log `out`, estimates to `picture`.

    `pace` may delay the events (playback at --speed 1); `advance` hears the fraction done.
    """
    log = LogFile(path)
    installation = open_installation(log, config)
    pipeline, _ = installation.warm_pipeline(_start_of(log) if config is None else None)
    score = flight_score(installation)
    score.follow(truth_rows(log.path))
    count = _Count(log, advance)

    def take(output: Output) -> None:
        score.take(output)
        if picture is not None and isinstance(output, Estimate):
            name = installation.config.aircraft.engines[output.engine]
            picture.take(name, output, score.truth_n(name))

    if out is None:
        run(pace(log.events()), pipeline, count, take)
    else:
        source = log.header
        header = installation.log_header(epoch_offset_ns=source.epoch_offset_ns, run=source.run, notes=source.notes)
        with new_log(out, header) as writer:
            _run_into(writer, pace(log.events()), pipeline, count, take)
            _copy_truth(log.path, writer)
    advance(1.0)
    return _summary(log, score, count.events)


def _start_of(log: LogFile) -> WarmStart | None:
    """The state that the recorded run took over from the one before, when it did."""
    note = log.header.notes.get(WARM_START)
    if note is None or log.header.part > 0:
        return None
    try:
        return msgspec.json.decode(note, type=WarmStart)
    except msgspec.DecodeError:
        raise LogError(f"{log.path}: header note {WARM_START!r} is not a snapshot") from None


def flight_score(installation: Installation) -> FlightScore:
    config = installation.config
    mounts = tuple(mount.name for mount in config.mount)
    engines = config.aircraft.engines
    return FlightScore(tuple(engines), mounts, tuple(len(config.mounts_of(engine)) for engine in engines))


def truth_rows(path: Path) -> Iterator[TruthRow]:
    """What a simulated flight really did, in file order; nothing for a real one."""
    log = LogFile(path)
    for message in log.messages():
        if message.topic.startswith("/truth/"):
            row: dict[str, Any] = msgspec.json.decode(message.data)
            value_n = row["thrust_n"] if "thrust_n" in row else row["force_n"]
            yield TruthRow(message.topic.removeprefix("/truth/"), row["t_ns"], value_n)


class _Count:
    """Counts events and says how far the file is."""

    def __init__(self, log: LogFile, advance: Callable[[float], None]) -> None:
        self.events = 0
        self._log, self._advance = log, advance

    def __call__(self, event: Event | Fault) -> None:
        self.events += 1
        if self.events % PROGRESS_EVERY == 0:
            self._advance(self._log.position_bytes / max(self._log.size_bytes, 1))


def _run_into(
    writer: LogWriter, events: Iterator[Event], pipeline: Any, count: _Count, listen: Callable[[Output], None]
) -> None:
    def both(output: Output) -> None:
        writer.write_output(output)
        listen(output)

    run(events, pipeline, count, both)


def _copy_truth(path: Path, writer: LogWriter) -> None:
    for row in truth_rows(path):
        writer.write_truth(row.name, row.t_ns, row.value_n)


def _summary(log: LogFile, score: FlightScore, events: int) -> ReplaySummary:
    return ReplaySummary(
        log=log.path.name,
        length_s=max(score.last_ns - score.first_ns, 0) * 1e-9,
        events=events,
        missing_events=log.missing_events,
        cut=log.cut,
        estimates=score.estimates,
        scores=score.scores(),
        faults={f"{where} {kind}": n for (where, kind), n in sorted(score.faults.items())},
    )
