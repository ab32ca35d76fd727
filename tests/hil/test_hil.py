"""Two processes: the twin on a real pty and a real CAN bus, and the unchanged daemon that reads them."""

import os
import signal
import socket
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import msgspec
import pytest

from tests.conftest import small_aircraft
from thrustd.installation.installation import CONFIG, read_installation
from thrustd.replay.replay import replay
from thrustd.sources.mcap_log import LogFile
from thrustd.twin.flight import Rates, scripted_flight, write_flight
from thrustd.wire.can_frames import ICD_INPUT_ROWS

FLIGHT_S = 20.0
PATIENCE_S = 120  # far beyond what a busy machine needs


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """Fly once; -> (folder, log that the daemon wrote, report of the bench)."""
    folder = tmp_path_factory.mktemp("hil")
    config = write_aircraft(folder)
    installation = read_installation(config)
    flight = folder / "flight.mcap"
    profile, airframe = scripted_flight(FLIGHT_S, 3)
    table = installation.can_table(ICD_INPUT_ROWS)
    write_flight(flight, profile, airframe, table, installation.log_header(), 3, Rates(adc_hz=100.0))
    with ServiceManager(folder / "notify") as manager:
        daemon = start(["run", str(config), "--log-folder", str(folder / "logs")], manager.environment())
        try:
            assert manager.wait_for("READY=1")
            bench = start(["simulate", "--hil", str(config), "--log", str(flight), "--json"], dict(os.environ))
            report, _ = bench.communicate(timeout=PATIENCE_S)
            assert bench.returncode == 0
            daemon.send_signal(signal.SIGTERM)
            _, errors = daemon.communicate(timeout=PATIENCE_S)
        finally:
            daemon.kill()
    assert daemon.returncode == 0, errors
    assert b"Traceback" not in errors
    return folder, next((folder / "logs").glob("*.mcap")), msgspec.json.decode(report)


def write_aircraft(folder: Path) -> Path:
    aircraft = small_aircraft()
    for name, content in aircraft.files.items():
        (folder / name).write_bytes(content)
    text = aircraft.files[CONFIG].decode()
    text = text.replace('"loop://"', f'"{folder}/adc"').replace('"virtual"', '"fifo"')
    text = text.replace('channel = "test"', f'channel = "{folder}/can"')
    path = folder / "aircraft.toml"
    path.write_text(text)
    return path


def start(
    verb: list[str], environment: dict[str, str], program: tuple[str, ...] = ("thrustd",)
) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", *program, *verb]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


class ServiceManager:
    """The socket that systemd would listen on."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)

    def __enter__(self) -> "ServiceManager":
        self._socket.bind(str(self._path))
        self._socket.settimeout(PATIENCE_S)
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def environment(self) -> dict[str, str]:
        return {**os.environ, "NOTIFY_SOCKET": str(self._path)}

    def read_on(self) -> None:
        """Take what has come until now: a socket that nobody reads holds a dozen messages, then they are lost."""
        self._socket.setblocking(False)
        with suppress(BlockingIOError):
            while True:
                self._socket.recv(4096)
        self._socket.settimeout(PATIENCE_S)

    def wait_for(self, message: str) -> bool:
        while True:
            if message in self._socket.recv(4096).decode():
                return True


def estimates(path: Path) -> list[bytes]:
    return [m.data for m in LogFile(path).messages(("/estimate/left", "/estimate/right", "/mount/left_upper"))]


def test_the_daemon_estimates_what_the_twin_flies(flown):
    _, log, report = flown
    assert report["serial_lost"] == 0
    assert report["can_lost"] == 0
    assert len(estimates(log)) > 0.8 * FLIGHT_S * 50 * 3  # it may find the port late, by its back-off
    assert LogFile(log).missing_events == 0


def test_replaying_the_log_of_the_live_run_gives_the_same_estimates_bit_for_bit(flown):
    folder, log, _ = flown
    again = folder / "again.mcap"
    summary = replay(log, again)
    assert estimates(again) == estimates(log)
    assert summary.estimates > 0
