"""The onboard process: sources -> pipeline -> sinks, from READY until a signal says stop.

    serial port, CAN bus, ticks -> one queue -> loop.run -> recorder, CAN out, live view, health page
                                                   once a second: service manager, checkpoint, clock

What is wrong with the configuration or a model fails before READY. A disk, a port or a bus that refuses is a fault and
flies along; afterwards nothing that arrives ends the process.
"""

import gc
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from functools import partial
from pathlib import Path
from threading import Event as Flag
from typing import Any, NamedTuple

import msgspec

from thrustd.core.errors import ConfigError
from thrustd.core.types import Fault, Output
from thrustd.installation.installation import CONFIG, WARM_START, Installation, WarmStart
from thrustd.onboard.checkpoint import SCHEMA, Checkpoint, Clocks, Resume, at_start, clocks, encode, read_checkpoint
from thrustd.onboard.heartbeat import Heartbeat, ServiceManager, status_line
from thrustd.onboard.one_process import only_one
from thrustd.onboard.realtime import ask_for
from thrustd.pipeline.loop import run
from thrustd.pipeline.pipeline import Pipeline
from thrustd.sinks.can_tx import CanTx
from thrustd.sinks.health_counts import HealthCounts
from thrustd.sinks.health_page import HealthPage, Watched
from thrustd.sinks.journal import Journal, say
from thrustd.sinks.latest_file import LatestFile
from thrustd.sinks.live_point import LivePoint
from thrustd.sinks.live_view import LiveView
from thrustd.sinks.log_recorder import LogRecorder, RecorderSettings
from thrustd.sources.can_bus import CanBus
from thrustd.sources.merge import EventQueue, merged
from thrustd.sources.serial_port import SerialPort
from thrustd.sources.ticker import Ticker
from thrustd.wire.can_frames import ICD_OUTPUT_ROWS
from thrustd.wire.event_batch import EventBatch
from thrustd.wire.log_layout import LogHeader

ENDS = signal.SIGTERM, signal.SIGINT, signal.SIGHUP  # the last: its terminal went
SWITCH_S = 0.001  # a thread that computes gives way to a waiting one after this: about the length of a fused step


class Shell(NamedTuple):
    """What the parts around the pipeline share."""

    installation: Installation
    base: Path  # relative names in the configuration start here
    queue: EventQueue
    opened: ExitStack  # closes them


def fly(installation: Installation, base: Path, log_folder: Path | None = None) -> int:
    """Run until a signal of ENDS; `base`: the folder that relative names in the configuration start from."""
    config = installation.config
    queue, counts, service = EventQueue(), HealthCounts(), ServiceManager()
    with stop_on_signal() as stop, ExitStack() as opened:  # a second signal does not break off the end of the log
        shell = claim(Shell(installation, base, queue, opened), log_folder)
        pipeline, start = start_pipeline(shell)
        ask_for(config.realtime, say)  # before any thread: one that waits for the processor may hold the interpreter
        can, where = config.can, f"{installation.where}: can"
        bus = CanBus(can.interface, can.channel, can.bitrate, queue.leave, where=where)
        adc = SerialPort(config.adc.port, config.adc.baud, queue.put)
        recorder, sinks = open_sinks(shell, bus, counts, log_folder, start)
        saver = open_checkpoint(shell, pipeline)
        point = LivePoint(len(config.aircraft.engines))
        sinks.append(point)
        open_health(shell, counts, recorder, saver, point)
        words = partial(status_line, counts, tuple(config.aircraft.engines), point.words)
        heart = Heartbeat(service, words, clocks, queue.put, saver.save)

        def record(batch: EventBatch) -> None:
            if recorder is not None:
                recorder.write_batch(batch)
            counts.take_batch(batch)

        def listen(outputs: Sequence[Output]) -> None:
            for sink in sinks:
                for output in outputs:
                    sink.write_output(output)
            if recorder is not None and outputs:
                recorder.wake()  # not earlier: its thread would hold up these estimates
            heart.take_time(counts.heard_ns)  # nor would the state that it saves

        _settle()
        service.say(f"READY=1\nSTATUS={words()}")
        say(f"ready, recording to {recorder.path}" if recorder and recorder.path else "ready, not recording")
        ticker = Ticker(config.steps.tick_hz, queue.put)
        heard = merged(queue, (adc, bus, ticker), stop, quiet=pipeline.quiet_until_ns)
        run(map(EventBatch.of, heard), pipeline, record, listen)
        service.say("STOPPING=1")
    return 0


def _settle() -> None:
    """The last thing before READY."""
    gc.collect()
    gc.freeze()  # the models and tables stay: no collection walks them in flight
    gc.enable()
    sys.setswitchinterval(SWITCH_S)


def start_pipeline(shell: Shell) -> tuple[Pipeline, WarmStart | None]:
    """Warm when there is a good checkpoint, and what was taken over; else cold, with a word."""
    for line in shell.installation.uncorrected():
        say(line)
    wish = shell.installation.config.warm_restart
    if wish is None:
        return shell.installation.pipeline(), None
    path = shell.base / wish.file
    found = read_checkpoint(path, shell.installation.hashes(), at_start(clocks()), wish.max_age_s)
    pipeline, warm = shell.installation.warm_pipeline(found.start)
    if found.start is not None and not warm:
        found = Resume(None, f"{path}: does not fit this pipeline: starting cold", True, found.service)
    say(found.word)
    if found.refused:
        shell.queue.put(Fault(time.monotonic_ns(), "checkpoint", "cold"))
    if warm:
        return pipeline, found.start
    service_s = found.service_s(shell.installation.service_h())
    for line in found.overruled(shell.installation.service_h()):
        say(line)
    pipeline.serve_from(service_s)
    return pipeline, WarmStart(None, service_s=service_s)


