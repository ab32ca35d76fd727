"""Run a log through the pipeline again: write the estimates, score them against the truth where there is one."""

import gc
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from math import isfinite, nan
from pathlib import Path
from typing import Final

import msgspec

from thrustd.errors import LogError
from thrustd.flight_picture import FlightPicture
from thrustd.flight_score import FlightScore, Score, TruthRow
from thrustd.installation import WARM_START, Installation, WarmStart, installation_from_files
from thrustd.loop import run
from thrustd.sinks.mcap_log import new_log
from thrustd.sources.log_run import LogRun
from thrustd.sources.mcap_log import LogFile, LogMessage
from thrustd.types import Estimate, Event, Output
from thrustd.wire.event_batch import EventBatch
from thrustd.wire.log_layout import TRUTH_TOPIC, LogHeader

_new: Final = tuple.__new__  # half the time of calling a NamedTuple
PROGRESS_EVERY = 200  # estimates


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


def open_installation(log: LogRun | LogFile, config: Installation | None) -> Installation:
    """The given installation, or the one kept in the log."""
    if config is not None:
        return config
    files = {name: text.encode() for name, text in log.header.files.items()}
    return installation_from_files(files, str(log.path))


def replay(
    path: Path | Sequence[Path],
    out: Path | None,
    config: Installation | None = None,
    pace: Callable[[Iterator[Event]], Iterator[Event]] | None = None,
    advance: Callable[[float], None] = lambda fraction: None,
    picture: FlightPicture | None = None,
    smoothed: Path | None = None,
) -> ReplaySummary:
    """Replay a log, or the files of one run; outputs and truth go to the log `out`, estimates to `picture`.

    `pace` may delay the events (playback at --speed 1); `advance` hears the fraction done. `smoothed`: what the whole
    flight, looked at from its end, says of every step, as CSV.
    """
    paths = (path,) if isinstance(path, Path) else path
    log = LogRun(paths)
    installation = open_installation(log, config)
    pipeline, _ = installation.warm_pipeline(_start_of(log) if config is None else None)
    score = flight_score(installation)
    tapes = pipeline.tapes() if smoothed is not None else ()
    with ExitStack() as opened:
        writer = opened.enter_context(new_log(out, _header(installation, log.header))) if out is not None else None
        truth = truth_rows(LogRun(paths), score.names, writer.copy if writer is not None else None)
        score.follow(truth)

        def take(outputs: Sequence[Output]) -> None:
            if writer is not None:  # one after the other, each with its own in the processor's memory
                for output in outputs:
                    writer.write_output(output)
            before = score.estimates
            for output in outputs:
                score.take(output)
                if picture is not None and isinstance(output, Estimate):
                    name = installation.config.aircraft.engines[output.engine]
                    picture.take(name, output, score.truth_n(name))
            if score.estimates // PROGRESS_EVERY > before // PROGRESS_EVERY:
                advance(log.position_bytes / max(log.size_bytes, 1))

        batches = log.batches() if pace is None else (EventBatch.of((event,)) for event in pace(log.events()))
        gc.freeze()  # the models and tables stay: no collection walks them meanwhile
        opened.callback(gc.unfreeze)
        run(batches, pipeline, _already_recorded, take)
        deque(truth, maxlen=0)  # what comes after the last estimate
    summary = _summary(log, score)
    if smoothed is not None:
        from thrustd.smoothed_flight import write_smoothed  # loads every kind of recording: half of a replay's start

        engines = installation.config.aircraft.engines
        scores = write_smoothed(smoothed, dict(zip(engines, tapes, strict=True)), truth_rows(LogRun(paths), engines))
        routes = {name: summary.scores.get(name, {}) | scores.get(name, {}) for name in (*summary.scores, *scores)}
        summary = msgspec.structs.replace(summary, scores=routes)
    advance(1.0)
    return summary


def _already_recorded(batch: EventBatch) -> None:
    """The log that is replayed holds it."""


def _header(installation: Installation, source: LogHeader) -> LogHeader:
    return installation.log_header(epoch_offset_ns=source.epoch_offset_ns, run=source.run, notes=source.notes)


def _start_of(log: LogRun) -> WarmStart | None:
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


class _Truth(msgspec.Struct):
    """A message of a /truth topic, of an engine or of a mount."""

    t_ns: int
    thrust_n: float = nan
    force_n: float = nan


def truth_rows(
    log: LogRun, names: Sequence[str], copy: Callable[[Sequence[LogMessage]], None] | None = None
) -> Iterator[TruthRow]:
    """What a simulated flight really did to `names`, in file order; its messages go to `copy`. None of a real one."""
    decode = msgspec.json.Decoder(list[_Truth]).decode
    by_topic = {f"{TRUTH_TOPIC}{name}": name for name in names}
    for messages in log.groups(by_topic):
        if copy is not None:
            copy(messages)
        rows = decode(b"[%b]" % b",".join([message.data for message in messages]))
        yield from [
            _new(TruthRow, (by_topic[m.topic], row.t_ns, row.thrust_n if isfinite(row.thrust_n) else row.force_n))
            for m, row in zip(messages, rows, strict=True)
        ]


def _summary(log: LogRun, score: FlightScore) -> ReplaySummary:
    return ReplaySummary(
        log=log.path.name,
        length_s=max(score.last_ns - score.first_ns, 0) * 1e-9,
        events=log.read_events,
        missing_events=log.missing_events,
        cut=log.cut,
        estimates=score.estimates,
        scores=score.scores(),
        faults={f"{where} {kind}": n for (where, kind), n in sorted(score.faults.items())},
    )
