"""Run a log through the pipeline again: write the estimates, score them against the truth where there is one."""

import gc
import hashlib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from itertools import chain, pairwise
from math import isfinite, nan
from pathlib import Path
from typing import NamedTuple

import msgspec

from thrustd.core.errors import LogError
from thrustd.core.types import Estimate, Event, Output
from thrustd.fusion.smoother import Tape
from thrustd.installation.installation import WARM_START, Installation, WarmStart, installation_from_files
from thrustd.pipeline.loop import run
from thrustd.replay.means import EngineMeans
from thrustd.replay.picture import FlightPicture
from thrustd.replay.score import FlightScore, Score, Truth
from thrustd.sinks.mcap_log import LogWriter, new_log
from thrustd.sources.log_run import LogRun
from thrustd.sources.mcap_log import Hear, LogFile
from thrustd.sources.mcap_walk import LogMessage
from thrustd.wire.event_batch import EventBatch
from thrustd.wire.log_layout import TRUTH_TOPIC, LogHeader

PROGRESS_EVERY = 200  # estimates
Pace = Callable[[Iterator[Event]], Iterator[Event]]


class ReplaySummary(msgspec.Struct, frozen=True):
    """What a replay did."""

    log: str
    length_s: float
    events: int
    missing_events: int
    cut: bool  # the log ended without a summary: the recorder was killed
    damage: str  # what is lost of a damaged log, in words; empty of a whole one
    estimates: int
    engines: dict[str, EngineMeans]  # what the estimates say of themselves
    scores: dict[str, dict[str, Score]]  # engine or mount -> source -> estimate against truth; empty without truth
    faults: dict[str, int]  # "where kind" -> count
    error: str = "estimate minus truth"  # what `scores` are of


def open_installation(log: LogRun | LogFile, config: Installation | None) -> Installation:
    """The given installation, or the one kept in the log."""
    if config is not None:
        return config
    files = {name: text.encode() for name, text in log.header.files.items()}
    for name, content in files.items():
        if (digest := hashlib.sha256(content).hexdigest()) != log.header.sha256.get(name, digest):
            raise LogError(f"{log.path}: {name} in it is damaged: its SHA-256 is another; give one with --config")
    return installation_from_files(files, str(log.path))


def replay(
    log: Path | LogRun,
    out: Path | None,
    config: Installation | None = None,
    pace: Pace | None = None,
    *,
    advance: Callable[[float], None] = lambda fraction: None,
    picture: FlightPicture | None = None,
    smoothed: Path | None = None,
) -> ReplaySummary:
    """Replay a log, or a run of several files; outputs and truth go to the log `out`, estimates to `picture`.

    `pace` may delay the events (playback at --speed 1); `advance` hears the fraction done. `smoothed`: what the whole
    flight, looked at from its end, says of every step, as CSV.
    """
    log = LogRun((log,)) if isinstance(log, Path) else log
    installation = open_installation(log, config)
    pipeline, _ = installation.warm_pipeline(start_of(log) if config is None else None)
    score = flight_score(installation)
    tapes = pipeline.tapes() if smoothed is not None else ()
    engines = installation.config.aircraft.engines
    with ExitStack() as opened:
        writer = opened.enter_context(new_log(out, _header(installation, log.header))) if out is not None else None
        listener = _Listener(log, engines, score, writer, picture, advance)
        batches = _batches(log, truth_topics(score.names), listener.hear, pace)
        gc.freeze()  # the models and tables stay: no collection walks them meanwhile
        gc.enable()
        opened.callback(gc.unfreeze)
        run(batches, pipeline, _already_recorded, listener.take)
    summary = _summary(log, score)
    if smoothed is not None:
        summary = _smooth(smoothed, dict(zip(engines, tapes, strict=True)), log, summary)
    advance(1.0)
    return summary


