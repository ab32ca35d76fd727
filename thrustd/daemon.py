"""The onboard process: sources -> pipeline -> sinks, from READY until a signal says stop.

    serial port, CAN bus, ticks -> one queue -> loop.run -> recorder, CAN out, live view, service manager

Everything that can fail for a reason worth telling fails before READY; afterwards nothing that arrives ends it.
"""

import gc
import signal
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from threading import Event as Flag
from typing import Any

import sdnotify

from thrustd.installation import Installation
from thrustd.loop import run
from thrustd.sinks.can_tx import CanTx
from thrustd.sinks.live_view import LiveView
from thrustd.sinks.log_recorder import LogRecorder, RecorderSettings
from thrustd.sources.can_bus import CanBus
from thrustd.sources.merge import EventQueue, merged
from thrustd.sources.serial_port import SerialPort
from thrustd.sources.ticker import Ticker
from thrustd.types import Event, Fault, Output
from thrustd.wire.can_frames import ICD_OUTPUT_ROWS


def fly(installation: Installation, base: Path, log_folder: Path | None = None) -> int:
    """Run until SIGTERM or SIGINT; `base`: the folder that relative names in the configuration start from."""
    config = installation.config
    pipeline = installation.pipeline()
    queue = EventQueue()
    bus = CanBus(config.can.interface, config.can.channel, config.can.bitrate, queue.put)
    receivers = (
        SerialPort(config.adc.port, config.adc.baud, queue.put),
        bus,
        Ticker(config.steps.tick_hz, queue.put),
    )
    with ExitStack() as opened, stop_on_signal() as stop:
        recorder, sinks = open_sinks(installation, bus, queue, base, log_folder, opened)
        service = sdnotify.SystemdNotifier()

        def record(event: Event | Fault) -> None:
            if recorder is not None:
                recorder.write_event(event)

        def listen(output: Output) -> None:
            for sink in sinks:
                sink.write_output(output)

        gc.collect()
        gc.freeze()  # the models and tables stay: no collection walks them in flight
        service.notify("READY=1")
        run(merged(queue, receivers, stop), pipeline, record, listen)
        service.notify("STOPPING=1")
    return 0


def open_sinks(
    installation: Installation,
    bus: CanBus,
    queue: EventQueue,
    base: Path,
    log_folder: Path | None,
    opened: ExitStack,
) -> tuple[LogRecorder | None, list[Any]]:
    """The recorder and all sinks that the configuration asks for; closed by `opened`."""
    config = installation.config
    header = installation.log_header(epoch_offset_ns=time.time_ns() - time.monotonic_ns())
    sinks: list[Any] = []
    recorder = None
    if config.log is not None or log_folder is not None:
        folder = log_folder if log_folder is not None else base / (config.log.folder if config.log else ".")
        limits = {} if config.log is None else {"rotate_mb": config.log.rotate_mb, "rotate_min": config.log.rotate_min}
        settings = RecorderSettings(folder, config.aircraft.name.lower(), reading_hz=config.steps.reading_hz, **limits)
        recorder = LogRecorder(settings, header, queue.put)
        sinks.append(opened.enter_context(closing(recorder)))
    if config.can_out is not None:
        table = installation.can_table(ICD_OUTPUT_ROWS)
        sinks.append(CanTx(table, config.can_out.node_id, config.can_out.rate_hz, bus.send, queue.put))
    if config.live_view is not None:
        view = LiveView(
            header.engines,
            header.mounts,
            queue.put,
            config.live_view.host,
            config.live_view.port,
            epoch_offset_ns=header.epoch_offset_ns,
        )
        sinks.append(opened.enter_context(closing(view)))
    return recorder, sinks


@contextmanager
def stop_on_signal() -> Iterator[Flag]:
    """A flag that SIGTERM and SIGINT set; the handlers before are put back."""
    stop = Flag()
    before = {number: signal.signal(number, lambda *_: stop.set()) for number in (signal.SIGTERM, signal.SIGINT)}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
