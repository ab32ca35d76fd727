"""A daemon and a bench as processes, and what their logs say beside an uninterrupted replay."""

import os
import signal
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec

from tests.hil.test_hil import PATIENCE_S, ServiceManager, start, write_aircraft
from thrustd.installation import read_installation
from thrustd.sources.mcap_log import LogFile
from thrustd.twin.flight import Rates, scripted_flight, write_flight
from thrustd.wire.can_frames import ICD_INPUT_ROWS

FLOOR_N = 1000.0
KEPT_FLYING = """
[warm_restart]
file = "checkpoint.json"
max_age_s = 60 # a slow machine takes longer than the usual 10 s to start
[log]
folder = "logs"
"""


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


def reliable_aircraft(folder: Path) -> Path:
    """A configuration with everything that keeps it flying."""
    config = write_aircraft(folder)
    config.write_text(f"{config.read_text()}{KEPT_FLYING}[health]\nport = {free_port()}\n")
    return config


def twin_flight(config: Path, seconds: float, seed: int) -> Path:
    installation = read_installation(config)
    path = config.parent / "flight.mcap"
    profile, airframe = scripted_flight(seconds, seed)
    table = installation.can_table(ICD_INPUT_ROWS)
    write_flight(path, profile, airframe, table, installation.log_header(), seed, Rates(adc_hz=100.0))
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
def bench(config: Path, flight: Path) -> Iterator[subprocess.Popen[bytes]]:
    process = start(["simulate", "--hil", str(config), "--log", str(flight), "--json"], dict(os.environ))
    try:
        yield process
    finally:
        process.kill()
        process.communicate(timeout=PATIENCE_S)


def forces(path: Path, mount: str) -> list[tuple[int, float, float]]:
    """(t_ns, deformation_mm, force_n) of one mount at every fused step that had a sample."""
    rows = [msgspec.json.decode(message.data) for message in LogFile(path).messages((f"/mount/{mount}",))]
    return [(row["t_ns"], row["deformation_mm"], row["force_n"]) for row in rows if row["force_n"] is not None]


def deviation(live: list[tuple[int, float, float]], reference: list[tuple[int, float, float]]) -> list[float]:
    """Relative deviation of each live force from the reference at the same ADC samples (of 1 kN when that is larger).

    The mean deformation of a step, to the last bit, says which samples it is of: clocks play no part.
    """
    known = {deformation_mm: force_n for _, deformation_mm, force_n in reference}
    return [(force_n - known[mm]) / max(abs(known[mm]), FLOOR_N) for _, mm, force_n in live if mm in known]
