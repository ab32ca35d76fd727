"""The onboard process starts and flies although nothing around it works."""

import os
import resource
import signal
import socket
import subprocess
from contextlib import suppress

from tests.hil.test_hil import PATIENCE_S, ServiceManager, start
from tests.onboard.rig import Daemon, reliable_aircraft
from thrustd.core.config import Realtime
from thrustd.installation.installation import read_installation
from thrustd.onboard.daemon import stop_on_signal
from thrustd.onboard.realtime import ask_for
from thrustd.sources.mcap_log import LogFile


def occupied(place):
    """A port of this machine that is taken."""
    place.bind(("127.0.0.1", 0))
    place.listen()
    return place.getsockname()[1]


def test_no_disk_no_ports_no_sensors_no_more_files_and_a_damaged_checkpoint(tmp_path):
    config = reliable_aircraft(tmp_path)
    (tmp_path / "logs").write_text("a file where the folder of the logs should be")
    (tmp_path / "checkpoint.json").write_text('{"sha256": "00", "body": {}}')
    with socket.socket() as one, socket.socket() as other, ServiceManager(tmp_path / "notify") as manager:
        health, view = (occupied(place) for place in (one, other))
        text = config.read_text().replace(f"port = {read_installation(config).config.health.port}", f"port = {health}")
        config.write_text(f"{text}\n[live_view]\nport = {view}\n")
        daemon = Daemon(config, manager)
        try:
            assert manager.wait_for("not recording")  # in the status line of a heartbeat
            resource.prlimit(daemon.process.pid, resource.RLIMIT_NOFILE, (3, 3))  # and no more files from now on
            daemon.beats(3)
            words = daemon.stop()
        finally:
            daemon.close()
    assert daemon.process.returncode == 0
    assert f"health.port = {health}: cannot be bound" in words
    assert f"live_view = 127.0.0.1:{view}: cannot be bound" in words
    assert "adc: unplugged: a port or bus disappeared or refuses to open" in words
    assert "damaged: its checksum does not match: starting cold" in words
    assert "Traceback" not in words


def refusal(config):
    """Exit status and words of a process that is not let in."""
    process = start(["run", str(config)], dict(os.environ))
    try:
        _, words = process.communicate(timeout=PATIENCE_S)
    finally:
        process.kill()
    return process.returncode, words.decode()


def test_one_configuration_is_flown_once_and_ends_well_when_its_terminal_goes(tmp_path):
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # under nohup children would ignore it, as they should
    config = reliable_aircraft(tmp_path)
    config.write_text(f"{config.read_text()}[realtime]\nfifo_priority = 5\n")
    with ServiceManager(tmp_path / "notify") as manager:
        daemon = Daemon(config, manager)
        try:
            assert len(set(policies(daemon.process.pid))) == 1  # or one that waits holds the interpreter of the others
            link = tmp_path / "other_name.toml"
            link.symlink_to(config)
            refused = refusal(link)
            copied = tmp_path / "copied.toml"
            copied.write_bytes(config.read_bytes())
            refused_copy = refusal(copied)
            manager.read_on()
            daemon.beats(2)
            daemon.process.send_signal(signal.SIGHUP)
            assert manager.wait_for("STOPPING=1")
            _, errors = daemon.process.communicate(timeout=PATIENCE_S)
        finally:
            daemon.close()
    said = (
        f"flown by process {daemon.process.pid} already, expected one process per configuration, checkpoint and log\n"
    )
    assert refused == (2, f"thrustd: {link}: {said}")
    assert refused_copy == (2, f"thrustd: {tmp_path / 'logs' / 'test'}: {said}")
    assert daemon.process.returncode == 0, errors
    [log] = (tmp_path / "logs").glob("*.mcap")
    file = LogFile(log)
    assert len(list(file.events())) > 10
    assert not file.cut


def test_a_signal_that_is_sent_again_and_again_ends_no_log_half_written(tmp_path):
    config = reliable_aircraft(tmp_path)
    with ServiceManager(tmp_path / "notify") as manager:
        daemon = Daemon(config, manager)
        try:
            daemon.beats(2)
            while daemon.process.poll() is None:
                daemon.process.send_signal(signal.SIGINT)
                with suppress(subprocess.TimeoutExpired):
                    daemon.process.wait(timeout=0.001)
        finally:
            daemon.close()
    [log] = (tmp_path / "logs").glob("*.mcap")
    file = LogFile(log)
    assert len(list(file.events())) > 10
    assert not file.cut


def policies(process):
    """Of the scheduler, for each thread."""
    return [os.sched_getscheduler(int(thread)) for thread in os.listdir(f"/proc/{process}/task")]


def test_under_nohup_a_terminal_that_goes_is_not_the_end():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with stop_on_signal() as stop:
            signal.raise_signal(signal.SIGHUP)
            assert not stop.is_set()
            signal.raise_signal(signal.SIGTERM)
            assert stop.is_set()
    finally:
        signal.signal(signal.SIGHUP, before)


def test_what_the_kernel_refuses_is_said_and_flown_without(monkeypatch):
    def refuse(*_):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr("os.sched_setscheduler", refuse)
    monkeypatch.setattr(resource, "getrlimit", lambda _: (65536, 65536))
    said = []
    ask_for(Realtime(fifo_priority=20, lock_memory=True), said.append)
    assert [word.split(":")[0] for word in said] == ["realtime.fifo_priority = 20", "realtime.lock_memory = true"]
    assert all("refused" in word for word in said)


def test_nothing_is_asked_of_the_kernel_unless_wished(monkeypatch):
    monkeypatch.delattr("os.sched_setscheduler")
    ask_for(Realtime(), lambda word: None)