class _Listener(NamedTuple):
    """Who hears what the log says was true, and what the pipeline says."""

    log: LogRun
    engines: Sequence[str]
    score: FlightScore
    writer: LogWriter | None
    picture: FlightPicture | None
    advance: Callable[[float], None]

    def hear(self, messages: Sequence[LogMessage]) -> None:
        if self.writer is not None:
            self.writer.copy(messages)
        for truth in truth_of(messages):
            self.score.hear(truth)

    def take(self, outputs: Sequence[Output]) -> None:
        if self.writer is not None:  # one after the other, each with its own in the processor's memory
            self.writer.write_outputs(outputs)
        before = self.score.estimates
        for output in outputs:
            self.score.take(output)
        if self.picture is not None:
            self.draw(self.picture, outputs)
        if self.score.estimates // PROGRESS_EVERY > before // PROGRESS_EVERY:
            self.advance(self.log.position_bytes / max(self.log.size_bytes, 1))

    def draw(self, picture: FlightPicture, outputs: Sequence[Output]) -> None:
        for estimate in outputs:
            if isinstance(estimate, Estimate):
                name = self.engines[estimate.engine]
                picture.take(name, estimate, self.score.truth_n(name, estimate.t_ns))


def _smooth(path: Path, tapes: Mapping[str, Tape], log: LogRun, summary: ReplaySummary) -> ReplaySummary:
    """Writes the smoothed flight; its scores are added to the summary."""
    from thrustd.replay.smoothed import write_smoothed  # loads every kind of recording: half of a replay's start

    groups = log.groups(truth_topics(tuple(tapes)))
    scores = write_smoothed(path, tapes, [truth for messages in groups for truth in truth_of(messages)])
    sources = {name: summary.scores.get(name, {}) | scores.get(name, {}) for name in (*summary.scores, *scores)}
    return msgspec.structs.replace(summary, scores=sources)


def _already_recorded(batch: EventBatch) -> None:
    """The log that is replayed holds it."""


def _header(installation: Installation, source: LogHeader) -> LogHeader:
    return installation.log_header(epoch_offset_ns=source.epoch_offset_ns, run=source.run, notes=source.notes)


def start_of(log: LogRun | LogFile) -> WarmStart | None:
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


class _Row(msgspec.Struct):
    """A message of a /truth topic, of an engine or of a mount."""

    t_ns: int
    thrust_n: float = nan
    force_n: float = nan


_decode = msgspec.json.Decoder(list[_Row]).decode


def truth_topics(names: Sequence[str]) -> frozenset[str]:
    """Where a simulated flight says what it really did to them."""
    return frozenset(f"{TRUTH_TOPIC}{name}" for name in names)


def truth_of(messages: Iterable[LogMessage]) -> Iterator[Truth]:
    """What messages of `truth_topics` say, name by name."""
    by_topic: dict[str, list[bytes]] = {}
    for topic, _, data in messages:
        by_topic.setdefault(topic, []).append(data)
    for topic, said in by_topic.items():
        rows = _decode(b"[%b]" % b",".join(said))
        values_n = [row.thrust_n if isfinite(row.thrust_n) else row.force_n for row in rows]
        yield Truth(topic.removeprefix(TRUTH_TOPIC), [row.t_ns for row in rows], values_n)


def _batches(log: LogRun, topics: Collection[str], hear: Hear, pace: Pace | None) -> Iterator[EventBatch]:
    """Each when the next one was read: the truth at its end may be behind it."""
    late = (before for before, _ in pairwise(chain(log.batches(topics, hear), (EventBatch.of(()),))))
    if pace is None:
        return late
    return (EventBatch.of((event,)) for event in pace(event for batch in late for event in batch.events()))


def _summary(log: LogRun, score: FlightScore) -> ReplaySummary:
    return ReplaySummary(
        log=log.path.name,
        length_s=max(score.last_ns - score.first_ns, 0) * 1e-9,
        events=log.read_events,
        missing_events=log.missing_events,
        cut=log.cut,
        damage=log.damage,
        estimates=score.estimates,
        engines=score.means(),
        scores=score.scores(),
        faults={f"{where} {kind}": n for (where, kind), n in sorted(score.faults.items())},
    )
