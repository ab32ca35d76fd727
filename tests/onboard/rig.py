"""A daemon and a bench as processes, and what their logs say beside an uninterrupted replay."""

import os
import signal
import socket
import subprocess
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from copy import deepcopy
from itertools import groupby
from math import isfinite, nan
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from tests.hil.test_hil import PATIENCE_S, ServiceManager, start, write_aircraft
from tests.wire.one_by_one import AdcSample, adc_items
from thrustd.core.types import Frame, MountOutput, Output
from thrustd.installation.installation import WarmStart, read_installation
from thrustd.replay.replay import open_installation
from thrustd.sources.mcap_log import LogFile
from thrustd.twin.flight import Rates, scripted_flight, write_flight
from thrustd.wire.adc_frames import AdcDecoder
from thrustd.wire.can_frames import ICD_INPUT_ROWS

FLOOR_N = 1000.0
MOUNTS = 4
ADC_RATES = Rates(adc_hz=100.0)
Floats = NDArray[np.float64]
KEPT_FLYING = """
[warm_restart]
file = "checkpoint.json"
max_age_s = 60 # a slow machine takes longer than the usual 10 s to start
[log]
folder = "logs"
"""


class Step(NamedTuple):
    """All mounts at one fused step.

    Steps of two runs go by the ADC's own time [us] of the sample that completed them: clocks play no part, nor does
    what a run took for the zeros of its transducers.
    """

    t_ns: int
    force_n: Floats  # (mounts,)


KEPT: list[socket.socket] = []  # ports of this process: bound, so that no other one is given them


def free_port() -> int:
    """A port that a server may listen on, which binds beside one that does not listen."""
    probe = socket.socket()
    probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    probe.bind(("127.0.0.1", 0))
    KEPT.append(probe)
    port: int = probe.getsockname()[1]
    return port


def reliable_aircraft(folder: Path) -> Path:
    """A configuration with everything that keeps it flying."""
    config = write_aircraft(folder)
    config.write_text(f"{config.read_text()}{KEPT_FLYING}[health]\nport = {free_port()}\n")
    return config


def twin_flight(config: Path, seconds: float, seed: int, rates: Rates = ADC_RATES) -> Path:
    installation = read_installation(config)
    path = config.parent / "flight.mcap"
    profile, airframe = scripted_flight(seconds, seed)
    table = installation.can_table(ICD_INPUT_ROWS)
    write_flight(path, profile, airframe, table, installation.log_header(), seed, rates)
    return path


class Daemon:
    """`thrustd run` under a service manager; `program`: another module that runs it, with its arguments."""

    def __init__(self, config: Path, manager: ServiceManager, program: tuple[str, ...] = ("thrustd",)) -> None:
        self._manager = manager
        self.process = start(["run", str(config)], manager.environment(), program)
        manager.wait_for("READY=1")

    def beats(self, count: int) -> None:
        """Wait for so many heartbeats of its loop."""
        for _ in range(count):
            self._manager.wait_for("WATCHDOG=1")

    def kill(self) -> str:
        """kill -9; -> what it said."""
        self.process.send_signal(signal.SIGKILL)
        return self._end()

    def stop(self) -> str:
        self.process.send_signal(signal.SIGTERM)
        return self._end()

    def close(self) -> None:
        """No process is left behind."""
        self.process.kill()
        self.process.communicate(timeout=PATIENCE_S)

    def _end(self) -> str:
        _, errors = self.process.communicate(timeout=PATIENCE_S)
        return errors.decode()


@contextmanager
def bench(config: Path, flight: Path, program: tuple[str, ...] = ("thrustd",)) -> Iterator[subprocess.Popen[bytes]]:
    process = start(["simulate", "--hil", str(config), "--log", str(flight), "--json"], dict(os.environ), program)
    try:
        yield process
    finally:
        process.kill()
        process.communicate(timeout=PATIENCE_S)