class Saver:
    """Hands the state to the checkpoint's thread; does nothing when the configuration wants no checkpoint."""

    def __init__(self, file: LatestFile[Checkpoint] | None, installation: Installation, pipeline: Pipeline) -> None:
        self._file, self._sha256, self._pipeline = file, installation.hashes(), pipeline
        self._service_h = installation.service_h()

    @property
    def written_ns(self) -> int | None:
        return None if self._file is None else self._file.written_ns

    def save(self, now: Clocks) -> None:
        if self._file is not None:
            served = zip(self._service_h.items(), self._pipeline.service_s, strict=True)
            service = {name: (began_h, now_s) for (name, began_h), now_s in served}
            self._file.put(Checkpoint(SCHEMA, now, self._sha256, self._pipeline.snapshot(), service))


def open_checkpoint(shell: Shell, pipeline: Pipeline) -> Saver:
    wish = shell.installation.config.warm_restart
    if wish is None:
        return Saver(None, shell.installation, pipeline)
    file = LatestFile(shell.base / wish.file, encode, shell.queue.put)
    return Saver(shell.opened.enter_context(closing(file)), shell.installation, pipeline)


def open_sinks(
    shell: Shell, bus: CanBus, counts: HealthCounts, log_folder: Path | None, start: WarmStart | None
) -> tuple[LogRecorder | None, list[Any]]:
    """The recorder, and all sinks for outputs that the configuration asks for, the most urgent first."""
    installation, put = shell.installation, shell.queue.put
    config = installation.config
    notes = {} if start is None else {WARM_START: msgspec.json.encode(start).decode()}
    header = installation.log_header(epoch_offset_ns=time.time_ns() - time.monotonic_ns(), notes=notes)
    sinks: list[Any] = []
    if config.can_out is not None:
        table = installation.can_table(ICD_OUTPUT_ROWS)
        node_id, rate_hz = config.can_out.node_id, config.can_out.rate_hz
        sinks.append(CanTx(table, node_id, rate_hz, config.steps.estimate_hz, bus.send, put))
    sinks.append(counts)  # how late an estimate is out: behind the bus, before the rest
    recorder = None
    folder = log_folder_of(shell, log_folder)
    if folder is not None:
        limits = {}
        if config.log is not None:
            limits = {name: getattr(config.log, name) for name in ("rotate_mb", "rotate_min", "keep_free_mb")}
        settings = RecorderSettings(folder, config.aircraft.name.lower(), reading_hz=config.steps.reading_hz, **limits)
        recorder = LogRecorder(settings, header, put)
        sinks.append(shell.opened.enter_context(closing(recorder)))
        if recorder.path is None:
            say(f"log.folder = {folder}: cannot be written: not recording until it can")
    view = open_live_view(shell, header)
    return recorder, [*sinks, *([] if view is None else [view]), shell.opened.enter_context(closing(Journal()))]


def claim(shell: Shell, log_folder: Path | None) -> Shell:
    """Hold what one process alone may write: the checkpoint, and in the folder the logs of this aircraft."""
    config, folder = shell.installation.config, log_folder_of(shell, log_folder)
    logs = [] if folder is None else [folder / config.aircraft.name.lower()]
    checkpoints = [] if config.warm_restart is None else [shell.base / config.warm_restart.file]
    for path in (*logs, *checkpoints):
        shell.opened.enter_context(only_one(path))
    return shell


def log_folder_of(shell: Shell, log_folder: Path | None) -> Path | None:
    """Where to record; None = nowhere."""
    log = shell.installation.config.log
    if log_folder is not None or log is None:
        return log_folder
    return shell.base / log.folder


def open_live_view(shell: Shell, header: LogHeader) -> LiveView | None:
    wish, put = shell.installation.config.live_view, shell.queue.put
    if wish is None:
        return None
    try:
        view = LiveView(wish, header, put, say)
    except ConfigError as problem:  # nobody need see the thrust for it to be estimated
        say(str(problem))
        put(Fault(time.monotonic_ns(), "live_view", "not_sent"))
        return None
    return shell.opened.enter_context(closing(view))


def open_health(
    shell: Shell, counts: HealthCounts, recorder: LogRecorder | None, saver: Saver, point: LivePoint
) -> None:
    config, hashes = shell.installation.config, shell.installation.hashes()
    if config.health is None:
        return
    watched = Watched(
        engines=tuple(config.aircraft.engines),
        about={"aircraft": config.aircraft.name, "config_sha256": hashes[CONFIG]},
        queue_events=shell.queue.waiting,
        shed_events=lambda: shell.queue.shed_events,
        log_folder=None if recorder is None else recorder.folder,
        log_path=lambda: None if recorder is None else recorder.path,
        log_missing=lambda: (0, 0) if recorder is None else (recorder.dropped_items, recorder.lost_items),
        checkpoint_ns=lambda: saver.written_ns,
        steady_s=lambda: (float(point.steady_s), point.due_s),
    )
    try:
        shell.opened.enter_context(closing(HealthPage(counts, watched, config.health.port)))
    except ConfigError as problem:
        say(str(problem))
        shell.queue.put(Fault(time.monotonic_ns(), "health", "not_sent"))


@contextmanager
def stop_on_signal() -> Iterator[Flag]:
    """A flag that ENDS set; the handlers before are put back."""
    stop = Flag()
    hung_up_on = signal.getsignal(signal.SIGHUP) != signal.SIG_IGN  # under nohup it flies on
    ends = ENDS if hung_up_on else tuple(end for end in ENDS if end != signal.SIGHUP)
    before = {number: signal.signal(number, lambda *_: stop.set()) for number in ends}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