def log_steps(path: Path) -> dict[int, Step]:
    """Fused steps of a log."""
    log = LogFile(path)
    names = [mount.name for mount in open_installation(log, None).config.mount]
    topics = {f"/mount/{name}": number for number, name in enumerate(names)}
    rows = ((topics[topic], msgspec.json.decode(data)) for topic, _, data in log.messages(topics))
    outputs = (
        MountOutput(row["t_ns"], mount, row["deformation_mm"], row["force_n"], nan)
        for mount, row in rows
        if row["force_n"] is not None
    )
    return _steps(outputs, AdcClock(path))


class AdcClock:
    """The ADC's own time of the samples in a log."""

    def __init__(self, path: Path) -> None:
        log = LogFile(path)
        adc = open_installation(log, None).config.adc
        decoder, self._near_us = AdcDecoder(adc.channels, adc.sample_hz), 0.4e6 / adc.sample_hz
        chunks = (event for event in log.events() if isinstance(event, Frame) and event.channel == "adc")
        items = (item for event in chunks for item in adc_items(decoder, event.t_ns, event.data))
        samples = [(item.device_time_us, item.t_ns) for item in items if isinstance(item, AdcSample)]
        self._samples_us, arrived_ns = np.array(samples, np.int64).reshape(-1, 2).T  # none in a life of a moment
        late_us = arrived_ns / 1000 - self._samples_us
        self._offset_us = np.min(late_us, initial=np.inf)  # a sample is never newer than its arrival

    def of(self, t_ns: int) -> int | None:
        """The ADC's time [us] of the sample of this instant; None when there is none."""
        if not len(self._samples_us):
            return None
        wanted_us = t_ns / 1000 - self._offset_us
        nearest: int = self._samples_us[np.argmin(np.abs(self._samples_us - wanted_us))].item()
        return nearest if abs(nearest - wanted_us) < self._near_us else None


def uninterrupted(flight: Path, lives: Sequence[Path]) -> list[dict[int, Step]]:
    """What a pipeline that has flown the whole flight up to there makes of every life's own events.

    What is left to be seen is the state: both had the same events in the same order.
    """
    installation = open_installation(LogFile(flight), None)
    places = {time_us: (step, life) for life in lives for time_us, step in log_steps(life).items()}
    found: dict[Path, dict[int, Step]] = {}
    pipeline, clock = installation.pipeline(), AdcClock(flight)
    for event in LogFile(flight).events():
        for time_us, here in _steps(pipeline.feed(event), clock).items():
            there, life = places.get(time_us, (here, flight))
            if life not in (flight, *found):  # its first whole step
                begin = WarmStart(deepcopy(pipeline.snapshot()), there.t_ns - here.t_ns)
                other, _ = installation.warm_pipeline(begin)
                later = (event for event in LogFile(life).events() if event.t_ns > there.t_ns)
                found[life] = _steps((output for event in later for output in other.feed(event)), AdcClock(life))
    return [found.get(life, {}) for life in lives]


def _steps(outputs: Iterable[Output], clock: AdcClock) -> dict[int, Step]:
    """Those at which every mount had a sample."""
    mounts = (output for output in outputs if isinstance(output, MountOutput) and isfinite(output.force_n))
    together = [(t_ns, tuple(group)) for t_ns, group in groupby(mounts, lambda output: output.t_ns)]
    return {
        time_us: Step(t_ns, np.array([output.force_n for output in group]))
        for t_ns, group in together
        if len(group) == MOUNTS and (time_us := clock.of(t_ns)) is not None
    }


def deviations(live: dict[int, Step], reference: dict[int, Step], after_ns: int) -> Floats:
    """(steps, mounts) of |force / reference - 1| (of 1 kN when that is larger) at the steps after `after_ns`."""
    settled = [us for us, step in live.items() if step.t_ns > after_ns and us in reference]
    live_n, reference_n = (np.reshape([side[us].force_n for us in settled], (-1, MOUNTS)) for side in (live, reference))
    return np.asarray(np.abs(live_n - reference_n) / np.maximum(np.abs(reference_n), FLOOR_N))
